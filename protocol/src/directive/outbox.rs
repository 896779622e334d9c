//! The surface's side of the slots: what to send, and what became of it.

use super::{RefusalReason, SLOTS, Slot, SlotId, VersionedSlot};
use crate::time::Instant;
use crate::wire::{SlotState, VehicleStatus};

/// How far a version of a slot has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LifeLine {
    /// Waits for its first transmission.
    Queued,
    /// Was transmitted, nothing heard of it yet.
    OnAir,
    /// The vehicle has it, its decision is not known yet.
    Heard,
    /// In force at the vehicle.
    Applied,
    /// The vehicle refused it and keeps what it had.
    Refused(RefusalReason),
}

/// The newest version of a slot and how far it has come.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotProgress {
    /// Which slot.
    pub id: SlotId,
    /// Version in this session of the surface.
    pub version: u16,
    /// Content.
    pub slot: Slot,
    /// How far it has come.
    pub life: LifeLine,
    /// When it was issued.
    pub issued: Instant,
    /// When `life` last changed.
    pub changed: Instant,
}

/// The directive of one vehicle as the surface keeps it.
#[derive(Debug)]
pub struct SlotOutbox {
    series: u16,
    slots: [Option<SlotProgress>; SLOTS],
    /// Slots put into a frame of the current turn.
    sent_this_turn: [bool; SLOTS],
}

impl SlotOutbox {
    /// An empty directive whose versions count in `series`, a random number drawn at each start of the surface.
    pub fn new(series: u16) -> Self {
        Self { series, slots: Default::default(), sent_this_turn: [false; SLOTS] }
    }

    /// Issues a new version of a slot, which supersedes the older one; returns its version.
    pub fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        let id = slot.id();
        let entry = &mut self.slots[id.index()];
        let version = entry.as_ref().map_or(1, |s| s.version.wrapping_add(1));
        *entry = Some(SlotProgress { id, version, slot, life: LifeLine::Queued, issued: now, changed: now });
        self.sent_this_turn[id.index()] = false;
        version
    }

    /// Every slot that was ever issued.
    pub fn progress(&self) -> impl Iterator<Item = &SlotProgress> {
        self.slots.iter().flatten()
    }

    /// Whether something waits to be heard by the vehicle.
    pub fn has_backlog(&self) -> bool {
        self.progress().any(|s| matches!(s.life, LifeLine::Queued | LifeLine::OnAir))
    }

    /// A new turn begins: whatever is not known to have been heard may go out again.
    pub fn begin_turn(&mut self) {
        self.sent_this_turn = [false; SLOTS];
    }

    /// The bytes of the next slot worth sending that fit `room`, with its identity; commands before fixes.
    pub fn next(&self, room: usize, now: Instant) -> Option<(SlotId, u16, Vec<u8>)> {
        self.progress()
            .filter(|s| matches!(s.life, LifeLine::Queued | LifeLine::OnAir) && !self.sent_this_turn[s.id.index()])
            .map(|s| (s.id, s.version, VersionedSlot::encode(self.series, s.version, &dated(s, now))))
            .find(|(_, _, bytes)| bytes.len() <= room)
    }

    /// A frame with this version of the slot was written.
    pub fn mark_on_air(&mut self, id: SlotId, version: u16, now: Instant) {
        self.sent_this_turn[id.index()] = true;
        self.advance(id, version, LifeLine::OnAir, now, |life| life == LifeLine::Queued);
    }

    /// The vehicle acknowledged a frame with this version.
    pub fn mark_heard(&mut self, id: SlotId, version: u16, now: Instant) {
        self.advance(id, version, LifeLine::Heard, now, |life| matches!(life, LifeLine::Queued | LifeLine::OnAir));
    }

    /// The vehicle reported its decisions; returns the slots whose fate is newly known.
    pub fn handle_report(&mut self, status: &VehicleStatus, now: Instant) -> Vec<SlotId> {
        let mut settled = Vec::new();
        for id in SlotId::ALL {
            let report = status.slot(id);
            let Some(slot) = &self.slots[id.index()] else { continue };
            let life = match report.state {
                SlotState::Unknown => {
                    let forgotten = |l| matches!(l, LifeLine::Heard | LifeLine::Applied);
                    self.advance(id, slot.version, LifeLine::Queued, now, forgotten);
                    continue;
                }
                _ if slot.version as u8 != report.version_low => continue,
                SlotState::Applied => LifeLine::Applied,
                SlotState::Refused(reason) => LifeLine::Refused(reason),
            };
            if self.advance(id, slot.version, life, now, |l| l == LifeLine::Heard) {
                settled.push(id);
            }
        }
        settled
    }

    /// The vehicle restarted: what it was not known to have in force goes out again.
    pub fn handle_peer_restart(&mut self, now: Instant) {
        for slot in self.slots.iter_mut().flatten() {
            if matches!(slot.life, LifeLine::OnAir | LifeLine::Heard) {
                (slot.life, slot.changed) = (LifeLine::Queued, now);
            }
        }
        self.begin_turn();
    }

    fn advance(
        &mut self,
        id: SlotId,
        version: u16,
        to: LifeLine,
        now: Instant,
        from: impl Fn(LifeLine) -> bool,
    ) -> bool {
        match &mut self.slots[id.index()] {
            Some(s) if s.version == version && from(s.life) => {
                (s.life, s.changed) = (to, now);
                true
            }
            _ => false,
        }
    }
}

/// A fix is as old as it is when it leaves.
fn dated(progress: &SlotProgress, now: Instant) -> Slot {
    match progress.slot {
        Slot::Fix(fix) => Slot::Fix(super::Fix { age_s: fix.age_s + now.since(progress.issued).as_secs_f64(), ..fix }),
        ref other => other.clone(),
    }
}
