//! Short messages: instant, synchronous and piggyback, one slot each.
//!
//! A slot holds one message and knows no connection. The burst service offers its turns to the instant message and lets
//! its frames carry the piggyback message.

mod instant;
mod piggyback;
mod synchronous;

pub(crate) use instant::InstantSlot;
pub(crate) use piggyback::PiggybackSlot;
pub(crate) use synchronous::SynchronousSlot;

use super::base::S2cBase;
use super::input::SendCommand;
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
