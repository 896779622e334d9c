//! Frames to a vehicle: those of a turn, with the offer of its next key, and those without one, through a modem that does half
//! duplex by itself.

use super::{Carried, InForceCopy, LastTurn, VehiclePeer};
use crate::directive::PendingSlot;
use crate::link::handshake::FramePurpose;
use crate::link::{AckRoom, FrameNumber, Transmit, TransmitKind, by_class};
use crate::mac::{Grant, ModemProfile};
use crate::map::StateReplica;
use crate::schedule::{BitBudget, Class, ClassShares};
use crate::seal::VehicleKey;
use crate::time::Instant;
use crate::wire::{ChunkKind, Stamp, room_for_payload};
use std::time::Duration;

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
pub(in crate::link::surface) type TurnPlan = Vec<Vec<PendingSlot>>;

impl<R: StateReplica> VehiclePeer<R> {
    /// What a turn that begins now is for.
    pub(in crate::link::surface) fn turn_purpose(&self) -> FramePurpose {
        if is_hello_due(self.master.unanswered()) || self.is_full() || self.seems_elsewhere() {
            FramePurpose::Hello
        } else if self.is_proof_due() {
            FramePurpose::Proof
        } else {
            FramePurpose::Content
        }
    }

    /// A purpose, or the one in its place that can be written now.
    pub(in crate::link::surface) fn possible(&self, purpose: FramePurpose) -> FramePurpose {
        match purpose {
            FramePurpose::Proof if self.pair.has_offer() => FramePurpose::Proof,
            FramePurpose::Proof | FramePurpose::Content if self.pair.has_run() && !self.is_full() => {
                FramePurpose::Content
            }
            _ => FramePurpose::Hello,
        }
    }

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
        let wanted =
            beside.map_or(0, |(_, bytes)| bytes.len() + 2) + slots.iter().map(|s| s.bytes.len() + 2).sum::<usize>();
        let has_room = modem.frame_bytes >= SMALL_FRAME + wanted;
        let one_way = self.master.round_trip().map(|both| both / 2);
        let stamp = Stamp::Surface { clock_ms: Stamp::clock(at), one_way };
        let fixed = MAX_HEADER + 1 + Stamp::SURFACE_BYTES + self.pair.seal_bytes();
        let bytes = modem.frame_bytes.saturating_sub(wanted + fixed).max(SHORT_ACK);
        let number = (purpose == FramePurpose::Content && self.pair.has_run()).then(|| self.pair.next_number());
        let has_room = has_room && number.is_some();
        let (room, stamp) = (AckRoom { bytes, in_turn: false }, has_room.then_some(stamp));
        let mut builder = self.pair.begin_frame(modem.frame_bytes, room, grant, stamp, purpose);
        builder.set_remaining(remaining);
        let mut carried = Carried::new();
        let mut chunks = Vec::new();
        if let Some((kind, bytes)) = beside
            && builder.push(*kind, bytes)
        {
            chunks.push((Class::Directive, bytes.len()));
        }
        for slot in slots {
            // The age of a fix is that at the start of this transmission.
            let Some(bytes) = self.outbox.encode(slot.id, slot.version, at) else { continue };
            if room_for_payload(builder.room()) >= bytes.len() && builder.push(ChunkKind::Slot, &bytes) {
                self.outbox.mark_on_air(slot.id, slot.version, at);
                chunks.push((slot.id.class(), bytes.len()));
                carried.push((slot.id, slot.version, bytes.len()));
            }
        }
        let mainly = match (number, carried.first()) {
            (None, _) => TransmitKind::Hello,
            (_, None) => TransmitKind::Grant,
            (_, Some((id, ..))) => TransmitKind::Content(id.class()),
        };
        let payload: usize = chunks.iter().map(|(_, n)| n).sum();
        let contents = by_class(chunks);
        contents.iter().for_each(|(class, n)| self.pair.stats.count(*class, *n as usize));
        let bytes = self.pair.finish_frame(builder, carried, purpose, true);
        self.pair.stats.count(Class::Overhead, bytes.len().saturating_sub(payload));
        Ready { transmit: Transmit { to: self.pair.peer(), bytes, kind: mainly, contents }, number }
    }
}

/// A vehicle that does not answer may have restarted and not know us: every second grant is a hello, and after a while
/// every one, so that the numbers of unacknowledged frames do not run out.
fn is_hello_due(unanswered: u32) -> bool {
    unanswered >= 2 && (unanswered.is_multiple_of(2) || unanswered >= 16)
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

/// Offers the two parts of the next key in turn.
#[derive(Debug)]
pub(super) struct KeyOffers {
    next: Instant,
    /// Parts that were offered in this run of the surface.
    count: u32,
}

impl KeyOffers {
    /// The pause between two parts, until each was offered a few times; then a vehicle that keeps none, as with a full disk, is
    /// offered one at long intervals.
    const PAUSE: Duration = Duration::from_secs(5);
    const LONG_PAUSE: Duration = Duration::from_secs(60);
    const QUICK: u32 = 12;

    pub(super) fn new(now: Instant) -> Self {
        Self { next: now, count: 0 }
    }

    /// When the next part is due, if the vehicle is offered a key.
    pub(super) fn next(&self) -> Instant {
        self.next
    }

    /// The part to offer at `now`, if one is due.
    pub(super) fn take(&mut self, parts: [Vec<u8>; 2], now: Instant) -> Option<Vec<u8>> {
        if now < self.next {
            return None;
        }
        let [link, calls] = parts;
        let part = if self.count.is_multiple_of(2) { link } else { calls };
        self.count += 1;
        self.next = now + if self.count < Self::QUICK { Self::PAUSE } else { Self::LONG_PAUSE };
        Some(part)
    }
}

/// Frame numbers since the last acknowledgement after which the next one does not wait any longer.
const MAX_UNACKNOWLEDGED: u64 = 16;

impl<R: StateReplica> VehiclePeer<R> {
    fn must_send_hello(&self, now: Instant) -> bool {
        let is_doubtful = self.contact.doubtful_from(self.slot_timeout()).is_none_or(|at| now >= at);
        (!self.pair.is_proven() || is_doubtful || self.pair.is_full()) && now >= self.contact.hello_due
    }

    /// When a run that the vehicle has offered is to be proven, unless a frame of the current run comes in before.
    fn proof_due(&self) -> Option<Instant> {
        let timeout = self.slot_timeout().max(self.pace.proof_timeout());
        // A vehicle that repeats its hello has not received the last proof; a forged offer is silent.
        let pause = timeout * if self.pair.owes_proof() { 1 } else { 1 << (self.pair.proofs().clamp(1, 3) - 1) };
        let again = self.contact.proved.map_or(Instant::ZERO, |at| at + pause);
        let silent = self.contact.last_received.map_or(Instant::ZERO, |at| at + timeout);
        self.pair.has_offer().then(|| again.max(silent).max(self.contact.proof_allowed))
    }

    /// Whether a frame should go out at `now`: a hello, a proof, an acknowledgement, or a slot.
    pub(in crate::link::surface) fn has_reason_to_transmit(&self, now: Instant) -> bool {
        if self.must_send_hello(now) || self.proof_due().is_some_and(|at| now >= at) {
            return true;
        }
        let answer = self.contact.is_answer_due(now);
        let is_late = self.pair.highest() >= self.contact.acknowledged + MAX_UNACKNOWLEDGED;
        let is_repeat_due = self.next_repeat().is_some_and(|at| now >= at);
        let owes =
            (!self.pair.is_proven() && answer) || (self.pair.unstated() > 0 && (is_late || answer)) || is_repeat_due;
        let inquires = self.in_force.next_inquiry().is_some_and(|at| now >= at);
        let offers = self.next_offer().is_some_and(|at| now >= at);
        self.has_numbers()
            && (owes || inquires || offers || !self.outbox.pending(now, now - self.slot_timeout()).is_empty())
    }

    /// When the next part of the next key is due, if the vehicle is offered one.
    fn next_offer(&self) -> Option<Instant> {
        self.pair.offers_key().then(|| self.key_offers.next())
    }

    /// When the last acknowledgement goes out again, if no frame confirms it.
    fn next_repeat(&self) -> Option<Instant> {
        self.contact.repeat_due.filter(|_| self.pair.is_unconfirmed())
    }

    /// Whether there is a run with a number left for a frame.
    fn has_numbers(&self) -> bool {
        self.pair.has_run() && !self.pair.is_full()
    }

    /// When there will be a reason to transmit, if no frame comes in.
    pub(in crate::link::surface) fn next_reason(&self) -> Option<Instant> {
        let again = self.outbox.progress().filter_map(|s| s.sent).min().map(|at| at + self.slot_timeout());
        let again = again.filter(|_| self.outbox.has_backlog());
        let hello = self.contact.next_hello(self.pair.is_proven() && !self.pair.is_full(), self.slot_timeout());
        let numbered =
            [self.contact.answer_due, self.next_repeat(), again, self.in_force.next_inquiry(), self.next_offer()]
                .into_iter()
                .flatten()
                .filter(|_| self.has_numbers())
                .min();
        [Some(hello), self.proof_due(), numbered].into_iter().flatten().min()
    }

    /// Writes a frame, or postpones it if the budget does not allow it yet.
    pub(in crate::link::surface) fn write_without_turn(
        &mut self,
        modem: &ModemProfile,
        shares: &ClassShares,
        budget: &BitBudget,
        now: Instant,
    ) -> Option<Ready> {
        let is_proof = self.proof_due().is_some_and(|at| now >= at);
        let purpose = if is_proof { FramePurpose::Proof } else { FramePurpose::hello_if(self.must_send_hello(now)) };
        let plan = self.plan_turn(modem, purpose, 1, shares, now - self.slot_timeout());
        let slots = plan.into_iter().next()?;
        let allowed = budget.earliest(self.bits(&slots, modem, purpose), now);
        if allowed > now {
            match is_proof {
                true => self.contact.proof_allowed = allowed,
                false => self.contact.answer_due = Some(allowed),
            }
            self.contact.repeat_due = self.contact.repeat_due.map(|at| at.max(allowed));
            return None;
        }
        let has_orders = !slots.is_empty() && purpose == FramePurpose::Content;
        let ready = self.write_turn(&[slots], modem, None, purpose, now).pop()?;
        self.master.note_begun(now);
        if is_proof {
            self.contact.proved = Some(now);
            return Some(ready);
        }
        if has_orders {
            self.contact.ordered.get_or_insert(now);
        }
        // A run that was met must be proven by a numbered frame, or the vehicle will not transmit.
        let must_prove = self.pair.has_run() && !self.pair.is_proven();
        // After a hello of a run with this vehicle, a numbered frame follows at once.
        let timeout = self.slot_timeout();
        // A frame may be too small for a verdict on every frame that came in; the next one has the rest.
        let is_partial = self.pair.unstated() > 0;
        let next = if must_prove && purpose.is_hello() { now } else { now + timeout };
        self.contact.answers_left = self.contact.answers_left.saturating_sub(1);
        self.contact.repeat_due = (self.contact.answers_left > 0).then_some(now + timeout);
        self.contact.answer_due = (must_prove || is_partial).then_some(next);
        self.contact.acknowledged = self.pair.highest();
        if purpose.is_hello() {
            self.contact.note_hello(timeout.max(self.pace.proof_timeout()), self.pair.stats.dropped_total(), now);
        }
        Some(ready)
    }

    /// Time after which a slot that was not acknowledged goes out again.
    pub(super) fn slot_timeout(&self) -> Duration {
        self.pace.slot_timeout(self.master.round_trip())
    }
}
