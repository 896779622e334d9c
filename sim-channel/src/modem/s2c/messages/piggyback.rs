//! A piggyback message waits for a frame to its destination and travels with it.

use super::{WRONG_ADDRESS, WaitingMessage};
use crate::modem::s2c::base::{S2cBase, S2cFrame, S2cTask};
use crate::modem::s2c::input::SendCommand;
use std::time::Duration;

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
