//! When the vehicle transmits, and how a turn ends.

use super::content::FillContext;
use super::parts::{Carried, Part};
use super::repeat::RepeatTerms;
use super::{VehicleEvent, VehicleLink};
use crate::link::handshake::FramePurpose;
use crate::link::{AckRoom, Transmit, TransmitKind, by_class};
use crate::mac::{Access, Wish};
use crate::map::StateSource;
use crate::schedule::{BitBudget, Class};
use crate::time::Instant;
use crate::wire::{Address, FrameBuilder, Stamp};
use std::collections::BTreeMap;
use std::time::Duration;

/// Frames smaller than this have no room for both a status and a stamp.
const SMALL_FRAME: usize = 48;

/// Probability that all copies of a status may be lost where both ends transmit at once.
const STATUS_LOSS_RISK: f64 = 0.004;
/// Up to this loss, the least that the estimate assumes, a status has no copies.
const NO_LOSS: f64 = 0.012;
const MAX_STATUS_COPIES: u32 = 4;

/// A frame about to be filled.
struct FramePlan {
    /// Frames of this turn after this one.
    remaining: u32,
    /// Whether no new frame is expected to follow it in this turn.
    is_last_new: bool,
}

impl<S: StateSource> VehicleLink<S> {
    /// The next frame, if it is our turn, there is a reason to transmit and the budget allows it. The host calls this
    /// after every event and at [`Self::poll_timeout`] until it returns `None`.
    #[must_use]
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        let modem = self.config.modem;
        if self.content.handle_timeout(now) {
            self.repeater.forget();
        }
        if self.floor.is_over(&modem, now) {
            self.end_turn();
        }
        let open = self.floor.frames(&modem, now).min(u32::from(u8::MAX));
        let has_no_peer = !self.pair.has_contact() && !self.reply.is_pending();
        if open == 0 || has_no_peer || !self.has_reason_to_transmit(now) {
            return None;
        }
        let bits = modem.bits_on_air(modem.frame_bytes);
        let frames = (0..open).map(|before| (bits, now + modem.frame_airtime() * before));
        let frames = self.budget.affordable(frames) as u32;
        if frames == 0 {
            self.blocked_until = Some(self.budget.earliest(bits, now));
            self.end_turn();
            return None;
        }
        self.blocked_until = None;
        if self.pair.has_run() && self.pair.is_full() {
            // The surface has acknowledged no frame for so long that the frame numbers run out.
            self.renew(now);
        }
        let (transmit, last) = self.next_frame(frames, now);
        if modem.access == Access::FullDuplex {
            let round_trip = self.timing.one_way().unwrap_or_default() * 2;
            let wait = modem.answer_wait(Duration::ZERO) * 2 + modem.airtime(transmit.bytes.len()) + round_trip;
            self.probe.handle_transmit(wait, now);
        }
        self.floor.spend(last);
        self.budget.spend(modem.bits_on_air(transmit.bytes.len()), now);
        Some(transmit)
    }

    /// The frame to send now, of at most `frames` in this turn, and whether the turn ends with it.
    fn next_frame(&mut self, frames: u32, now: Instant) -> (Transmit, bool) {
        if let Some(bytes) = self.reply.take(&self.config, self.pair.authenticity()) {
            self.pair.stats.count(Class::Overhead, bytes.len());
            return (
                Transmit { to: Address::SURFACE, bytes, kind: TransmitKind::Hello, contents: BTreeMap::new() },
                true,
            );
        }
        if let Some((bytes, last)) = self.repeater.pop() {
            self.pair.stats.repeated_bytes += bytes.len() as u64;
            return (
                Transmit { to: Address::SURFACE, bytes, kind: TransmitKind::Repeat, contents: BTreeMap::new() },
                last,
            );
        }
        self.write_frame(frames, now)
    }

    pub(super) fn begin_turn(&mut self) {
        let may_repeat = self.config.modem.access == Access::Shared && !self.pair.must_send_hello();
        let frames = (self.pair.horizon(), self.pair.outstanding(), self.pair.stats.frames_lost);
        self.repeater.begin_turn(frames, may_repeat, self.content.has_news());
    }

    fn end_turn(&mut self) {
        self.floor.give_up();
        self.repeater.end_turn();
    }

    fn is_answer_due(&self, now: Instant) -> bool {
        self.answer_due.is_some_and(|at| now >= at)
    }

    fn has_reason_to_transmit(&self, now: Instant) -> bool {
        if !self.config.modem.access.is_free() {
            return true;
        }
        let is_repeat_due = self.hello_limit.next_repeat().is_some_and(|at| now >= at);
        let is_probe_due = self.probe.is_due(now) && self.pair.has_run();
        let answer = is_probe_due || self.is_answer_due(now) || is_repeat_due || self.reply.is_pending();
        let news = self.content.backlog_bytes(&self.budget, now) > 0;
        answer || (self.pair.has_run() && (news || self.content.status.is_waiting(now)))
    }

    pub(super) fn next_wakeup(&self) -> Option<Instant> {
        if !self.config.modem.access.is_free() {
            return self.floor.next_wakeup();
        }
        let status = self.content.status.next_due().filter(|_| self.pair.has_run());
        let held = self.content.next_due().filter(|_| self.pair.has_run());
        let probe = self.probe.due().filter(|_| self.pair.has_run());
        let due = [status, held, probe, self.answer_due, self.hello_limit.next_repeat()].into_iter().flatten().min();
        match self.blocked_until {
            Some(blocked) => Some(due.map_or(blocked, |at| at.max(blocked))),
            None => due,
        }
    }

    /// Frames that the content which waits takes.
    fn frames_wanted(&self, now: Instant) -> u32 {
        let room = self.config.modem.frame_bytes.saturating_sub(14).max(1);
        let frames = self.content.backlog_bytes(&self.budget, now).div_ceil(room).min(self.spare_frames(now));
        self.content.urgent_bytes().div_ceil(room).max(frames).clamp(1, 255) as u32
    }

    /// Frames that may be sent in this turn with spare capacity: as long as there is some, and for no longer than a change of
    /// turns takes, so that orders of the surface do not wait.
    fn spare_frames(&self, now: Instant) -> usize {
        const LONGEST: Duration = Duration::from_secs(2);
        let modem = &self.config.modem;
        let airtime = modem.frame_airtime().max(Duration::from_micros(1));
        let longest = (self.handover().min(LONGEST).as_secs_f64() / airtime.as_secs_f64()) as usize;
        let (mut budget, mut at, mut frames) = (self.budget.clone(), now, 0);
        while self.repeater.new_frames() + frames < longest && budget.is_plentiful(at) {
            budget.spend(modem.bits_on_air(modem.frame_bytes), at);
            (at, frames) = (at + airtime, frames + 1);
        }
        frames
    }

    /// Time from the end of a turn to the beginning of the next, if both directions get through.
    fn handover(&self) -> Duration {
        let modem = self.config.modem;
        let one_way = self.timing.one_way().unwrap_or(Duration::from_millis(300));
        (modem.turn_around + one_way) * 2 + modem.airtime(32)
    }

    /// Bytes for an acknowledgement: in the first frames of a turn, as many as it takes for one to get through, in every eighth frame,
    /// and in the last new one, whose turn byte may have it. Where the budget of a vehicle that is granted turns is the limit, fewer
    /// will do: one that does not get through comes again in the next turn.
    fn ack_room(&self, is_last_new: bool, now: Instant) -> usize {
        const ACK_INTERVAL: usize = 8;
        let size = self.config.modem.frame_bytes;
        let sent = self.repeater.new_frames();
        let usual = if size < SMALL_FRAME { 3 } else { size / 6 };
        if sent.is_multiple_of(ACK_INTERVAL) && self.pair.statement_bytes() > 4 * usual {
            // So many frames were lost that the acknowledgements would fall ever further behind.
            return size / 2;
        }
        let loss = self.pair.stats.outgoing.loss;
        let is_scarce = !self.config.modem.access.is_free() && self.is_budget_bound(now);
        let first = match is_scarce {
            // The last new frame is one of them, with no bytes, whenever the turn proves to end.
            true => loss.copies(0.15, 12) - u32::from(self.pair.fits_turn_byte()),
            false => loss.copies(0.001, 12),
        };
        match sent < first as usize || is_last_new || (sent + 1).is_multiple_of(ACK_INTERVAL) {
            true => usual,
            false => 0,
        }
    }

    fn is_budget_bound(&self, now: Instant) -> bool {
        let is_limited = f64::from(self.budget.bits_per_s()) < self.config.modem.bit_rate_bps / 2.0;
        is_limited && !self.budget.is_plentiful(now)
    }

    fn repeat_terms(&self, now: Instant) -> RepeatTerms {
        RepeatTerms {
            modem: self.config.modem,
            outstanding: self.pair.outstanding(),
            loss: self.pair.stats.outgoing.loss.expected(),
            is_budget_bound: self.is_budget_bound(now),
            handover: self.handover(),
        }
    }

    /// How often a turn of so many frames and bytes is sent. Objects, which spare capacity carries, have symbols of their own
    /// against losses.
    fn copies(&self, frames: u32, bytes: usize, now: Instant) -> u32 {
        if self.repeater.has_urgent() { self.repeater.copies(frames, bytes, &self.repeat_terms(now)) } else { 1 }
    }

    fn plan(&self, frames: u32, now: Instant) -> FramePlan {
        if self.config.modem.access.is_free() {
            return FramePlan { remaining: 0, is_last_new: false };
        }
        let wanted = self.frames_wanted(now);
        let turn = self.repeater.kept() + wanted;
        let bytes = self.config.modem.frame_bytes * turn as usize;
        let repeats = turn * (self.copies(turn, bytes, now) - 1);
        FramePlan { remaining: (wanted + repeats).min(frames) - 1, is_last_new: wanted == 1 || frames == 1 }
    }

    fn write_frame(&mut self, frames: u32, now: Instant) -> (Transmit, bool) {
        let modem = self.config.modem;
        let size = modem.frame_bytes;
        // Where the surface polls or grants turns, content shows that it uses the current run: a late hello alone is no reason
        // to leave it.
        let may_repeat = modem.access.is_free() || self.is_answer_due(now);
        if may_repeat && self.hello_limit.repeat(now) {
            self.pair.repeat_hello();
        }
        let sends_hello = self.pair.must_send_hello();
        if self.content.urgent_bytes() > 0 || self.content.status.is_waiting(now) {
            self.repeater.note_urgent();
        }
        let plan = if sends_hello { FramePlan { remaining: 0, is_last_new: true } } else { self.plan(frames, now) };
        let stamp = self.stamp(plan.is_last_new, now);
        let takes_turns = !modem.access.is_free();
        let bytes = self.ack_room(plan.is_last_new, now);
        // A frame without bytes for it may prove to be the last, which has a turn byte.
        let room = AckRoom { bytes, in_turn: takes_turns && (plan.is_last_new || bytes == 0) };
        if sends_hello {
            let series = self.pair.caller().and_then(|surface| surface.series);
            self.pair.set_memory(series.is_none_or(|series| self.inbox.knows(series)));
        }
        // Room for the byte; the wish is known once the frame is filled.
        let turn = (plan.is_last_new && !sends_hello).then_some(0);
        let mut builder = self.pair.begin_frame(size, room, turn, stamp, FramePurpose::Content);
        if takes_turns {
            builder = builder.in_turn(frames.saturating_sub(1).min(255) as u8);
        }
        let mut carried = Carried::new();
        if !sends_hello {
            if modem.access == Access::FullDuplex {
                let loss = self.pair.stats.outgoing.loss;
                let copies =
                    if loss.expected() <= NO_LOSS { 1 } else { loss.copies(STATUS_LOSS_RISK, MAX_STATUS_COPIES) };
                self.content.status.set_copies(copies, self.budget.bits_per_s());
            }
            let (slots, refused_frames) = (self.inbox.reports(), self.pair.stats.refused());
            let context = FillContext { budget: &self.budget, slots, refused_frames, now };
            carried = self.content.fill(&mut builder, &context);
            self.events.extend(self.content.oversized.take().map(VehicleEvent::Oversized));
        }
        let is_complete = takes_turns && !sends_hello && self.is_last_with_content(now);
        if is_complete {
            self.repeater.note_complete();
        }
        let remaining = match is_complete {
            // The rest of the turn is filled with copies as far as they pay off.
            true if !carried.is_empty() => {
                let turn = self.repeater.kept() + 1;
                let bytes = self.repeater.kept_bytes() + builder.len(true);
                (turn * (self.copies(turn, bytes, now) - 1)).min(frames - 1)
            }
            true => 0,
            // No chunk fits into this frame: the rest waits for the next turn.
            false if carried.is_empty() => 0,
            false => plan.remaining,
        };
        builder.set_remaining(remaining.min(255) as u8);
        if takes_turns && !sends_hello && (plan.is_last_new || remaining == 0 || is_complete) {
            builder.set_turn(self.wish(now).bits());
        }
        let last = remaining == 0;
        let purpose = FramePurpose::hello_if(sends_hello);
        let transmit = self.close(builder, carried, purpose, last || is_complete || !takes_turns);
        if !sends_hello {
            let copies = (is_complete && remaining > 0).then_some(remaining);
            self.repeater.keep(self.pair.next_number() - 1, &transmit.bytes, copies);
        }
        if sends_hello {
            self.hello_limit.note_answer(now);
        }
        self.answer_due = sends_hello.then(|| now + self.hello_limit.repeat_interval());
        (transmit, last && takes_turns)
    }

    /// Whether a frame after the one that is filled at `now` would have no content.
    fn is_last_with_content(&self, now: Instant) -> bool {
        let (rest, next) = self.after_a_frame(now);
        self.content.backlog_bytes(&rest, next) == 0
    }

    /// The budget that a full frame at `now` leaves, and when it has left.
    fn after_a_frame(&self, now: Instant) -> (BitBudget, Instant) {
        let modem = &self.config.modem;
        (self.budget.after(modem.bits_on_air(modem.frame_bytes), now), now + modem.frame_airtime())
    }

    /// The stamp of the next frame, which only the first and the last frame of a turn have.
    fn stamp(&mut self, is_last_new: bool, now: Instant) -> Option<Stamp> {
        let is_first = self.repeater.new_frames() == 0;
        if is_first {
            self.timing.begin_turn(self.budget.bits_per_s(), now);
        }
        let is_last = is_last_new && self.timing.one_way().is_none();
        let has_stamp = self.config.modem.frame_bytes >= SMALL_FRAME && (is_first || is_last);
        self.timing.stamp(now).filter(|_| has_stamp)
    }

    fn close(
        &mut self,
        builder: FrameBuilder,
        carried: Carried<S::Carried>,
        purpose: FramePurpose,
        short: bool,
    ) -> Transmit {
        let mainly = carried
            .iter()
            .max_by_key(|(_, n)| *n)
            .map_or(TransmitKind::Acknowledgement, |(p, _)| TransmitKind::Content(p.class()));
        let payload: usize = carried.iter().map(|(_, n)| n).sum();
        let contents = by_class(carried.iter().map(|(part, n)| (part.class(), *n)));
        contents.iter().for_each(|(class, n)| self.pair.stats.count(*class, *n as usize));
        for (part, _) in &carried {
            self.pair.stats.chunks_sent += u64::from(matches!(part, Part::Map(_)));
        }
        let bytes = self.pair.finish_frame(builder, carried, purpose, short);
        self.pair.stats.count(Class::Overhead, bytes.len().saturating_sub(payload));
        Transmit { to: Address::SURFACE, bytes, kind: mainly, contents }
    }

    /// When another turn would be of use.
    fn wish(&self, now: Instant) -> Wish {
        let modem = &self.config.modem;
        let affordable = self.budget.earliest(modem.bits_on_air(modem.frame_bytes) * 2, now).since(now);
        let (rest, next) = self.after_a_frame(now);
        let wait = match self.content.backlog_bytes(&rest, next) {
            0 => {
                let pause = self.idle_pause(self.content.is_idle(&rest, next));
                let pause = self.content.next_due().map_or(pause, |due| pause.min(due.since(now)));
                affordable.max(pause).min(self.config.status_period)
            }
            _ => affordable,
        };
        Wish::after(wait)
    }

    /// Pause between turns while no content waits: empty turns take at most a tenth of the budget. While content is under way, which
    /// waits again if it was lost, a pause that is not worth much is left out.
    fn idle_pause(&self, is_idle: bool) -> Duration {
        const EMPTY_TURN_BITS: f64 = 240.0;
        const LEAST: Duration = Duration::from_secs(1);
        let tenth = f64::from(self.budget.bits_per_s()) / 10.0;
        match Duration::from_secs_f64(EMPTY_TURN_BITS / tenth) {
            pause if pause >= LEAST => pause,
            _ if is_idle => LEAST,
            _ => Duration::ZERO,
        }
    }
}
