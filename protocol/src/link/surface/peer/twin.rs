//! A second vehicle with the same address: one obeys, and the other one is not heard.

use crate::time::Instant;
use std::time::Duration;

/// The sign of a second vehicle: a hello of another run than the current one, and yet the current one goes on. A vehicle that has begun
/// another run sends nothing more in the one before.
#[derive(Debug, Default)]
pub(super) struct TwinWatch {
    /// When another run said hello, or answered a call.
    stranger: Option<Instant>,
    /// When both were last heard.
    found: Option<Instant>,
}

impl TwinWatch {
    /// Longer than a frame of the run before may take.
    const LATE: Duration = Duration::from_secs(10);
    /// A sign of a second vehicle counts for this time: it may have got another address since.
    const LIFETIME: Duration = Duration::from_secs(600);

    /// Another run than the current one is heard.
    pub(super) fn handle_stranger(&mut self, now: Instant) {
        self.stranger.get_or_insert(now);
    }

    /// A new frame of the current run came in; returns whether a second vehicle is found by it.
    pub(super) fn handle_frame(&mut self, now: Instant) -> bool {
        if self.stranger.take_if(|at| now.since(*at) >= Self::LATE).is_none() {
            return false;
        }
        let was_found = self.is_found(now);
        self.found = Some(now);
        !was_found
    }

    /// Another run has become the current one, perhaps the one that was heard.
    pub(super) fn handle_new_run(&mut self) {
        self.stranger = None;
    }

    /// Whether two vehicles have this address, as far as is known.
    pub(super) fn is_found(&self, now: Instant) -> bool {
        self.found.is_some_and(|at| now.since(at) < Self::LIFETIME)
    }
}
