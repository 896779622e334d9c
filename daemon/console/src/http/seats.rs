//! The seats of the streams of events.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// Open streams at a time.
pub(super) const MAX_STREAMS: usize = 64;
/// When all seats are taken, the oldest stream gives up its seat once it has had it for this time. The server cannot
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

    /// A seat for a new stream; `None` if all are taken, and none for longer than [`MIN_TIME`].
    pub(super) fn take(&self, now: Instant) -> Option<Seat> {
        let mut taken = self.lock();
        if taken.seats.len() >= MAX_STREAMS {
            let oldest = taken.seats.first_entry()?;
            if now.saturating_duration_since(oldest.get().since) < MIN_TIME {
                return None;
            }
            oldest.remove();
        }
        let number = taken.next;
        taken.next += 1;
        let (sender, end) = oneshot::channel();
        taken.seats.insert(number, Holder { since: now, _end: sender });
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
        let mut held: Vec<_> = (0..MAX_STREAMS).map(|_| seats.take(begin).unwrap()).collect();
        assert!(seats.take(begin + MIN_TIME / 2).is_none());
        let newer = seats.take(begin + MIN_TIME).unwrap();
        assert_eq!(held[0].end.try_recv(), Err(oneshot::error::TryRecvError::Closed), "the oldest must end");
        assert_eq!(held[1].end.try_recv(), Err(oneshot::error::TryRecvError::Empty));
        drop(held);
        let seated = seats.lock().seats.len();
        assert_eq!(seated, 1, "the seat of the newest stream alone is taken");
        drop(newer);
    }
}
