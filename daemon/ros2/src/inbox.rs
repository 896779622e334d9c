//! Received messages that wait for their reader.

use scenecast_messages::Message;
use std::any::Any;
use std::collections::VecDeque;
use std::fmt::Display;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};
use tokio::sync::Notify;

/// A message and the time at which it was received.
#[derive(Debug, Clone, PartialEq)]
pub struct Received<M> {
    pub message: M,
    /// By the clock that no step of the time of day moves.
    pub at: Instant,
    /// By the time of day, as stamps of ROS 2 are.
    pub time: SystemTime,
}

/// The messages of one subscription, the newest ones: a full inbox drops its oldest message. The subscription ends with it.
#[derive(Debug)]
pub struct Inbox<M> {
    shared: Arc<Shared<M>>,
    /// What fills it, and ends when it is dropped.
    pub(crate) feeds: Vec<Box<dyn Any + Send + Sync>>,
}

#[derive(Debug)]
struct Shared<M> {
    state: Mutex<State<M>>,
    arrived: Condvar,
    notify: Notify,
    capacity: usize,
}

#[derive(Debug)]
struct State<M> {
    waiting: VecDeque<Received<M>>,
    received: u64,
    dropped: u64,
    malformed: u64,
}

/// The end of an inbox that fills it; its clones fill the same inbox.
pub(crate) struct Filler<M>(Arc<Shared<M>>);

impl<M> Clone for Filler<M> {
    fn clone(&self) -> Self {
        Self(self.0.clone())
    }
}

impl<M: Message> Filler<M> {
    /// Puts a message; counts a sample that is none.
    pub fn put_read<E: Display>(&self, read: Result<M, E>, topic: &str) {
        match read {
            Ok(message) => self.put(message),
            Err(error) => {
                let count = self.put_malformed();
                // 1, 2, 4, 8, ...: a publisher of another type must not fill the log.
                if count.is_power_of_two() {
                    tracing::warn!("ROS 2: {topic}: {count} samples are no {}: {error}", M::DEFINITION.full_name());
                }
            }
        }
    }
}

impl<M> Shared<M> {
    fn state(&self) -> MutexGuard<'_, State<M>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<M> Filler<M> {
    pub fn put(&self, message: M) {
        let mut state = self.0.state();
        state.received += 1;
        if state.waiting.len() >= self.0.capacity {
            state.waiting.pop_front();
            state.dropped += 1;
        }
        state.waiting.push_back(Received { message, at: Instant::now(), time: SystemTime::now() });
        drop(state);
        self.0.arrived.notify_all();
        self.0.notify.notify_one();
    }

    /// Counts bytes that are no message of the type; returns how many there were so far.
    pub fn put_malformed(&self) -> u64 {
        let mut state = self.0.state();
        state.malformed += 1;
        state.malformed
    }
}

impl<M> Inbox<M> {
    /// An inbox for at most `capacity` messages, and the end that fills it.
    pub(crate) fn new(capacity: usize) -> (Self, Filler<M>) {
        let state = State { waiting: VecDeque::new(), received: 0, dropped: 0, malformed: 0 };
        let capacity = capacity.max(1);
        let shared =
            Arc::new(Shared { state: Mutex::new(state), arrived: Condvar::new(), notify: Notify::new(), capacity });
        (Self { shared: shared.clone(), feeds: Vec::new() }, Filler(shared))
    }

    /// The oldest message that waits.
    pub fn take(&self) -> Option<Received<M>> {
        self.shared.state().waiting.pop_front()
    }

    /// The newest message that waits; those before it are dropped and counted.
    pub fn take_newest(&self) -> Option<Received<M>> {
        let mut state = self.shared.state();
        let newest = state.waiting.pop_back();
        state.dropped += state.waiting.len() as u64;
        state.waiting.clear();
        newest
    }

    /// Waits until a message is there, at most this long; returns whether one is.
    pub fn wait(&self, timeout: Duration) -> bool {
        let state = self.shared.state();
        let waited = self.shared.arrived.wait_timeout_while(state, timeout, |state| state.waiting.is_empty());
        !waited.unwrap_or_else(PoisonError::into_inner).0.waiting.is_empty()
    }

    /// The oldest message, as soon as there is one. One task at a time may wait.
    pub async fn next(&self) -> Received<M> {
        loop {
            if let Some(received) = self.take() {
                return received;
            }
            self.shared.notify.notified().await;
        }
    }

    /// Messages that arrived, with those that were dropped later.
    pub fn received(&self) -> u64 {
        self.shared.state().received
    }

    /// Messages that were dropped, since newer ones arrived before they were taken.
    pub fn dropped(&self) -> u64 {
        self.shared.state().dropped
    }

    /// Samples on the topic that are no messages of its type.
    pub fn malformed(&self) -> u64 {
        self.shared.state().malformed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(capacity: usize, messages: std::ops::Range<u8>) -> Inbox<u8> {
        let (inbox, filler) = Inbox::new(capacity);
        messages.for_each(|message| filler.put(message));
        inbox
    }

    #[test]
    fn a_full_inbox_drops_its_oldest_message() {
        let inbox = filled(3, 0..5);
        assert_eq!((inbox.received(), inbox.dropped()), (5, 2));
        let taken: Vec<u8> = std::iter::from_fn(|| inbox.take()).map(|received| received.message).collect();
        assert_eq!(taken, [2, 3, 4]);
    }

    #[test]
    fn the_newest_message_displaces_those_before_it() {
        let inbox = filled(5, 0..3);
        assert_eq!(inbox.take_newest().map(|received| received.message), Some(2));
        assert_eq!((inbox.dropped(), inbox.take()), (2, None));
        assert!(!inbox.wait(Duration::ZERO));
    }
}
