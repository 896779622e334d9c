//! The status of a vehicle, joined from its two chunks.

use crate::directive::{SlotId, SlotReport, SlotState};
use crate::link::FrameNumber;
use crate::time::Instant;
use crate::wire::{EquipmentFaults, Intent, PlannedPath, RegistrationReport, Trail, VehicleStatus};

/// The pose and the report of a vehicle, of which one may come in before the other.
#[derive(Debug, Default)]
pub(super) struct StatusParts {
    latest: VehicleStatus,
    /// When the pose came in, and in which frame.
    pose: Option<(Instant, FrameNumber)>,
    trail: BeforePose<Trail>,
    intent: BeforePose<Intent>,
    registration: BeforePose<RegistrationReport>,
    faults: BeforePose<EquipmentFaults>,
    has_report: bool,
    whole: Option<(VehicleStatus, Instant)>,
}

/// The content of a chunk that waits for the pose of its frame.
#[derive(Debug)]
struct BeforePose<T>(Option<(T, FrameNumber)>);

impl<T> Default for BeforePose<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<T> BeforePose<T> {
    /// Keeps what was read of the frame `number`, in place of that of an earlier one; returns whether it makes sense.
    fn put(&mut self, read: Option<T>, number: FrameNumber) -> bool {
        self.0 = read.map(|content| (content, number));
        self.0.is_some()
    }

    /// The content, if it is of the frame `number`.
    fn take(&mut self, number: FrameNumber) -> Option<T> {
        self.0.take_if(|(_, of)| *of == number).map(|(content, _)| content)
    }
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
            if let Some(trail) = self.trail.take(number) {
                read.trail = trail.corners(read.position);
            }
            (read.intent, read.registration) = (self.intent.take(number), self.registration.take(number));
            read.faults = self.faults.take(number).unwrap_or_default();
            (self.latest, self.pose) = (read, Some((now, number)));
        }
        self.join();
        is_read
    }

    /// Reads a trail, which waits for the pose of its frame; returns whether it makes sense.
    pub(super) fn read_trail(&mut self, payload: &[u8], number: FrameNumber) -> bool {
        self.trail.put(Trail::decode(payload).ok(), number)
    }

    /// Reads an intent, which waits for the pose of its frame; returns whether it makes sense.
    pub(super) fn read_intent(&mut self, payload: &[u8], number: FrameNumber) -> bool {
        self.intent.put(Intent::decode(payload).ok(), number)
    }

    /// Reads a registration, which waits for the pose of its frame; returns whether it makes sense.
    pub(super) fn read_registration(&mut self, payload: &[u8], number: FrameNumber) -> bool {
        self.registration.put(RegistrationReport::decode(payload).ok(), number)
    }

    /// Reads faults, which wait for the pose of their frame; returns whether they make sense.
    pub(super) fn read_faults(&mut self, payload: &[u8], number: FrameNumber) -> bool {
        self.faults.put(EquipmentFaults::decode(payload).ok(), number)
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
