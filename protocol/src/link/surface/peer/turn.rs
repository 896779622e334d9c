//! The frames of the surface's turn.

use super::{Carried, InForceCopy, LastTurn, VehiclePeer};
use crate::directive::PendingSlot;
use crate::link::handshake::FramePurpose;
use crate::link::{FrameNumber, Transmit, TransmitKind};
use crate::mac::{Grant, ModemProfile};
use crate::map::StateReplica;
use crate::schedule::{Class, ClassShares};
use crate::seal::VehicleKey;
use crate::time::Instant;
use crate::wire::{ChunkKind, Stamp, room_for_payload};

/// Bytes of acknowledgement that every frame of the surface has room for.
const SHORT_ACK: usize = 2;
/// Bytes of the longest header of a numbered frame, without turn and stamp.
const MAX_HEADER: usize = 7;
/// Bytes of a frame that no slot can use: header, turn, a short acknowledgement, chunk header.
const SLOT_OVERHEAD: usize = MAX_HEADER + 1 + SHORT_ACK + 1;
/// Bytes that a part of the next key takes in a frame.
const KEY_PART_BYTES: usize = 2 + VehicleKey::PART_BYTES;
/// Frames smaller than this have no room for a stamp beside a slot.
const SMALL_FRAME: usize = 48;

/// Bytes that a slot may have in a frame of `frame_bytes` that ends in `seal` bytes.
pub(in crate::link::surface) fn room_for_slot(frame_bytes: usize, seal: usize) -> usize {
    frame_bytes.saturating_sub(SLOT_OVERHEAD + seal)
}

/// A frame of the surface, ready to go.
#[derive(Debug)]
pub(in crate::link::surface) struct Ready {
    pub(in crate::link::surface) transmit: Transmit,
    /// Its number, unless it is a hello.
    pub(in crate::link::surface) number: Option<FrameNumber>,
}

/// The content of a frame to a vehicle.
#[derive(Debug, Clone, Copy)]
struct FrameContent<'a> {
    slots: &'a [PendingSlot],
    /// What goes where there are no slots.
    beside: Option<&'a Beside>,
}

/// An inquiry for the content in force, or a part of the next key.
type Beside = (ChunkKind, Vec<u8>);

/// The slots of each frame of a turn.
pub(super) type TurnPlan = Vec<Vec<PendingSlot>>;

impl<R: StateReplica> VehiclePeer<R> {
    /// Plans a turn: the slots that wait and were not sent after `again_before`, then a grant. Each is repeated as
    /// often as it takes for one copy to get through.
    pub(in crate::link::surface) fn plan_turn(
        &self,
        modem: &ModemProfile,
        purpose: FramePurpose,
        copies: u32,
        shares: &ClassShares,
        again_before: Instant,
    ) -> TurnPlan {
        let copies = copies as usize;
        if purpose != FramePurpose::Content || !self.pair.has_run() {
            return vec![Vec::new(); copies.min(2)];
        }
        let groups = pack(
            self.outbox.pending(again_before, again_before),
            room_for_slot(modem.frame_bytes, self.pair.seal_bytes()),
            shares,
        );
        let mut plan = TurnPlan::new();
        for _ in 0..copies {
            plan.extend(groups.iter().cloned());
        }
        // Slots leave little room for acknowledgements, so the grants that carry all of them follow.
        plan.extend(vec![Vec::new(); copies]);
        plan
    }

    /// Writes the frames of a plan; `grant` is the turn byte, if turns are granted.
    pub(in crate::link::surface) fn write_turn(
        &mut self,
        plan: &[Vec<PendingSlot>],
        modem: &ModemProfile,
        grant: Option<u8>,
        purpose: FramePurpose,
        now: Instant,
    ) -> Vec<Ready> {
        let purpose = if self.pair.has_run() { purpose } else { FramePurpose::Hello };
        self.contact.is_doubtful |= purpose == FramePurpose::Content;
        self.last_turn = LastTurn { began: self.pair.next_number(), purpose };
        let mut bits_left: u64 = plan.iter().map(|slots| self.bits(slots, modem, purpose)).sum();
        let mut at = now;
        let mut turn = Vec::with_capacity(plan.len());
        let has_room = purpose == FramePurpose::Content && plan.iter().any(Vec::is_empty);
        let beside = if has_room { self.take_beside(now) } else { None };
        for slots in plan {
            bits_left -= self.bits(slots, modem, purpose);
            let remaining = Grant::code_remaining(bits_left);
            let content = FrameContent { slots, beside: beside.as_ref().filter(|_| slots.is_empty()) };
            let ready = self.write_frame(content, modem, grant, remaining, purpose, at);
            at = at + modem.airtime(ready.transmit.bytes.len());
            turn.push(ready);
        }
        turn
    }

    /// What goes at `now` into frames without slots.
    fn take_beside(&mut self, now: Instant) -> Option<Beside> {
        if let Some(bytes) = self.in_force.inquiry(now) {
            self.in_force.note_inquiry(now);
            return Some((ChunkKind::Inquiry, bytes));
        }
        let parts = self.pair.next_key_parts()?;
        Some((ChunkKind::NextKey, self.key_offers.take(parts, now)?))
    }

    /// The most bits on air that a frame with these slots takes.
    pub(in crate::link::surface) fn bits(
        &self,
        slots: &[PendingSlot],
        modem: &ModemProfile,
        purpose: FramePurpose,
    ) -> u64 {
        const HEAD: usize = MAX_HEADER + 1 + Stamp::SURFACE_BYTES;
        let inquiry = if self.in_force.lacks_any() { InForceCopy::INQUIRY_BYTES } else { 0 };
        let key_part = if self.pair.offers_key() { KEY_PART_BYTES } else { 0 };
        let beside = if slots.is_empty() { inquiry.max(key_part) } else { 0 };
        let chunks = beside + slots.iter().map(|s| s.bytes.len() + 2).sum::<usize>();
        let bytes = match purpose.is_hello() || !self.pair.has_run() {
            true => self.pair.hello_bytes(),
            false => HEAD + chunks + self.pair.statement_bytes() + self.pair.seal_bytes(),
        };
        modem.bits_on_air(bytes.min(modem.frame_bytes))
    }

    fn write_frame(
        &mut self,
        FrameContent { slots, beside }: FrameContent<'_>,
        modem: &ModemProfile,
        grant: Option<u8>,
        remaining: u8,
        purpose: FramePurpose,
        at: Instant,
    ) -> Ready {
        let chunks =
            beside.map_or(0, |(_, bytes)| bytes.len() + 2) + slots.iter().map(|s| s.bytes.len() + 2).sum::<usize>();
        let has_room = modem.frame_bytes >= SMALL_FRAME + chunks;
        let one_way = self.master.round_trip().map(|both| both / 2);
        let stamp = Stamp::Surface { clock_ms: Stamp::clock(at), one_way };
        let fixed = MAX_HEADER + 1 + Stamp::SURFACE_BYTES + self.pair.seal_bytes();
        let ack_room = modem.frame_bytes.saturating_sub(chunks + fixed).max(SHORT_ACK);
        let number = (purpose == FramePurpose::Content && self.pair.has_run()).then(|| self.pair.next_number());
        let has_room = has_room && number.is_some();
        let mut builder = self.pair.begin_frame(modem.frame_bytes, ack_room, grant, has_room.then_some(stamp), purpose);
        builder.set_remaining(remaining);
        let mut carried = Carried::new();
        let mut payload = 0;
        if let Some((kind, bytes)) = beside
            && builder.push(*kind, bytes)
        {
            self.pair.stats.count(Class::Directive, bytes.len());
            payload += bytes.len();
        }
        for slot in slots {
            // The age of a fix is that at the start of this transmission.
            let Some(bytes) = self.outbox.encode(slot.id, slot.version, at) else { continue };
            if room_for_payload(builder.room()) >= bytes.len() && builder.push(ChunkKind::Slot, &bytes) {
                self.outbox.mark_on_air(slot.id, slot.version, at);
                self.pair.stats.count(slot.id.class(), bytes.len());
                carried.push((slot.id, slot.version, bytes.len()));
            }
        }
        let mainly = match (number, carried.first()) {
            (None, _) => TransmitKind::Hello,
            (_, None) => TransmitKind::Grant,
            (_, Some((id, ..))) => TransmitKind::Content(id.class()),
        };
        payload += carried.iter().map(|(_, _, n)| n).sum::<usize>();
        let bytes = self.pair.finish_frame(builder, carried, purpose, true);
        self.pair.stats.count(Class::Overhead, bytes.len().saturating_sub(payload));
        Ready { transmit: Transmit { to: self.pair.peer(), bytes, kind: mainly }, number }
    }
}

/// Puts slots into as few frames as their order allows: commands before fixes, unless fixes are owed their share.
fn pack(mut slots: Vec<PendingSlot>, room: usize, shares: &ClassShares) -> Vec<Vec<PendingSlot>> {
    let mut waiting: Vec<Class> = slots.iter().map(|s| s.id.class()).collect();
    waiting.dedup();
    if let Some(first) = shares.next(&waiting) {
        slots.sort_by_key(|s| s.id.class() != first);
    }
    let mut groups: Vec<Vec<PendingSlot>> = Vec::new();
    let mut used = room;
    for slot in slots {
        let bytes = slot.bytes.len() + 2;
        if used + bytes > room || groups.is_empty() {
            groups.push(Vec::new());
            used = 0;
        }
        used += bytes;
        if let Some(group) = groups.last_mut() {
            group.push(slot);
        }
    }
    groups
}
