//! When the vehicle speaks, and how a turn ends.

use super::{Carried, VehicleLink};
use crate::link::Transmit;
use crate::mac::{Access, quarter_seconds};
use crate::map::StateSource;
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{Address, Backlog, FrameBuilder, Stamp};
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
        let mut released = self.source.handle_timeout(now);
        self.planes.iter_mut().for_each(|p| released |= p.source.handle_timeout(now));
        if released {
            self.forget_said();
        }
        if self.floor.is_over(&modem, now) {
            self.end_turn();
        }
        let open = self.floor.frames(&modem, now).min(u32::from(u8::MAX));
        let nobody = !self.pair.has_heard() && self.called.is_none();
        if open == 0 || nobody || !self.has_reason_to_speak(now) {
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
        if self.pair.is_met() && self.pair.is_full() {
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

    fn end_turn(&mut self) {
        self.floor.give_up();
        self.repeats.clear();
    }

    fn has_reason_to_speak(&self, now: Instant) -> bool {
        if !matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return true;
        }
        let answer = self.answer_due.is_some_and(|at| now >= at) || self.called.is_some();
        let news = self.backlog_bytes(now) > 0;
        answer || (self.pair.is_met() && (news || (self.status.is_some() && self.wants_status(now))))
    }

    /// What waits and may be sent, for people.
    pub(super) fn backlog(&self, now: Instant) -> Backlog {
        let bytes = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let others = self.shared_plane_backlog() + self.objects.backlog_bytes() + self.extra_backlog(now);
        Backlog { map_bytes: bytes(self.source.told_backlog_bytes()), other_bytes: bytes(others) }
    }

    /// About how many bytes wait and may be sent.
    fn backlog_bytes(&self, now: Instant) -> usize {
        let own = self.source.backlog_bytes() + self.shared_plane_backlog() + self.objects.backlog_bytes();
        own + self.extra_backlog(now)
    }

    /// When something that is held back becomes due.
    fn next_due(&self) -> Option<Instant> {
        let planes = self.planes().filter_map(StateSource::next_due);
        self.source.next_due().into_iter().chain(planes).min()
    }

    pub(super) fn next_wakeup(&self) -> Option<Instant> {
        if !matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return self.floor.next_wakeup();
        }
        let status = self.status.as_ref().filter(|_| self.pair.is_met()).map(|_| self.pose_due.min(self.report_due));
        let held = self.next_due().filter(|_| self.pair.is_met());
        let due = [status, held, self.answer_due].into_iter().flatten().min();
        match self.blocked_until {
            Some(blocked) => Some(due.map_or(blocked, |at| at.max(blocked))),
            None => due,
        }
    }

    fn frames_wanted(&self, now: Instant) -> u32 {
        let room = self.config.modem.frame_bytes.saturating_sub(14).max(1);
        let bytes = self.backlog_bytes(now);
        bytes.div_ceil(room).clamp(1, 255) as u32
    }

    /// Room for an acknowledgement: in the first frames of a turn, as many as it takes for one to get through, and then
    /// now and again.
    fn ack_room(&self, is_last_new: bool) -> usize {
        const SELDOM: usize = 8;
        let size = self.config.modem.frame_bytes;
        let said = self.said_frames;
        let usual = if size < SMALL_FRAME { 3 } else { size / 6 };
        if said == 0 && self.pair.statement_bytes() > 4 * usual {
            // So much was lost that the statement would fall ever further behind.
            return size / 2;
        }
        let early = said < self.pair.stats.loss_out.copies(0.001, 12) as usize;
        match early || is_last_new || said.is_multiple_of(SELDOM) {
            true => usual,
            false => 0,
        }
    }

    fn plan(&self, frames: u32, now: Instant) -> Plan {
        if matches!(self.config.modem.access, Access::ModemOwned { .. }) {
            return Plan { remaining: 0, is_last_new: false };
        }
        let wanted = self.frames_wanted(now);
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
        let said_all = takes_turns && !greets && self.backlog_bytes(now) == 0;
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

    fn stamp(&self, now: Instant) -> Option<Stamp> {
        let heard = self.heard.filter(|_| self.config.modem.frame_bytes >= SMALL_FRAME)?;
        Some(Stamp::Vehicle { clock_ms: Stamp::clock(now), heard: heard.number as u8, held: now.since(heard.at) })
    }

    /// When another turn would be of use, as the turn byte says it.
    fn wish(&self, now: Instant) -> u8 {
        let modem = &self.config.modem;
        let affordable = self.budget.earliest(modem.bits_on_air(modem.frame_bytes) * 2, now).since(now);
        let idle = self.source.is_quiet() && self.extras_are_quiet(now) && self.objects.has_only_extra();
        let pause = self.next_due().map_or(self.idle_pause(), |due| self.idle_pause().min(due.since(now)));
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
