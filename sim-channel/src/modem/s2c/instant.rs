//! Instant, synchronous and piggyback messages: one slot each.

use super::air::After;
use super::frame::Kind;
use super::send_command::{Flag, SendCommand};
use super::timing;
use super::{Event, S2c};
use crate::Duration;

/// The instant message that is under way; there is only ever one.
#[derive(Clone, Debug)]
pub(super) struct Pending {
    pub number: u8,
    pub dst: u8,
    pub flag: Flag,
    pub pid: u8,
    pub data: Vec<u8>,
    pub retries_left: u32,
}

/// The slot and what became of the last message in it, as `?DI` tells.
#[derive(Debug, Default)]
pub(super) struct InstantSlot {
    pub pending: Option<Pending>,
    pub last_number: u8,
    pub outcome: Option<&'static str>,
    /// Counts attempts, so that an old timer is not taken for the present one's.
    pub attempt: u32,
    /// Waits for the next turn of a connection to the same peer.
    pub waits_for_turn: bool,
}

/// A piggyback message that waits for a frame to carry it.
#[derive(Clone, Debug)]
pub(super) struct Piggyback {
    pub dst: u8,
    pub pid: u8,
    pub data: Vec<u8>,
}

/// A synchronous message that waits for its time.
#[derive(Clone, Debug)]
pub(super) struct Synchronous {
    pub dst: u8,
    pub pid: u8,
    pub data: Vec<u8>,
}

impl S2c {
    pub(super) fn send_instant(&mut self, command: SendCommand, flag: Flag, now: Duration) -> &'static str {
        let dst = command.dst;
        if !self.may_address(dst, flag != Flag::Ack) {
            return "ERROR WRONG DESTINATION ADDRESS";
        }
        if self.instant.pending.is_some() {
            return "BUSY DELIVERING MESSAGE";
        }
        if flag != Flag::Force && self.in_backoff(dst, now) {
            return "BUSY BACKOFF STATE";
        }
        self.instant.last_number = self.instant.last_number.wrapping_add(1);
        self.instant.outcome = None;
        self.instant.pending = Some(Pending {
            number: self.instant.last_number,
            dst,
            flag,
            pid: command.pid.unwrap_or_else(|| self.settings.byte("ZS")),
            data: command.data,
            retries_left: self.settings.get("RI"),
        });
        self.board.plan(now, Event::Instant);
        "OK"
    }

    /// Puts the pending message on air, or lets it wait for this modem's turn in a connection.
    pub(super) fn try_instant(&mut self, now: Duration) {
        let force = self.instant.pending.as_ref().is_some_and(|pending| pending.flag == Flag::Force);
        if force || (self.may_talk() && !self.is_online()) {
            self.put_instant(false, 0);
        } else {
            self.instant.waits_for_turn = true;
            if self.may_talk() {
                self.begin_turn_after(Duration::ZERO, false, now);
            }
        }
    }

    /// Sends the pending message; `follow` packets and an acknowledgement come after it if it opens a turn.
    pub(super) fn put_instant(&mut self, in_turn: bool, follow: u8) {
        self.instant.waits_for_turn = false;
        let Some(pending) = self.instant.pending.clone() else { return };
        let mut frame = self.frame(Kind::Instant, pending.dst);
        frame.pid = pending.pid;
        frame.tag = Flag::ALL.iter().position(|flag| *flag == pending.flag).unwrap_or_default() as u8;
        frame.seq = u32::from(pending.number) | u32::from(in_turn) << 8;
        frame.follow = follow;
        let airtime = timing::instant(pending.data.len());
        frame.payload = pending.data;
        self.send(frame, airtime, "im", After::Instant(pending.number));
    }

    pub(super) fn on_instant_sent(&mut self, number: u8, now: Duration) {
        let Some(pending) = self.instant.pending.as_ref().filter(|pending| pending.number == number) else { return };
        if pending.flag != Flag::Ack {
            self.instant.pending = None;
            self.instant.outcome = Some("EMPTY");
            return;
        }
        self.instant.attempt += 1;
        let travel = Duration::from_micros(u64::from(self.config.max_propagation_us)) * 2;
        let deadline = now + travel + timing::ACK + Duration::from_millis(200) + self.turn_allowance();
        self.board.plan(deadline, Event::InstantTimeout { attempt: self.instant.attempt });
    }

    pub(super) fn on_instant_timeout(&mut self, attempt: u32, now: Duration) {
        if attempt != self.instant.attempt {
            return;
        }
        match &mut self.instant.pending {
            // 255 retries are for ever.
            Some(pending) if pending.retries_left > 0 => {
                pending.retries_left -= u32::from(pending.retries_left != 255);
                self.try_instant(now);
            }
            Some(pending) => {
                let dst = pending.dst;
                self.finish_instant("FAILED");
                self.notify(format!("FAILEDIM,{dst}"), now);
            }
            None => {}
        }
    }

    /// The peer's acknowledgement; true if it was waited for.
    pub(super) fn on_instant_ack(&mut self, src: u8, number: u8, now: Duration) -> bool {
        let awaited = |pending: &Pending| pending.number == number && pending.dst == src && pending.flag == Flag::Ack;
        if !self.instant.pending.as_ref().is_some_and(awaited) {
            return false;
        }
        self.finish_instant("DELIVERED");
        self.notify(format!("DELIVEREDIM,{src}"), now);
        true
    }

    /// Frees the slot; timers of the message it held mean nothing any more.
    fn finish_instant(&mut self, outcome: &'static str) {
        self.instant.pending = None;
        self.instant.waits_for_turn = false;
        self.instant.outcome = Some(outcome);
        self.instant.attempt += 1;
    }

    /// `ATZ3`, `ATZ4`: forgets messages that are not yet delivered.
    pub(super) fn cancel_messages(&mut self, now: Duration) {
        if let Some(pending) = self.instant.pending.clone() {
            self.finish_instant("EMPTY");
            self.air.queue.retain(|out| out.frame.kind != Kind::Instant);
            self.notify(format!("CANCELEDIM,{}", pending.dst), now);
        }
        if let Some(waiting) = self.synchronous.take() {
            self.notify(format!("CANCELEDIMS,{}", waiting.dst), now);
        }
        if let Some(waiting) = self.piggyback.take() {
            self.notify(format!("CANCELEDPBM,{}", waiting.dst), now);
        }
    }

    pub(super) fn send_piggyback(&mut self, command: SendCommand, now: Duration) -> &'static str {
        if !self.may_address(command.dst, false) {
            return "ERROR WRONG DESTINATION ADDRESS";
        }
        let pid = command.pid.unwrap_or_else(|| self.settings.byte("ZS"));
        let new = Piggyback { dst: command.dst, pid, data: command.data };
        if let Some(old) = self.piggyback.replace(new) {
            self.board.plan(now, Event::Notify(format!("CANCELEDPBM,{}", old.dst)));
        }
        "OK"
    }

    pub(super) fn send_synchronous(&mut self, command: SendCommand, time: Option<u32>, now: Duration) -> &'static str {
        if !self.may_address(command.dst, true) {
            return "ERROR WRONG DESTINATION ADDRESS";
        }
        if self.in_backoff(command.dst, now) {
            return "BUSY BACKOFF STATE";
        }
        let pid = command.pid.unwrap_or_else(|| self.settings.byte("ZS"));
        let new = Synchronous { dst: command.dst, pid, data: command.data };
        if let Some(old) = self.synchronous.replace(new) {
            self.board.plan(now, Event::Notify(format!("CANCELEDIMS,{}", old.dst)));
        }
        self.synchronous_number += 1;
        // Half of the clock's range ahead is the future, the other half the past.
        let wait = time.map_or(0, |time| time.wrapping_sub(self.clock_us(now)));
        let number = self.synchronous_number;
        let late = wait > u32::MAX / 2;
        let at = if late { now } else { now + Duration::from_micros(u64::from(wait)) };
        self.board.plan(at, Event::Synchronous { number, late });
        "OK"
    }

    pub(super) fn on_synchronous(&mut self, number: u64, late: bool, now: Duration) {
        if number != self.synchronous_number {
            return;
        }
        let Some(message) = self.synchronous.take() else { return };
        if late || now < self.air.busy_until {
            self.notify(format!("EXPIREDIMS,{}", message.dst), now);
            return;
        }
        let mut frame = self.frame(Kind::Synchronous, message.dst);
        frame.pid = message.pid;
        frame.seq = self.clock_us(now);
        let airtime = timing::instant(message.data.len());
        frame.payload = message.data;
        self.air.queue.push_front(super::air::Outgoing { frame, airtime, label: "ims", then: After::Nothing });
    }

    /// Whether a message may be sent to `dst`: a node of the network, not this one; everybody only where allowed.
    pub(super) fn may_address(&self, dst: u8, broadcast_allowed: bool) -> bool {
        let node = (1..=self.settings.byte("AM")).contains(&dst) && dst != self.address();
        node || (dst == 255 && broadcast_allowed)
    }
}
