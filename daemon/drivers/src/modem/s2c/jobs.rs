//! The queues in front of an S2C modem, and the transmissions in it.

use crate::modem::driver::{Class, Token};
use scenecast_core::ModemAddress;
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};

/// A transmission on its way into the modem.
#[derive(Debug, Clone)]
pub(super) struct Job {
    pub token: Token,
    pub dst: ModemAddress,
    pub bytes: Vec<u8>,
    pub class: Class,
    /// Times that it was sent and not acknowledged.
    pub tries: u32,
    /// When the modem first refused it.
    pub refused: Option<Instant>,
}

/// The message that the modem is sending; it takes one at a time.
#[derive(Debug, Clone)]
pub(super) struct Message {
    pub job: Job,
    /// Whether the other modem acknowledges it.
    pub acked: bool,
    /// When it is given up.
    pub until: Instant,
}

/// Queued transmissions, and those in the modem.
#[derive(Debug, Default)]
pub(super) struct Jobs {
    pub commands: VecDeque<Job>,
    /// The newest acknowledgement, which replaces older ones.
    pub services: VecDeque<Job>,
    pub bulk: VecDeque<Job>,
    pub message: Option<Message>,
    /// Records in the modem's pool by packet counter, and since when.
    pub pool: BTreeMap<u32, (Token, Instant)>,
    /// No message is tried before this time.
    pub message_pause: Instant,
    /// No record is tried before this time.
    pub record_pause: Instant,
}

impl Jobs {
    pub(super) fn resume(&mut self, now: Instant) {
        (self.message_pause, self.record_pause) = (now, now);
    }

    /// Whether the modem holds no bulk.
    pub(super) fn is_pool_empty(&self) -> bool {
        self.pool.is_empty()
    }

    /// Forgets everything; returns the tokens.
    pub(super) fn clear(&mut self) -> Vec<Token> {
        let waiting = self.commands.drain(..).chain(self.services.drain(..)).chain(self.bulk.drain(..));
        let mut tokens: Vec<Token> = waiting.map(|job| job.token).collect();
        tokens.extend(self.message.take().map(|m| m.job.token));
        tokens.extend(std::mem::take(&mut self.pool).into_values().map(|(token, _)| token));
        tokens
    }

    /// Puts a job back to the front of its queue.
    pub(super) fn put_back(&mut self, job: Job) {
        match job.class {
            Class::Command => self.commands.push_front(job),
            Class::Service => self.services.push_front(job),
            Class::Bulk => self.bulk.push_front(job),
        }
    }
}
