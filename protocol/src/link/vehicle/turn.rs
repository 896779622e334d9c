//! When the vehicle speaks, and how a turn ends.

use super::{Carried, Said, VehicleLink};
use crate::link::Transmit;
use crate::mac::{Access, quarter_seconds};
use crate::map::StateSource;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, FrameBuilder, Header, Seal, Stamp};
use std::collections::VecDeque;
use std::time::Duration;

/// Frames smaller than this have no room for both a status and a stamp.
const SMALL_FRAME: usize = 48;

/// A frame about to be filled.
struct Plan {
    /// Frames of this turn after this one.
    remaining: u32,
    /// Whether nothing new is expected to follow it in this turn.
    is_last_new: bool,
}

impl<S: StateSource> VehicleLink<S> {
    /// The next frame, if it is our turn, there is a reason to speak and the budget allows it.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        let modem = self.config.modem;
        if self.source.handle_timeout(now) {
            self.forget_said();
        }
        if self.floor.is_over(&modem, now) {
            self.end_turn();
        }
        let open = self.floor.frames(&modem, now).min(u32::from(u8::MAX));
        if open == 0 || !self.has_reason_to_speak(now) {
            return None;
        }
        let bits = modem.bits_on_air(modem.frame_bytes);
        let frames = self.budget.affordable(bits, modem.frame_airtime(), open, now);
        if frames == 0 {
            self.blocked_until = Some(self.budget.earliest(bits, now));
            self.end_turn();
            return None;
        }
        self.blocked_until = None;
        if self.pair.is_full() {
            // The surface has heard nothing for so long that numbers run out.
            self.renew(now);
        }
        let (transmit, last) = match (self.called.take(), self.repeats.pop_front()) {
            (Some(call), _) => (self.write_here(call), true),
            (None, Some(bytes)) => {
                self.pair.stats.repeated_bytes += bytes.len() as u64;
                // What is said again at the beginning of a turn may be known by now: something new always follows it.
                let last = self.repeats.is_empty() && self.said_frames > 0;
                (Transmit { to: Address::SURFACE, bytes, kind: "again" }, last)
            }
            (None, None) => self.write_frame(frames, now),
        };
        self.floor.spend(last);
        self.budget.spend(modem.bits_on_air(transmit.bytes.len()), now);
        Some(transmit)
    }

    /// Nothing was said in this turn yet. Where turns are taken, the surface has spoken after the end of our last one: what
    /// it has not judged of that has not reached it, and if this is little, it is said again as it was.
    pub(super) fn begin_turn(&mut self) {
        const FEW: usize = 8;
        let horizon = self.pair.horizon();
        self.said.retain(|s| s.number > horizon);
        self.said_frames = 0;
        let all = self.said.len() as u64 == self.pair.outstanding();
        let repeats = self.config.modem.access == Access::Shared && !self.pair.must_greet();
        if !repeats || self.said.len() > FEW || !all {
            self.said.clear();
        }
        self.repeats = self.said.iter().map(|s| s.bytes.clone()).collect();
    }

    /// What was said is not what would be said now.
    pub(super) fn forget_said(&mut self) {
        self.said.clear();
        self.repeats.clear();
    }

    fn end_turn(&mut self) {
        self.floor.give_up();
        self.repeats.clear();
    }

    fn has_reason_to_speak(&self, now: Instant) -> bool {
        if !matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return true;
        }
        let answer = self.answer_due.is_some_and(|at| now >= at) || self.called.is_some();
        let news = self.has_news();
        answer || (self.pair.is_met() && (news || (self.status.is_some() && self.wants_status(now))))
    }

    fn has_news(&self) -> bool {
        self.source.backlog_bytes() > 0 || self.objects.backlog_bytes() > 0
    }

    pub(super) fn next_wakeup(&self) -> Option<Instant> {
        if !matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return self.floor.next_wakeup();
        }
        let status = self.status.as_ref().filter(|_| self.pair.is_met()).map(|_| self.pose_due.min(self.report_due));
        let held = self.source.next_due().filter(|_| self.pair.is_met());
        let due = [status, held, self.answer_due].into_iter().flatten().min();
        match self.blocked_until {
            Some(blocked) => Some(due.map_or(blocked, |at| at.max(blocked))),
            None => due,
        }
    }

    fn frames_wanted(&self) -> u32 {
        let room = self.config.modem.frame_bytes.saturating_sub(14).max(1);
        let bytes = self.source.backlog_bytes() + self.objects.backlog_bytes();
        bytes.div_ceil(room).clamp(1, 255) as u32
    }

    /// How often a turn of `frames` frames, `bytes` in all, is said, where nothing else is left to say: as long as saying it once more takes
    /// less time than the next turn would, times the chance that this makes it needless. Never where the budget is what
    /// limits the link, or where frames of earlier turns are of unknown fate: then another turn is needed anyway.
    fn copies(&self, frames: u32, bytes: usize, now: Instant) -> u32 {
        const MOST: i32 = 6;
        let modem = &self.config.modem;
        let budget_binds = f64::from(self.budget.bits_per_s()) < modem.bit_rate_bps / 2.0;
        let covered = self.pair.outstanding() <= self.said.len() as u64;
        if modem.access != Access::Shared || !covered || (budget_binds && !self.budget.is_plentiful(now)) {
            return 1;
        }
        let loss = self.pair.stats.loss_out.expected().clamp(0.0, 0.95);
        let incomplete = |copies: i32| 1.0 - (1.0 - loss.powi(copies)).powi(frames.min(1000) as i32);
        let again = modem.time_of(bytes as u64 * 8 + modem.overhead_bits * u64::from(frames)).as_secs_f64();
        let next_turn = self.time_of_hands().as_secs_f64();
        let worth = |copies: i32| again < (incomplete(copies) - incomplete(copies + 1)) * next_turn;
        (1..MOST).find(|&copies| !worth(copies)).unwrap_or(MOST) as u32
    }

    /// Room for an acknowledgement: in the first frames of a turn, as many as it takes for one to get through, and then
    /// now and again.
    fn ack_room(&self, is_last_new: bool) -> usize {
        const SELDOM: usize = 8;
        let size = self.config.modem.frame_bytes;
        let said = self.said_frames;
        let early = said < self.pair.stats.loss_out.copies(0.001, 12) as usize;
        match early || is_last_new || said.is_multiple_of(SELDOM) {
            true if size < SMALL_FRAME => 3,
            true => size / 6,
            false => 0,
        }
    }

    /// Time from the end of a turn to the beginning of the next, if both ways get through.
    fn time_of_hands(&self) -> Duration {
        let modem = &self.config.modem;
        (modem.turn_around + self.one_way.unwrap_or(Duration::from_millis(300))) * 2 + modem.airtime(32)
    }

    /// The last `count` frames of this turn, round and round, the last one at the end: it tells what follows.
    fn again(&self, count: u32) -> VecDeque<Vec<u8>> {
        let mut again: VecDeque<Vec<u8>> =
            self.said.iter().rev().map(|s| s.bytes.clone()).cycle().take(count as usize).collect();
        again.make_contiguous().reverse();
        again
    }

    fn plan(&self, frames: u32, now: Instant) -> Plan {
        if matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return Plan { remaining: 0, is_last_new: false };
        }
        let wanted = self.frames_wanted();
        let said = self.said.len() as u32 + wanted;
        let copies = self.copies(said, self.config.modem.frame_bytes * said as usize, now);
        let repeats = said * (copies - 1);
        Plan { remaining: (wanted + repeats).min(frames) - 1, is_last_new: wanted == 1 || frames == 1 }
    }

    fn write_frame(&mut self, frames: u32, now: Instant) -> (Transmit, bool) {
        let modem = self.config.modem;
        let size = modem.frame_bytes;
        let greets = self.pair.must_greet();
        let plan = if greets { Plan { remaining: 0, is_last_new: true } } else { self.plan(frames, now) };
        let wish = (plan.is_last_new && !greets).then(|| self.wish(now));
        let stamp = self.stamp(now).filter(|_| plan.is_last_new || self.said_frames == 0);
        let ack_room = self.ack_room(plan.is_last_new);
        let mut builder = self.pair.begin_frame(size, ack_room, wish, stamp, false);
        let mut carried = Carried::new();
        if !greets {
            self.fill(&mut builder, &mut carried, now);
        }
        let takes_turns = !matches!(modem.access, Access::ModemOwned { .. });
        let said_all = takes_turns && !greets && self.source.backlog_bytes() + self.objects.backlog_bytes() == 0;
        let remaining = match said_all {
            // What was said is said again as far as that is of use.
            true if !carried.is_empty() => {
                let said = self.said.len() as u32 + 1;
                let bytes = self.said.iter().map(|s| s.bytes.len()).sum::<usize>() + builder.len(true);
                (said * (self.copies(said, bytes, now) - 1)).min(frames - 1)
            }
            true => 0,
            // Where nothing more fits, what is left waits for the next turn.
            false if carried.is_empty() => 0,
            false => plan.remaining,
        };
        builder.set_remaining(remaining.min(255) as u8);
        let last = remaining == 0;
        let transmit = self.close(builder, carried, greets, last || said_all || !takes_turns);
        if !greets {
            self.remember(&transmit, said_all, remaining);
        }
        self.answer_due = greets.then(|| now + Duration::from_secs(10));
        (transmit, last && takes_turns)
    }

    fn close(&mut self, builder: FrameBuilder, carried: Carried<S::Carried>, hello: bool, short: bool) -> Transmit {
        let kind = carried.iter().max_by_key(|(_, n)| *n).map_or("ack", |(p, _)| p.class().name());
        let payload: usize = carried.iter().map(|(_, n)| n).sum();
        for (part, n) in &carried {
            self.pair.stats.count(part.class(), *n);
        }
        let bytes = self.pair.finish_frame(builder, carried, hello, short);
        self.pair.stats.count(Class::Overhead, bytes.len().saturating_sub(payload));
        Transmit { to: Address::SURFACE, bytes, kind }
    }

    /// Keeps what was said in this turn; once all is said, the rest of the turn goes to saying it again.
    fn remember(&mut self, transmit: &Transmit, said_all: bool, remaining: u32) {
        const MOST_KEPT: usize = 64;
        self.said_frames += 1;
        if self.said.len() == MOST_KEPT {
            self.said.pop_front();
        }
        let number = self.pair.next_number() - 1;
        self.said.push_back(Said { number, bytes: transmit.bytes.clone() });
        if said_all && remaining > 0 {
            self.repeats = self.again(remaining);
        }
    }

    fn stamp(&self, now: Instant) -> Option<Stamp> {
        let heard = self.heard.filter(|_| self.config.modem.frame_bytes >= SMALL_FRAME)?;
        Some(Stamp::Vehicle { clock_ms: Stamp::clock(now), heard: heard.number as u8, held: now.since(heard.at) })
    }

    /// "Here": the answer to a call for vehicles that are not known.
    fn write_here(&mut self, (session, nonce): (crate::wire::SessionId, u64)) -> Transmit {
        let authenticity = self.config.authenticity.clone();
        let header = Header {
            from: self.config.address,
            to: Address::SURFACE,
            session,
            number: 0,
            base: 1,
            remaining: 0,
            turn: None,
            stamp: None,
            nonce: authenticity.as_ref().map(|_| nonce),
            ack: None,
            hello: true,
            keyed: authenticity.is_some(),
        };
        let builder = FrameBuilder::new(&header, self.config.modem.frame_bytes);
        let mission = self.config.mission;
        let bytes = match &authenticity {
            Some(a) => builder.finish(&Seal::Hello(&a.key, mission, session.get(), nonce), true),
            None => builder.finish(&Seal::Crc(mission, session.get()), true),
        };
        self.pair.stats.count(Class::Overhead, bytes.len());
        Transmit { to: Address::SURFACE, bytes, kind: "hello" }
    }

    /// When another turn would be of use, as the turn byte says it.
    fn wish(&self, now: Instant) -> u8 {
        let modem = &self.config.modem;
        let affordable = self.budget.earliest(modem.bits_on_air(modem.frame_bytes) * 2, now).since(now);
        let idle = self.source.is_quiet() && self.objects.is_empty();
        let pause = self.source.next_due().map_or(self.idle_pause(), |due| self.idle_pause().min(due.since(now)));
        let wait = if idle { affordable.max(pause).min(self.config.status_period) } else { affordable };
        quarter_seconds(wait, 254)
    }

    /// Pause between turns while nothing is to be said: turns that only ask take at most a tenth of the budget.
    fn idle_pause(&self) -> Duration {
        const ASK_AND_ANSWER_BITS: f64 = 240.0;
        let tenth = f64::from(self.budget.bits_per_s()) / 10.0;
        Duration::from_secs_f64((ASK_AND_ANSWER_BITS / tenth).max(1.0))
    }
}
