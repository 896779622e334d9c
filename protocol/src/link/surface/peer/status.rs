//! The status of a vehicle, joined from its two chunks, and its backlog between two reports.

use crate::directive::{SlotId, SlotReport, SlotState};
use crate::link::{FrameNumber, LinkStats};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Backlog, PlannedPath, PoseDetails, VehicleStatus};

/// The pose and the report of a vehicle, of which one may come in before the other.
#[derive(Debug, Default)]
pub(super) struct StatusParts {
    latest: VehicleStatus,
    /// When the pose came in, and in which frame.
    pose: Option<(Instant, FrameNumber)>,
    /// The details of the pose that is to follow in the same frame.
    details: Option<(PoseDetails, FrameNumber)>,
    has_report: bool,
    whole: Option<(VehicleStatus, Instant)>,
}

impl StatusParts {
    /// The newest values of all fields; those of a chunk that has not come in are defaults.
    pub(super) fn latest(&self) -> &VehicleStatus {
        &self.latest
    }

    /// The status and when its pose came in, once both chunks are here.
    pub(super) fn whole(&self) -> Option<&(VehicleStatus, Instant)> {
        self.whole.as_ref()
    }

    /// The epoch of the label ids, once a report has come in.
    pub(super) fn epoch(&self) -> Option<u8> {
        self.has_report.then_some(self.latest.epoch)
    }

    /// Reads a pose, which is ignored if a newer one came in before; returns whether it makes sense.
    pub(super) fn read_pose(&mut self, payload: &[u8], number: FrameNumber, now: Instant) -> bool {
        let mut read = self.latest.clone();
        let is_read = read.read_pose(payload).is_ok();
        if is_read && self.pose.is_none_or(|(_, before)| before < number) {
            let details =
                self.details.take().filter(|(_, of)| *of == number).map(|(details, _)| details).unwrap_or_default();
            read.trail = details.trail.map(|trail| trail.corners(read.position)).unwrap_or_default();
            (read.intent, read.registration, read.faults) = (details.intent, details.registration, details.faults);
            (self.latest, self.pose) = (read, Some((now, number)));
        }
        self.join();
        is_read
    }

    /// Reads the details of a pose, which wait for the pose of their frame; returns whether they make sense.
    pub(super) fn read_details(&mut self, payload: &[u8], number: FrameNumber) -> bool {
        self.details = PoseDetails::decode(payload).ok().map(|details| (details, number));
        self.details.is_some()
    }

    /// Reads a report; returns whether it makes sense.
    pub(super) fn read_report(&mut self, payload: &[u8]) -> bool {
        let before = self.latest.slots;
        let is_read = self.latest.read_report(payload).is_ok();
        self.has_report |= is_read;
        let newly = |(id, before): (SlotId, SlotReport)| {
            let slot = self.latest.slot(id);
            id.steers() && slot != before && slot.state == SlotState::Applied
        };
        if SlotId::ALL.into_iter().zip(before).any(newly) {
            // The path was planned before the slot was applied; a pose with the new path is still to come.
            (self.latest.waypoint, self.latest.path) = (None, PlannedPath::default());
            self.latest.intent = None;
        }
        self.join();
        is_read
    }

    fn join(&mut self) {
        if let Some((pose, _)) = self.pose.filter(|_| self.has_report) {
            self.whole = Some((self.latest.clone(), pose));
        }
    }
}

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
