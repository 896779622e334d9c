//! Virtual time, which jumps from event to event.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A simulation in which time jumps from one event to the next.
pub trait VirtualTime {
    fn now(&self) -> Instant;

    /// Sets the time, which never decreases.
    fn set_now(&mut self, now: Instant);

    /// The time of the next event.
    fn next_event(&self) -> Instant;

    /// Handles the events that are due now.
    fn handle_events(&mut self);

    /// Lets every end act on its events and transmit.
    fn pump(&mut self);

    fn run(&mut self, duration: Duration) {
        self.run_until(self.now() + duration, |_| false);
    }

    /// Runs until `done`, which is called after every event, or until `until`; returns whether it was done.
    fn run_until(&mut self, until: Instant, mut done: impl FnMut(&Self) -> bool) -> bool {
        self.pump();
        while !done(self) {
            let next = self.next_event();
            if next > until {
                self.set_now(until);
                return false;
            }
            self.set_now(next.max(self.now()));
            self.handle_events();
            self.pump();
        }
        true
    }
}
