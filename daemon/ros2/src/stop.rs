//! Threads that end with their owner.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// Time that the end of a thread may take; DDS tells its peers in it that it ends.
const END_TIMEOUT: Duration = Duration::from_secs(1);

/// The owner's end of a thread: when it is dropped, the thread is told to end, and gets a moment for it.
#[derive(Debug)]
pub(crate) struct Owner {
    stop: Option<Sender<()>>,
    ended: Receiver<()>,
}

/// The thread's own end, by which it learns that it is to stop.
pub(crate) struct Owned {
    stop: Receiver<()>,
    /// Closed when the thread ends.
    _ended: Sender<()>,
}

pub(crate) fn ends() -> (Owner, Owned) {
    let (stop, stopped) = channel();
    let (ended, end) = channel();
    (Owner { stop: Some(stop), ended: end }, Owned { stop: stopped, _ended: ended })
}

impl Owned {
    /// Waits this long; returns whether the thread is to go on.
    pub fn wait(&self, time: Duration) -> bool {
        matches!(self.stop.recv_timeout(time), Err(std::sync::mpsc::RecvTimeoutError::Timeout))
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        drop(self.stop.take());
        let _ = self.ended.recv_timeout(END_TIMEOUT);
    }
}
