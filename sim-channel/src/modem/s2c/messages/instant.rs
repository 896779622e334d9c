//! Instant messages: one at a time, acknowledged and repeated if the host wants.

use super::{BACKOFF, WRONG_ADDRESS};
use crate::modem::s2c::base::{AfterSending, FrameKind, S2cBase, S2cTask, timing};
use crate::modem::s2c::input::{InstantFlag, SendCommand};
use std::time::Duration;

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
