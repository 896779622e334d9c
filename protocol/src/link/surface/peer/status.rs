//! The status of a vehicle, joined from its two chunks.

use crate::directive::{SlotId, SlotReport, SlotState};
use crate::link::FrameNumber;
use crate::time::Instant;
use crate::wire::{PlannedPath, PoseDetails, VehicleStatus};

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
