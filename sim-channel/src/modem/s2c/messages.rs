//! Short messages: instant, synchronous and piggyback, one slot each.
//!
//! A slot holds one message and knows no connection. The burst service offers its turns to the instant message and lets
//! its frames carry the piggyback message.

use super::base::S2cBase;
use super::input::SendCommand;
use crate::modem::s2c::base::{AfterSending, FrameKind, QueuedFrame, S2cFrame, S2cTask, timing};
use crate::modem::s2c::input::InstantFlag;
use std::time::Duration;

const WRONG_ADDRESS: &str = "ERROR WRONG DESTINATION ADDRESS";
const BACKOFF: &str = "BUSY BACKOFF STATE";

#[derive(Debug, Default)]
pub(crate) struct Messages {
    pub instant: InstantSlot,
    pub synchronous: SynchronousSlot,
    pub piggyback: PiggybackSlot,
}

impl Messages {
    /// `ATZ3`, `ATZ4`: drops the messages that are not yet delivered.
    pub(crate) fn cancel(&mut self, base: &mut S2cBase, now: Duration) {
        self.instant.cancel(base, now);
        self.synchronous.cancel(base, now);
        self.piggyback.cancel(base, now);
    }

    /// The value behind `?` of a message slot.
    pub(crate) fn value(&self, key: &str) -> Option<String> {
        match key {
            "DI" => Some(self.instant.state().to_string()),
            "DP" => Some(self.piggyback.state().to_string()),
            _ => None,
        }
    }
}

/// A message that waits in a slot.
#[derive(Clone, Debug)]
struct WaitingMessage {
    dst: u8,
    pid: u8,
    data: Vec<u8>,
}

impl WaitingMessage {
    fn new(base: &S2cBase, command: SendCommand) -> Self {
        Self { dst: command.dst, pid: base.protocol_id(command.pid), data: command.data }
    }
}

/// `!RI` with this value repeats without limit.
const UNLIMITED_RETRIES: u32 = 255;

#[derive(Clone, Debug)]
struct PendingInstant {
    number: u8,
    dst: u8,
    flag: InstantFlag,
    pid: u8,
    data: Vec<u8>,
    retries_left: u32,
}

/// The slot, and the outcome of the last message in it, which `?DI` reads.
#[derive(Debug, Default)]
pub(crate) struct InstantSlot {
    pending: Option<PendingInstant>,
    last_number: u8,
    outcome: Option<&'static str>,
    /// Counts attempts, so that an old timer is not taken for the present one's.
    attempt: u32,
    /// Waits for the next turn of a connection to the same peer.
    waits_for_turn: bool,
}

impl InstantSlot {
    /// Takes a message of the host; returns the reply.
    pub(crate) fn submit(
        &mut self,
        base: &mut S2cBase,
        command: SendCommand,
        flag: InstantFlag,
        in_backoff: bool,
        now: Duration,
    ) -> &'static str {
        if !base.may_address(command.dst, flag != InstantFlag::Ack) {
            return WRONG_ADDRESS;
        }
        if self.pending.is_some() {
            return "BUSY DELIVERING MESSAGE";
        }
        if flag != InstantFlag::Force && in_backoff {
            return BACKOFF;
        }
        self.last_number = self.last_number.wrapping_add(1);
        self.outcome = None;
        self.pending = Some(PendingInstant {
            number: self.last_number,
            dst: command.dst,
            flag,
            pid: base.protocol_id(command.pid),
            data: command.data,
            retries_left: base.settings.get("RI"),
        });
        base.board.schedule(now, S2cTask::Instant);
        "OK"
    }

    /// Whether the pending message is sent without regard to any connection.
    pub(crate) fn is_forced(&self) -> bool {
        self.pending.as_ref().is_some_and(|pending| pending.flag == InstantFlag::Force)
    }

    pub(crate) fn wait_for_turn(&mut self) {
        self.waits_for_turn = true;
    }

    pub(crate) fn waits_for_turn(&self) -> bool {
        self.waits_for_turn
    }

    /// Whether the message waits for a turn of the connection to `peer`.
    pub(crate) fn waits_for_turn_to(&self, peer: u8) -> bool {
        self.waits_for_turn && self.pending.as_ref().is_some_and(|pending| pending.dst == peer)
    }

    /// Sends the pending message. If it opens a turn, an acknowledgement and `follow` packets come after it.
    pub(crate) fn transmit(&mut self, base: &mut S2cBase, opens_turn: bool, follow: u8) {
        self.waits_for_turn = false;
        let Some(pending) = &self.pending else { return };
        let mut frame = base.frame(FrameKind::Instant, pending.dst);
        frame.pid = pending.pid;
        frame.tag = InstantFlag::ALL.iter().position(|flag| *flag == pending.flag).unwrap_or_default() as u8;
        frame.seq = u32::from(pending.number) | u32::from(opens_turn) << 8;
        frame.follow = follow;
        frame.payload = pending.data.clone();
        base.send(frame, timing::instant(pending.data.len()), "im", AfterSending::Instant(pending.number));
    }

    /// The message has left.
    ///
    /// An acknowledgement may come later by `turn_allowance`, if the peer's turn of a connection comes first.
    pub(crate) fn on_sent(&mut self, base: &mut S2cBase, number: u8, turn_allowance: Duration, now: Duration) {
        let Some(pending) = self.pending.as_ref().filter(|pending| pending.number == number) else { return };
        if pending.flag != InstantFlag::Ack {
            self.pending = None;
            self.outcome = Some("EMPTY");
            return;
        }
        self.attempt += 1;
        let travel = Duration::from_micros(u64::from(base.config.max_propagation_us)) * 2;
        let deadline = now + travel + timing::ACK + Duration::from_millis(200) + turn_allowance;
        base.board.schedule(deadline, S2cTask::InstantTimeout { attempt: self.attempt });
    }

    /// No acknowledgement came in time; true if the message must be sent again.
    pub(crate) fn on_timeout(&mut self, base: &mut S2cBase, attempt: u32, now: Duration) -> bool {
        if attempt != self.attempt {
            return false;
        }
        let Some(pending) = &mut self.pending else { return false };
        if pending.retries_left > 0 {
            pending.retries_left -= u32::from(pending.retries_left != UNLIMITED_RETRIES);
            return true;
        }
        let dst = pending.dst;
        self.finish("FAILED");
        base.notify(format!("FAILEDIM,{dst}"), now);
        false
    }

    /// An acknowledgement has come; true if the pending message waited for it.
    pub(crate) fn on_ack(&mut self, base: &mut S2cBase, src: u8, number: u8, now: Duration) -> bool {
        let awaited = |pending: &PendingInstant| {
            pending.number == number && pending.dst == src && pending.flag == InstantFlag::Ack
        };
        if !self.pending.as_ref().is_some_and(awaited) {
            return false;
        }
        self.finish("DELIVERED");
        base.notify(format!("DELIVEREDIM,{src}"), now);
        true
    }

    pub(super) fn cancel(&mut self, base: &mut S2cBase, now: Duration) {
        if let Some(dst) = self.pending.as_ref().map(|pending| pending.dst) {
            self.finish("EMPTY");
            base.transmitter.discard(&[FrameKind::Instant]);
            base.notify(format!("CANCELEDIM,{dst}"), now);
        }
    }

    /// Frees the slot; timers of the message it held have no effect any more.
    fn finish(&mut self, outcome: &'static str) {
        self.pending = None;
        self.waits_for_turn = false;
        self.outcome = Some(outcome);
        self.attempt += 1;
    }

    pub(super) fn state(&self) -> &'static str {
        if self.pending.is_some() { "DELIVERING" } else { self.outcome.unwrap_or("EMPTY") }
    }
}

#[derive(Debug, Default)]
pub(crate) struct PiggybackSlot {
    waiting: Option<WaitingMessage>,
}

impl PiggybackSlot {
    /// Takes a message of the host, which replaces the one that waits; returns the reply.
    pub(crate) fn submit(&mut self, base: &mut S2cBase, command: SendCommand, now: Duration) -> &'static str {
        if !base.may_address(command.dst, false) {
            return WRONG_ADDRESS;
        }
        if let Some(old) = self.waiting.replace(WaitingMessage::new(base, command)) {
            base.board.schedule(now, S2cTask::Notify(format!("CANCELEDPBM,{}", old.dst)));
        }
        "OK"
    }

    /// The frame with the message in it, if one waits for its destination.
    pub(crate) fn attach(&mut self, mut frame: S2cFrame) -> S2cFrame {
        if let Some(waiting) = self.waiting.take_if(|waiting| waiting.dst == frame.dst) {
            frame.piggyback = Some((waiting.pid, waiting.data));
        }
        frame
    }

    pub(super) fn cancel(&mut self, base: &mut S2cBase, now: Duration) {
        if let Some(waiting) = self.waiting.take() {
            base.notify(format!("CANCELEDPBM,{}", waiting.dst), now);
        }
    }

    pub(super) fn state(&self) -> &'static str {
        if self.waiting.is_some() { "DELIVERING" } else { "EMPTY" }
    }
}

#[derive(Debug, Default)]
pub(crate) struct SynchronousSlot {
    waiting: Option<WaitingMessage>,
    /// Counts messages, so that the timer of a replaced one has no effect.
    number: u64,
}

impl SynchronousSlot {
    /// Takes a message of the host, which replaces the one that waits; returns the reply.
    ///
    /// `time` is in microseconds of the modem's clock, `None` for as soon as possible.
    pub(crate) fn submit(
        &mut self,
        base: &mut S2cBase,
        command: SendCommand,
        time: Option<u32>,
        in_backoff: bool,
        now: Duration,
    ) -> &'static str {
        if !base.may_address(command.dst, true) {
            return WRONG_ADDRESS;
        }
        if in_backoff {
            return BACKOFF;
        }
        if let Some(old) = self.waiting.replace(WaitingMessage::new(base, command)) {
            base.board.schedule(now, S2cTask::Notify(format!("CANCELEDIMS,{}", old.dst)));
        }
        self.number += 1;
        // Half of the clock's range ahead is the future, the other half the past.
        let wait = time.map_or(0, |time| time.wrapping_sub(base.clock_us(now)));
        let late = wait > u32::MAX / 2;
        let at = if late { now } else { now + Duration::from_micros(u64::from(wait)) };
        base.board.schedule(at, S2cTask::Synchronous { number: self.number, late });
        "OK"
    }

    /// The time of message `number` has come.
    pub(crate) fn on_time(&mut self, base: &mut S2cBase, number: u64, late: bool, now: Duration) {
        if number != self.number {
            return;
        }
        let Some(message) = self.waiting.take() else { return };
        if late || base.transmitter.is_busy(now) {
            base.notify(format!("EXPIREDIMS,{}", message.dst), now);
            return;
        }
        let mut frame = base.frame(FrameKind::Synchronous, message.dst);
        frame.pid = message.pid;
        frame.seq = base.clock_us(now);
        let airtime = timing::instant(message.data.len());
        frame.payload = message.data;
        base.transmitter.push_first(QueuedFrame { frame, airtime, label: "ims", then: AfterSending::Done });
    }

    pub(super) fn cancel(&mut self, base: &mut S2cBase, now: Duration) {
        if let Some(waiting) = self.waiting.take() {
            base.notify(format!("CANCELEDIMS,{}", waiting.dst), now);
        }
    }
}
