//! A second vehicle with the same address: one obeys, and the other one is not heard.

use crate::time::Instant;
use std::time::Duration;

/// The sign of a second vehicle: a hello of another run than the current one, and yet the current one goes on. A vehicle that has begun
/// another run sends nothing more in the one before.
#[derive(Debug, Default)]
pub(super) struct TwinWatch {
    /// The contact with the current run: since when without a gap, and its last new frame.
    contact: Option<(Instant, Instant)>,
    /// When another run said hello, or answered a call.
    stranger: Option<Instant>,
    /// When both were last heard.
    found: Option<Instant>,
}

impl TwinWatch {
    /// Longer than a frame of the run before may take.
    const LATE: Duration = Duration::from_secs(10);
    /// A vehicle answers a call once it has had no frame of its run for a minute, as after a silence. One that has taken turns for
    /// longer without a gap does not.
    const CALLABLE: Duration = Duration::from_secs(90);
    const GAP: Duration = Duration::from_secs(30);
    /// A sign of a second vehicle counts for this time: it may have got another address since.
    const LIFETIME: Duration = Duration::from_secs(600);

    /// Another run than the current one is heard.
    pub(super) fn handle_stranger(&mut self, now: Instant) {
        self.stranger.get_or_insert(now);
    }

    /// A call was answered: by a second vehicle, if the first one was in contact all the time.
    pub(super) fn handle_call_answer(&mut self, now: Instant) {
        let is_in_contact =
            |(since, last): (Instant, Instant)| now.since(last) < Self::GAP && now.since(since) >= Self::CALLABLE;
        if self.contact.is_some_and(is_in_contact) {
            self.handle_stranger(now);
        }
    }

    /// A new frame of the current run came in; returns whether a second vehicle is found by it.
    pub(super) fn handle_frame(&mut self, now: Instant) -> bool {
        let since = self.contact.filter(|(_, last)| now.since(*last) < Self::GAP).map_or(now, |(since, _)| since);
        self.contact = Some((since, now));
        if self.stranger.take_if(|at| now.since(*at) >= Self::LATE).is_none() {
            return false;
        }
        let was_found = self.is_found(now);
        self.found = Some(now);
        !was_found
    }

    /// Another run has become the current one, perhaps the one that was heard.
    pub(super) fn handle_new_run(&mut self) {
        (self.contact, self.stranger) = (None, None);
    }

    /// Whether two vehicles have this address, as far as is known.
    pub(super) fn is_found(&self, now: Instant) -> bool {
        self.found.is_some_and(|at| now.since(at) < Self::LIFETIME)
    }
}
