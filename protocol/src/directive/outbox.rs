//! The surface's side of the slots: what to send, and what became of it.

use super::{RefusalReason, SLOTS, Slot, SlotId, SlotReport, SlotState, VersionedSlot};
use crate::time::Instant;

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
    /// When it was last put into a frame.
    pub sent: Option<Instant>,
}

/// A slot that waits to be heard, as it would go into a frame now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PendingSlot {
    /// Which slot.
    pub id: SlotId,
    /// Its version.
    pub version: u16,
    /// The chunk.
    pub bytes: Vec<u8>,
}

/// The directive of one vehicle as the surface keeps it.
#[derive(Debug)]
pub struct SlotOutbox {
    series: u16,
    slots: [Option<SlotProgress>; SLOTS],
}

impl SlotOutbox {
    /// An empty directive whose versions count in `series`, a random number drawn at each start of the surface.
    pub fn new(series: u16) -> Self {
        Self { series, slots: Default::default() }
    }

    /// Issues a new version of a slot, which supersedes the older one; returns its version.
    pub fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        let id = slot.id();
        let Some(entry) = self.slots.get_mut(id.index()) else { return 0 };
        let version = entry.as_ref().map_or(1, |s| s.version.wrapping_add(1));
        *entry =
            Some(SlotProgress { id, version, slot, life: LifeLine::Queued, issued: now, changed: now, sent: None });
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

    /// The slots that the vehicle is not known to have heard, commands before fixes, as they would go out at `now`; without
    /// those that went out after `again_before`.
    pub fn pending(&self, now: Instant, again_before: Instant) -> Vec<PendingSlot> {
        self.progress()
            .filter(|s| matches!(s.life, LifeLine::Queued | LifeLine::OnAir))
            .filter(|s| s.sent.is_none_or(|at| at <= again_before))
            .map(|s| PendingSlot {
                id: s.id,
                version: s.version,
                bytes: VersionedSlot::encode(self.series, s.version, &dated(s, now)),
            })
            .collect()
    }

    /// The chunk of a version as it would go out at `now`, if it has not been superseded.
    pub fn encode(&self, id: SlotId, version: u16, now: Instant) -> Option<Vec<u8>> {
        let slot = self.progress().find(|s| s.id == id && s.version == version)?;
        Some(VersionedSlot::encode(self.series, version, &dated(slot, now)))
    }

    /// A frame with this version of the slot was written.
    pub fn mark_on_air(&mut self, id: SlotId, version: u16, now: Instant) {
        self.advance(id, version, LifeLine::OnAir, now, |life| life == LifeLine::Queued);
        if let Some(slot) = self.slots.get_mut(id.index()).and_then(Option::as_mut) {
            slot.sent = Some(now);
        }
    }

    /// The vehicle acknowledged a frame with this version.
    pub fn mark_heard(&mut self, id: SlotId, version: u16, now: Instant) {
        self.advance(id, version, LifeLine::Heard, now, |life| matches!(life, LifeLine::Queued | LifeLine::OnAir));
    }

    /// The vehicle reported its decisions; returns the slots whose fate is newly known.
    pub fn handle_report(&mut self, reports: &[SlotReport; SLOTS], now: Instant) -> Vec<SlotId> {
        let mut settled = Vec::new();
        for (id, report) in SlotId::ALL.into_iter().zip(reports) {
            let Some(Some(slot)) = self.slots.get(id.index()) else { continue };
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
                (slot.life, slot.changed, slot.sent) = (LifeLine::Queued, now, None);
            }
        }
    }

    fn advance(
        &mut self,
        id: SlotId,
        version: u16,
        to: LifeLine,
        now: Instant,
        from: impl Fn(LifeLine) -> bool,
    ) -> bool {
        match self.slots.get_mut(id.index()) {
            Some(Some(s)) if s.version == version && from(s.life) => {
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
