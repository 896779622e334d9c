//! Tasks in order of time; those of one time in the order in which they were added.

use std::collections::BTreeMap;
use std::time::Duration;

#[derive(Debug)]
pub(super) struct TaskQueue<Task> {
    entries: BTreeMap<(Duration, u64), Task>,
    added: u64,
}

impl<Task> TaskQueue<Task> {
    pub(super) fn new() -> Self {
        Self { entries: BTreeMap::new(), added: 0 }
    }

    pub(super) fn add(&mut self, at: Duration, task: Task) {
        self.added += 1;
        self.entries.insert((at, self.added), task);
    }

    pub(super) fn next(&self) -> Option<Duration> {
        self.entries.keys().next().map(|(at, _)| *at)
    }

    /// The first task due by `now`, with its time.
    pub(super) fn pop(&mut self, now: Duration) -> Option<(Duration, Task)> {
        let entry = self.entries.first_entry().filter(|entry| entry.key().0 <= now)?;
        let ((at, _), task) = entry.remove_entry();
        Some((at, task))
    }
}
