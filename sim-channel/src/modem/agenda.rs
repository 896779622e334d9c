//! Things to do at known times.

use crate::Duration;
use std::collections::BTreeMap;

/// Events in order of time; those of one time in the order in which they were entered.
#[derive(Debug)]
pub(super) struct Agenda<Event> {
    entries: BTreeMap<(Duration, u64), Event>,
    entered: u64,
}

impl<Event> Agenda<Event> {
    pub(super) fn new() -> Self {
        Self { entries: BTreeMap::new(), entered: 0 }
    }

    pub(super) fn add(&mut self, at: Duration, event: Event) {
        self.entered += 1;
        self.entries.insert((at, self.entered), event);
    }

    pub(super) fn next(&self) -> Option<Duration> {
        self.entries.keys().next().map(|(at, _)| *at)
    }

    /// The first event due by `now`, with its time.
    pub(super) fn pop(&mut self, now: Duration) -> Option<(Duration, Event)> {
        let entry = self.entries.first_entry().filter(|entry| entry.key().0 <= now)?;
        let ((at, _), event) = entry.remove_entry();
        Some((at, event))
    }
}
