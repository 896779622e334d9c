//! A synchronous message leaves at a time of the modem's clock, or expires.

use super::{BACKOFF, WRONG_ADDRESS, WaitingMessage};
use crate::modem::s2c::base::{AfterSending, FrameKind, QueuedFrame, S2cBase, S2cTask, timing};
use crate::modem::s2c::input::SendCommand;
use std::time::Duration;

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
