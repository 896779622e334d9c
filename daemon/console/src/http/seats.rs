//! The seats of the streams of events.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Open streams at a time.
pub(super) const MAX_STREAMS: usize = 64;
/// When one principal has all seats, its oldest stream gives up its seat once it has had it for this time. The server cannot
/// see whether a client reads: the system's buffers hold what it does not read.
pub(super) const MIN_TIME: Duration = Duration::from_secs(8);

/// The seats, shared by all requests.
#[derive(Debug, Clone, Default)]
pub(super) struct Seats(Arc<Mutex<Taken>>);

#[derive(Debug, Default)]
struct Taken {
    next: u64,
    seats: BTreeMap<u64, Holder>,
}

#[derive(Debug)]
struct Holder {
    principal: String,
    since: Instant,
    /// Ends the stream when it is dropped.
    _end: oneshot::Sender<()>,
}

/// A seat; it is free again when this is dropped.
#[derive(Debug)]
pub(super) struct Seat {
    seats: Seats,
    number: u64,
    /// Resolves once the stream must end.
    pub(super) end: oneshot::Receiver<()>,
}

impl Seats {
    fn lock(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A seat for a new stream of a principal. If all are taken, the principal with most seats gives up its oldest one: at once to a
    /// principal with fewer seats, or else after [`MIN_TIME`]; `None` before.
    pub(super) fn take(&self, principal: &str, now: Instant) -> Option<Seat> {
        let mut taken = self.lock();
        if taken.seats.len() >= MAX_STREAMS {
            let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
            taken.seats.values().for_each(|holder| *counts.entry(&holder.principal).or_default() += 1);
            let held = counts.get(principal).copied().unwrap_or(0);
            let (greediest, most) = counts.into_iter().max_by_key(|(_, seats)| *seats)?;
            let (&oldest, holder) = taken.seats.iter().find(|(_, holder)| holder.principal == greediest)?;
            if held + 1 >= most && now.saturating_duration_since(holder.since) < MIN_TIME {
                return None;
            }
            taken.seats.remove(&oldest);
        }
        let number = taken.next;
        taken.next += 1;
        let (sender, end) = oneshot::channel();
        taken.seats.insert(number, Holder { principal: principal.to_owned(), since: now, _end: sender });
        Some(Seat { seats: self.clone(), number, end })
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.seats.lock().seats.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_stream_that_had_its_time_gives_up_its_seat() {
        let (seats, begin) = (Seats::default(), Instant::now());
        let mut held: Vec<_> = (0..MAX_STREAMS).map(|_| seats.take("ann", begin).unwrap()).collect();
        assert!(seats.take("ann", begin + MIN_TIME / 2).is_none());
        let newer = seats.take("ann", begin + MIN_TIME).unwrap();
        assert_eq!(held[0].end.try_recv(), Err(oneshot::error::TryRecvError::Closed), "the oldest must end");
        assert_eq!(held[1].end.try_recv(), Err(oneshot::error::TryRecvError::Empty));
        drop(held);
        let seated = seats.lock().seats.len();
        assert_eq!(seated, 1, "the seat of the newest stream alone is taken");
        drop(newer);
    }

    #[test]
    fn a_principal_with_all_seats_keeps_no_other_one_out() {
        let (seats, begin) = (Seats::default(), Instant::now());
        let mut crowd: Vec<_> = (0..MAX_STREAMS).map(|_| seats.take("victor", begin).unwrap()).collect();
        let mut operator = seats.take("ann", begin).unwrap();
        assert_eq!(crowd[0].end.try_recv(), Err(oneshot::error::TryRecvError::Closed));
        assert!(seats.take("victor", begin).is_none());
        assert!(seats.take("victor", begin + MIN_TIME).is_some());
        assert_eq!(operator.end.try_recv(), Err(oneshot::error::TryRecvError::Empty));
    }
}
