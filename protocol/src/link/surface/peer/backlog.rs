//! The backlog of a vehicle, estimated between two reports.

use crate::link::LinkStats;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::Backlog;

/// The backlog in a report, and the bytes that had come in when the report did.
#[derive(Debug, Clone, Copy)]
pub(super) struct ReportedBacklog {
    backlog: Backlog,
    received: Backlog,
    at: Instant,
}

impl ReportedBacklog {
    pub(super) fn new(backlog: Backlog, stats: &LinkStats, now: Instant) -> Self {
        Self { backlog, received: received(stats), at: now }
    }

    /// The reported backlog less the bytes received since, and when the report came in.
    pub(super) fn left(&self, stats: &LinkStats) -> (Backlog, Instant) {
        let now = received(stats);
        let left = |reported: u32, before: u32, now: u32| reported.saturating_sub(now.wrapping_sub(before));
        let left = Backlog {
            map_bytes: left(self.backlog.map_bytes, self.received.map_bytes, now.map_bytes),
            other_bytes: left(self.backlog.other_bytes, self.received.other_bytes, now.other_bytes),
        };
        (left, self.at)
    }
}

/// Bytes that have come in so far, modulo 4 GiB.
fn received(stats: &LinkStats) -> Backlog {
    let of = |is_counted: fn(&Class) -> bool| {
        let counted = stats.received_by_class.iter().filter(|(class, _)| is_counted(class));
        counted.map(|(_, bytes)| bytes).sum::<u64>() as u32
    };
    let other_bytes = of(|class| matches!(class, Class::Layer(_) | Class::Exemplar));
    Backlog { map_bytes: of(|class| *class == Class::Map), other_bytes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::LayerId;

    #[test]
    fn bytes_received_after_the_report_reduce_the_backlog() {
        let (mut stats, now) = (LinkStats::default(), Instant::default());
        stats.receive(Class::Map, 900, now);
        let reported = ReportedBacklog::new(Backlog { map_bytes: 500, other_bytes: 40 }, &stats, now);
        stats.receive(Class::Map, 200, now);
        stats.receive(Class::Layer(LayerId::DEPTH), 30, now);
        stats.receive(Class::Layer(LayerId::CURIOSITY), 20, now);
        stats.receive(Class::Status, 50, now);
        assert_eq!(reported.left(&stats), (Backlog { map_bytes: 300, other_bytes: 0 }, now));
    }
}
