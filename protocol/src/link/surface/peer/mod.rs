//! One vehicle as the surface knows it.
//!
//! [`VehiclePeer`] joins parts that own their state: `content` (the copy of its state), `contact` (when it was last in contact, and
//! its clock), `strangers` (other surfaces, a second vehicle). `turn` writes the frames that go out to it.

mod contact;
mod content;
mod in_force;
mod status;
mod strangers;
mod turn;
mod view;

pub use in_force::InForce;
pub use strangers::{EndedRun, OtherSurface};
pub(super) use turn::{Ready, TurnPlan, room_for_slot};
pub use view::PeerView;

use crate::directive::{
    InForcePart, OrderStatus, Series, Slot, SlotId, SlotOutbox, SlotProgress, WaitingStop, Withdrawal,
};
use crate::link::handshake::FramePurpose;
use crate::link::{Authenticity, DropReason, FrameNumber, Inbound, LinkPair, LinkStats, Mismatch, SurfaceEvent};
use crate::mac::{Master, MasterConfig, ModemProfile, Wish};
use crate::map::StateReplica;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{
    Address, Chunk, ChunkKind, Envelope, Header, Introduction, MissionId, Stamp, UtcHours, VehicleStatus,
};
use contact::{AnswerPace, Contact, VehicleTiming};
use content::{ChunkOutcome, Divergence, PeerContent, class_of};
use in_force::InForceCopy;
use std::collections::VecDeque;
use std::time::Duration;
use strangers::{Rivals, TwinWatch};
use turn::KeyOffers;

/// The slots that a frame to a vehicle carried: versions, each with its bytes.
type Carried = Vec<(SlotId, u16, usize)>;

/// The last turn that was written.
#[derive(Debug, Clone, Copy)]
struct LastTurn {
    /// Number of its first frame: an answer has judged it.
    began: FrameNumber,
    /// A hello or a proof has no number in the current run that an answer could name.
    purpose: FramePurpose,
}

/// Time without an accepted frame after which frames of other runs, or late ones, are taken for a sign of another run.
const STRAYS_TIMEOUT: Duration = Duration::from_secs(20);

/// Where the modem decides when to transmit: probability that all copies of an acknowledgement may be lost, and the most
/// copies. Below a loss of one half there is one, because the next frame of the vehicle causes the next.
const ANSWER_LOSS_RISK: f64 = 0.5;
const MAX_ANSWERS: u32 = 6;

/// A vehicle as the surface knows it.
#[derive(Debug)]
pub(super) struct VehiclePeer<R> {
    /// Grants turns to the vehicle.
    pub(super) master: Master,
    pair: LinkPair<Carried>,
    outbox: SlotOutbox,
    rivals: Rivals,
    content: PeerContent<R>,
    in_force: InForceCopy,
    timing: VehicleTiming,
    contact: Contact,
    last_turn: LastTurn,
    divergence: Divergence,
    twins: TwinWatch,
    /// Whether only a hold or an abort takes the vehicle over.
    takes_over_to_stop: bool,
    key_offers: KeyOffers,
    /// The two ends were found to differ: a new run must begin.
    is_out_of_step: bool,
    pace: AnswerPace,
}

impl<R: StateReplica> VehiclePeer<R> {
    pub(super) fn new(
        mission: MissionId,
        vehicle: Address,
        authenticity: Option<Authenticity>,
        introduction: Introduction,
        seed: u64,
        config: MasterConfig,
        now: Instant,
    ) -> Self {
        Self {
            master: Master::new(config, now),
            outbox: SlotOutbox::new(introduction.series.unwrap_or(Series::from_random(seed)), authenticity.is_some()),
            pair: LinkPair::new(mission, Address::SURFACE, vehicle, authenticity, introduction, seed),
            rivals: Rivals::default(),
            content: PeerContent::new(),
            in_force: InForceCopy::default(),
            timing: VehicleTiming::default(),
            contact: Contact::new(now),
            last_turn: LastTurn { began: 0, purpose: FramePurpose::Content },
            divergence: Divergence::default(),
            twins: TwinWatch::default(),
            takes_over_to_stop: false,
            key_offers: KeyOffers::new(now),
            is_out_of_step: false,
            pace: AnswerPace::default(),
        }
    }

    /// Takes the pace of answers from the modem.
    pub(super) fn with_modem(mut self, modem: &ModemProfile) -> Self {
        self.pace = AnswerPace::of(modem);
        if self.pace.is_full_duplex {
            self.contact.expect_prompt_answers();
        }
        self
    }

    /// Sets the age after which an abort that has not arrived is withdrawn.
    pub(super) fn with_abort_lifetime(mut self, lifetime: Option<Duration>) -> Self {
        self.outbox.set_abort_lifetime(lifetime);
        self
    }

    pub(super) fn handle_call_answer(&mut self, now: Instant) {
        self.master.hurry(now);
        self.twins.handle_call_answer(now);
    }

    pub(super) fn address(&self) -> Address {
        self.pair.peer()
    }

    pub(super) fn stats(&self) -> &LinkStats {
        &self.pair.stats
    }

    /// Whether the next turn is to prove a run that the vehicle has offered. A replayed hello may have offered it, so a turn
    /// in the current run must have remained without an answer, and every second turn belongs to that run.
    pub(super) fn is_proof_due(&self) -> bool {
        self.pair.has_offer() && self.contact.is_doubtful && self.last_turn.purpose != FramePurpose::Proof
    }

    /// Whether the vehicle seems to use a run that has ended at the surface, so that it receives no numbered frame.
    pub(super) fn seems_elsewhere(&self) -> bool {
        self.pair.hears_ended_run() && self.master.unanswered() > 0 && !self.pair.has_offer()
    }

    /// Counts a frame that was dropped.
    pub(super) fn drop_frame(&mut self, reason: DropReason) {
        self.pair.stats.drop(reason);
    }

    /// Whether frames of unknown fate fill the window.
    pub(super) fn is_full(&self) -> bool {
        self.pair.is_full()
    }

    pub(super) fn has_slots_to_send(&self) -> bool {
        self.outbox.has_backlog()
    }

    /// Issues a new version of a slot; returns the version.
    pub(super) fn issue(&mut self, slot: Slot, now: Instant) -> u16 {
        self.take_over_to_stop(&slot, now);
        let replaced = self.outbox.progress().find(|order| order.id == slot.id() && order.status.is_pending());
        replaced.into_iter().for_each(|order| self.in_force.note_replaced(&order.slot));
        let version = self.outbox.issue(slot, now);
        self.follow_series();
        version
    }

    /// A hold or an abort of any surface is obeyed at once.
    fn take_over_to_stop(&mut self, slot: &Slot, now: Instant) {
        if slot.stops() && self.rivals.holder().is_some() {
            self.take_over_to_obey(now);
        }
    }

    fn take_over_to_obey(&mut self, now: Instant) {
        self.takes_over_to_stop |= !self.pair.takes_over();
        self.call_to_take_over(now);
    }

    /// Has the vehicle leave another surface that holds it, as the operator wishes.
    pub(super) fn take_over(&mut self, now: Instant) {
        self.takes_over_to_stop = false;
        self.call_to_take_over(now);
    }

    fn call_to_take_over(&mut self, now: Instant) {
        self.pair.set_takes_over(true);
        self.rivals.hurry();
        self.contact.hello_due = now;
        self.master.hurry(now);
    }

    /// Until when the vehicle is left alone, because another surface holds it.
    pub(super) fn quiet_until(&self) -> Option<Instant> {
        self.rivals.quiet_until()
    }

    /// Gives a withdrawn order again; returns its version.
    pub(super) fn give_again(&mut self, id: SlotId, now: Instant) -> Option<u16> {
        let slot = self.outbox.withdrawn(id)?;
        Some(self.issue(slot, now))
    }

    /// Sends the orders that the vehicle has lost again; returns them.
    pub(super) fn restore_lost(&mut self, now: Instant) -> Vec<SlotId> {
        let restored = self.outbox.restore_lost(now);
        let of_constraints = self.outbox.progress().find(|order| order.id == SlotId::Constraints);
        let stop = of_constraints.filter(|order| restored.contains(&order.id)).map(|order| order.slot.clone());
        stop.iter().for_each(|slot| self.take_over_to_stop(slot, now));
        self.follow_series();
        restored
    }

    /// Withdraws an order that grows old and has not arrived in time; returns whether there was one.
    pub(super) fn withdraw_late(&mut self, now: Instant) -> bool {
        let is_withdrawn = self.outbox.withdraw_late(now);
        // What is withdrawn takes no vehicle.
        if is_withdrawn && std::mem::take(&mut self.takes_over_to_stop) {
            self.pair.set_takes_over(false);
        }
        is_withdrawn
    }

    /// The vehicle has refused a hello of this surface, because another one holds it.
    fn handle_refusal(&mut self, refusal: &Introduction, now: Instant, events: &mut VecDeque<SurfaceEvent>) {
        if self.rivals.handle_refusal(refusal, now) {
            events.push_back(SurfaceEvent::Rivalry(self.address()));
        }
        self.contact.hello_due = self.rivals.quiet_until().unwrap_or(now);
        self.contact.hellos = 0;
        // A refusal ends this run, so that a copy of it has no effect on a later one.
        self.is_out_of_step = true;
        // Given before this surface knew of the other one.
        match self.outbox.handle_refusal(now) {
            // The refused hello is from before this surface wanted to take over.
            _ if self.pair.takes_over() => self.call_to_take_over(now),
            WaitingStop::None => {}
            WaitingStop::TakesOver => self.take_over_to_obey(now),
            WaitingStop::Withdrawn => {
                events.push_back(SurfaceEvent::SlotDecided(self.address(), SlotId::Constraints));
            }
        }
    }

    /// Begins a new series of orders if one of the present series was never in force, although the vehicle reports so.
    fn leave_refuted_series(&mut self, now: Instant) {
        let refuted = self.outbox.progress().find(|order| self.in_force.refutes(order)).map(|order| order.id);
        if let Some(id) = refuted {
            self.outbox.leave_series_of_displaced(id, |order| self.in_force.has_replaced(order), now);
        }
    }

    pub(super) fn set_clock(&mut self, clock: UtcHours) {
        self.pair.set_clock(clock);
    }

    /// The hello names the series, so a new one begins with a new run.
    fn follow_series(&mut self) {
        self.is_out_of_step |= self.pair.set_series(self.outbox.series());
    }

    /// Continues with the series and the orders of an earlier run of the surface.
    pub(super) fn restore_orders(&mut self, series: Series, orders: impl IntoIterator<Item = SlotProgress>) {
        self.outbox.restore(series, orders);
        self.outbox.progress().for_each(|order| self.in_force.apply(order));
        self.in_force.trust();
        self.pair.set_series(series);
    }

    /// Takes the contents that an earlier run of the surface knew to be in force.
    pub(super) fn restore_in_force(&mut self, contents: impl IntoIterator<Item = Slot>) {
        self.in_force.restore(contents);
    }

    /// Handles a frame of this vehicle; `bytes` is its length.
    pub(super) fn handle_frame(
        &mut self,
        envelope: &Envelope<'_>,
        bytes: usize,
        modem: &ModemProfile,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) {
        let content = &self.content;
        let strays_before = self.pair.strays();
        let inbound = self.pair.handle_frame(envelope, |base, chunks| content.decodes(base, chunks));
        if inbound.is_ok() {
            self.pair.note_length(bytes, modem.frame_bytes);
        }
        let has_changed_key = self.pair.poll_key_change();
        events.extend(has_changed_key.then(|| SurfaceEvent::KeyChanged(self.address())));
        let vehicle = self.address();
        let found = std::iter::from_fn(|| self.pair.poll_mismatch());
        events.extend(found.map(|mismatch| SurfaceEvent::Mismatch(vehicle, mismatch)));
        let inbound = match inbound {
            Ok(inbound) => inbound,
            Err(reason) => {
                if reason == DropReason::Undecodable {
                    self.is_out_of_step |= self.divergence.note_undecodable(now);
                }
                // The vehicle builds on frames that we never acknowledged, or means another run of ours.
                let unanswered = modem.access.is_free() || self.master.unanswered() >= 2;
                // Over a channel that reorders, several late frames in a row are usual.
                let silent = unanswered && self.contact.is_silent_for(STRAYS_TIMEOUT, now);
                // A damaged frame is no sign of another run, so it is no reason to begin a new one.
                let is_stray = self.pair.strays() > strays_before;
                if is_stray && reason == DropReason::OldSession {
                    self.master.handle_stray(envelope.header.remaining, modem, now);
                }
                let strays = is_stray && self.pair.seems_out_of_step() && silent;
                self.is_out_of_step |= reason == DropReason::NoBase || strays;
                return;
            }
        };
        if let Some(refusal) = inbound.refusal {
            let header = inbound.header().clone();
            self.handle_turn(&header, bytes, modem, now);
            return self.handle_refusal(&refusal, now, events);
        }
        if inbound.restarted {
            self.twins.handle_new_run(inbound.header().kind().is_hello(), now);
            self.forget_peer(now, events);
            if self.pair.peer_introduction().is_some_and(|i| i.has_no_memory) {
                let lost = self.outbox.handle_lost_memory(now);
                events.extend((!lost.is_empty()).then(|| SurfaceEvent::OrdersLost(self.address())));
            }
            self.contact.hello_due = now + self.slot_timeout().max(Contact::PROOF_TIMEOUT);
            events.push_back(SurfaceEvent::VehicleRestarted(self.address()));
        }
        // A rejected frame is as old as the newest one at most, or a new run follows.
        self.handle_fates(&inbound.fates, inbound.number.unwrap_or(self.pair.highest()), now);
        self.is_out_of_step |= inbound.lacks_base;
        let header = inbound.header().clone();
        if header.kind().is_hello() {
            if !self.pair.is_of_current_run(&header) {
                let is_found = self.twins.handle_other_hello(now);
                events.extend(is_found.then(|| SurfaceEvent::Mismatch(self.address(), Mismatch::Twin)));
            }
            // A hello of the current run may be a replay, so it is no sign of life.
            if inbound.restarted {
                (self.contact.last_received, self.contact.ordered) = (Some(now), None);
                self.contact.hellos = 0;
            }
            if self.contact.admit_hello(inbound.restarted, now) {
                self.handle_turn(&header, bytes, modem, now);
            }
            return;
        }
        let Some(number) = inbound.number else { return };
        self.pair.set_takes_over(false);
        self.takes_over_to_stop = false;
        if self.rivals.handle_contact(now) {
            events.push_back(SurfaceEvent::Rivalry(self.address()));
        }
        (self.contact.last_received, self.contact.ordered) = (Some(now), None);
        self.contact.hellos = 0;
        self.contact.is_doubtful = false;
        if inbound.is_latest {
            if self.twins.handle_frame(now) {
                events.push_back(SurfaceEvent::Mismatch(self.address(), Mismatch::Twin));
            }
            self.handle_stamp(&header, modem.airtime(bytes), now);
            self.handle_turn(&header, bytes, modem, now);
        }
        self.handle_content(&inbound, number, bytes, now, events);
    }

    fn handle_fates(&mut self, fates: &[(Carried, bool)], number: FrameNumber, now: Instant) {
        for (carried, _) in fates.iter().filter(|(_, delivered)| *delivered) {
            for &(id, version, bytes) in carried {
                self.pair.stats.deliver(id.class(), bytes, now);
                self.outbox.mark_received(id, version, number, now);
            }
        }
    }

    fn handle_content(
        &mut self,
        inbound: &Inbound<'_, Carried>,
        number: FrameNumber,
        bytes: usize,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) {
        self.content.advance_base(inbound.base);
        let version = self.content.map_version();
        let mut overhead = bytes;
        for chunk in inbound.chunks() {
            overhead = overhead.saturating_sub(chunk.payload.len());
            self.handle_chunk(&chunk, number, now, events);
        }
        self.pair.stats.receive(Class::Overhead, overhead, now);
        let is_overtaken = self.content.overtake();
        if self.content.map_version() != version || is_overtaken {
            events.push_back(SurfaceEvent::MapChanged(self.address()));
        }
    }

    fn handle_chunk(
        &mut self,
        chunk: &Chunk<'_>,
        number: FrameNumber,
        now: Instant,
        events: &mut VecDeque<SurfaceEvent>,
    ) {
        let vehicle = self.address();
        self.pair.stats.receive(class_of(chunk), chunk.payload.len(), now);
        let outcome = self.content.handle_chunk(vehicle, number, chunk, &self.pair.stats, now, events);
        self.is_out_of_step |= outcome.is_out_of_step();
        if outcome == ChunkOutcome::Accepted && matches!(chunk.kind, ChunkKind::Map | ChunkKind::Layer) {
            self.divergence.clear();
        }
        if !outcome.is_accepted() {
            return self.pair.stats.drop(DropReason::Malformed);
        }
        if chunk.kind == ChunkKind::Caller
            && Introduction::decode(chunk.payload).is_ok_and(|caller| self.rivals.handle_caller(&caller, now))
        {
            events.push_back(SurfaceEvent::Rivalry(vehicle));
        }
        if chunk.kind == ChunkKind::Report {
            let settled = self.outbox.handle_report(&self.content.status.latest().slots, now);
            let is_lost = |order: &SlotProgress| {
                settled.contains(&order.id) && order.status == OrderStatus::Withdrawn(Withdrawal::Lost)
            };
            events.extend(self.outbox.progress().any(is_lost).then_some(SurfaceEvent::OrdersLost(vehicle)));
            for order in self.outbox.progress().filter(|order| settled.contains(&order.id)) {
                self.in_force.apply(order);
            }
            events.extend(settled.into_iter().map(|id| SurfaceEvent::SlotDecided(vehicle, id)));
            let mut report = VehicleStatus::default();
            if report.read_report(chunk.payload).is_ok() {
                if let Some(summary) = report.in_force {
                    let is_pending = |order: &&SlotProgress| order.status.is_pending();
                    let pending: Vec<Slot> =
                        self.outbox.progress().filter(is_pending).map(|o| o.slot.clone()).collect();
                    self.in_force.handle_report(summary, &pending, number, now);
                }
                let is_replaced = |order: &SlotProgress| self.in_force.has_replaced(order);
                self.outbox.leave_overtaken_series(&report.slots, number, is_replaced, now);
                self.leave_refuted_series(now);
            }
            self.follow_series();
        }
        if let Some(part) = (chunk.kind == ChunkKind::InForce).then(|| InForcePart::decode(chunk.payload)).flatten()
            && self.in_force.handle_part(&part, number, now)
        {
            events.push_back(SurfaceEvent::InForceLearned(vehicle, part.id));
            self.leave_refuted_series(now);
            self.follow_series();
        }
        if matches!(chunk.kind, ChunkKind::Pose | ChunkKind::Report) && self.content.status.whole().is_some() {
            events.push_back(SurfaceEvent::Status(vehicle));
        }
    }

    fn handle_turn(&mut self, header: &Header, bytes: usize, modem: &ModemProfile, now: Instant) {
        if self.last_turn.purpose != FramePurpose::Content || self.pair.horizon() >= self.last_turn.began {
            self.master.handle_answer(bytes, header.remaining, header.turn.map(Wish::of_bits), modem, now);
        }
    }

    fn handle_stamp(&mut self, header: &Header, airtime: Duration, now: Instant) {
        let Some(Stamp::Vehicle { clock_ms, last_received, held }) = header.stamp else { return };
        if let Some(measured) = self.timing.round_trip(last_received, held, now - airtime) {
            self.master.handle_round_trip(measured, now);
        }
        let one_way = self.master.round_trip().unwrap_or_default() / 2;
        self.timing.measure(clock_ms, airtime + one_way, now);
    }

    /// A frame to the vehicle has left the modem; hellos have no number.
    pub(super) fn handle_sent(&mut self, number: Option<FrameNumber>, now: Instant) {
        if let Some(number) = number {
            self.timing.handle_sent(number, now);
        }
    }

    /// Makes an acknowledgement due, if one is owed.
    pub(super) fn owe_answer(&mut self, now: Instant) {
        let is_proven = self.pair.is_proven();
        let wait = if is_proven { self.pace.answer_wait } else { Duration::ZERO };
        if self.pair.unstated() > 0 || (self.pair.has_run() && !is_proven) {
            if self.contact.answer_due.is_none() {
                self.contact.answers_left = self.pair.stats.outgoing.loss.copies(ANSWER_LOSS_RISK, MAX_ANSWERS);
            }
            self.contact.answer_due.get_or_insert(now + wait);
        }
    }

    /// Begins a new run toward the vehicle if the two ends were found to differ; returns whether they were.
    pub(super) fn resync_if_out_of_step(&mut self, now: Instant, events: &mut VecDeque<SurfaceEvent>) -> bool {
        if !std::mem::take(&mut self.is_out_of_step) {
            return false;
        }
        self.pair.renew();
        self.twins.handle_own_run();
        self.forget_peer(now, events);
        true
    }

    /// Drops the copy of an ended run; returns whether there was one.
    pub(super) fn drop_ended(&mut self) -> bool {
        self.content.ended.take().is_some()
    }

    /// The state of the vehicle is unknown: one of the two ends has begun a new run.
    fn forget_peer(&mut self, now: Instant, events: &mut VecDeque<SurfaceEvent>) {
        if self.content.end_run(now) {
            events.push_back(SurfaceEvent::RunEnded(self.address()));
        }
        self.divergence.clear();
        self.in_force.handle_peer_restart();
        if self.pair.takes_over() {
            self.rivals.hurry();
        }
        self.timing = VehicleTiming::default();
        self.last_turn.began = 0;
        self.contact.acknowledged = 0;
        self.outbox.handle_peer_restart(now);
        self.contact.hello_due = self.rivals.quiet_until().unwrap_or(now);
    }
}
