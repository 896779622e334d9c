//! What a vehicle had still to send, less what has come in since it said so.

use crate::link::LinkStats;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::Backlog;

/// What a report said, and how much had come in by then.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    backlog: Backlog,
    heard: Backlog,
    at: Instant,
}

impl Told {
    pub(super) fn new(backlog: Backlog, stats: &LinkStats, now: Instant) -> Self {
        Self { backlog, heard: heard(stats), at: now }
    }

    /// What is left of it, and when it was said.
    pub(super) fn left(&self, stats: &LinkStats) -> (Backlog, Instant) {
        let now = heard(stats);
        let left = |said: u32, before: u32, now: u32| said.saturating_sub(now.wrapping_sub(before));
        let left = Backlog {
            map_bytes: left(self.backlog.map_bytes, self.heard.map_bytes, now.map_bytes),
            other_bytes: left(self.backlog.other_bytes, self.heard.other_bytes, now.other_bytes),
        };
        (left, self.at)
    }
}

/// Bytes that have come in so far; they come round after 4 GB.
fn heard(stats: &LinkStats) -> Backlog {
    let of = |class| stats.heard_by_class.get(&class).copied().unwrap_or_default();
    let other: u64 = Class::PLANES.into_iter().chain([Class::Exemplar]).map(of).sum();
    Backlog { map_bytes: of(Class::Map) as u32, other_bytes: other as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_in_after_the_report_no_longer_waits() {
        let (mut stats, now) = (LinkStats::default(), Instant::default());
        stats.hear(Class::Map, 900, now);
        let told = Told::new(Backlog { map_bytes: 500, other_bytes: 40 }, &stats, now);
        stats.hear(Class::Map, 200, now);
        stats.hear(Class::Depth, 30, now);
        stats.hear(Class::Curiosity, 20, now);
        stats.hear(Class::Status, 50, now);
        assert_eq!(told.left(&stats), (Backlog { map_bytes: 300, other_bytes: 0 }, now));
    }
}
