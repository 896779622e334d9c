//! The way to an S2C modem: the queues in front of it and the transmissions in it; its command line with one command at a time,
//! its reply, and the lines in between.

use super::line::{Line, LineParser};
use super::setup::{S2cConfig, Step};
use super::{MAX_REPLY_WAIT, QUIET, REPLY_TIMEOUT};
use crate::modem::driver::{Class, Token};
use scenecast_core::ModemAddress;
use scenecast_protocol::time::Instant;
use std::collections::{BTreeMap, VecDeque};

/// A modem counts at most this many bytes of a record that was cut off.
const MAX_RECORD_BYTES: usize = 1030;

/// A command whose reply is outstanding.
#[derive(Debug, Clone)]
pub(super) enum Pending {
    /// `+++AT?MODE`, which not every port understands.
    Interpreter,
    Mode,
    Setup(Step),
    Beat(Step),
    Message(Job, bool),
    Piggyback(Job),
    /// A copy of the command that goes as a message next.
    Copy(Job),
    Record(Job),
    /// The packet counter of the record just taken.
    Count(Token),
}

impl Pending {
    /// The transmission that it is about.
    pub(super) fn token(&self) -> Option<Token> {
        match self {
            Self::Message(job, _) | Self::Piggyback(job) | Self::Copy(job) | Self::Record(job) => Some(job.token),
            Self::Count(token) => Some(*token),
            Self::Interpreter | Self::Mode | Self::Setup(_) | Self::Beat(_) => None,
        }
    }

    /// Whether a reply that repeats this command's name is the outstanding one.
    pub(super) fn is_answered_by(&self, name: &str) -> bool {
        match self {
            Self::Interpreter | Self::Mode => name == "?MODE",
            Self::Setup(step) | Self::Beat(step) => {
                let plain = step.command.trim_end_matches(|c: char| c.is_ascii_digit());
                name == plain || name == step.command
            }
            Self::Message(..) => name == "*SENDIM",
            Self::Piggyback(_) | Self::Copy(_) => name == "*SENDPBM",
            Self::Record(_) => name == "*SEND",
            Self::Count(_) => name == "?PC",
        }
    }
}

/// The exchange of lines with the modem.
#[derive(Debug, Default)]
pub(super) struct Dialogue {
    parser: LineParser,
    /// Whether commands are sent as `+++AT`.
    is_escaped: bool,
    /// The outstanding command and its deadline.
    pending: Option<(Pending, Instant)>,
    sent_at: Instant,
    output: VecDeque<Vec<u8>>,
    /// Commands in a row without a reply.
    unanswered: u32,
}

fn end_of_line(config: &S2cConfig) -> &'static [u8] {
    if config.ethernet { b"\n" } else { b"\r" }
}

impl Dialogue {
    /// Whether no reply is outstanding.
    pub(super) fn is_idle(&self) -> bool {
        self.pending.is_none()
    }

    /// Writes a command and waits for its reply.
    pub(super) fn request(&mut self, command: &[u8], pending: Pending, config: &S2cConfig, now: Instant) {
        let prefix: &[u8] = if self.is_escaped { b"+++AT" } else { b"AT" };
        let bytes = [prefix, command, end_of_line(config)].concat();
        let deadline = now + REPLY_TIMEOUT + config.line_time(bytes.len());
        (self.pending, self.sent_at) = (Some((pending, deadline)), now);
        self.output.push_back(bytes);
    }

    /// Queries the interpreter. After two silent attempts the line is filled first: the modem may still count the bytes of
    /// a record that was cut off.
    pub(super) fn discover(&mut self, config: &S2cConfig, now: Instant) {
        self.parser.clear();
        self.set_escaped(true);
        if self.unanswered > 1 {
            self.output.push_back(end_of_line(config).repeat(MAX_RECORD_BYTES));
        }
        self.request(b"?MODE", Pending::Interpreter, config, now);
    }

    pub(super) fn set_escaped(&mut self, is_escaped: bool) {
        self.is_escaped = is_escaped;
        self.parser.set_ties(is_escaped);
    }

    /// Leaves the command mode of the AT interpreter, which sends no reply.
    pub(super) fn enter_data_mode(&mut self, config: &S2cConfig) {
        self.output.push_back([b"ATO", end_of_line(config)].concat());
    }

    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.parser.push(bytes);
    }

    pub(super) fn next_line(&mut self) -> Option<Line> {
        self.parser.next_line()
    }

    /// The outstanding command that a reply belongs to; a reply that came too late belongs to none.
    pub(super) fn take_answered_by(&mut self, name: Option<&str>) -> Option<Pending> {
        self.pending.take_if(|(pending, _)| name.is_none_or(|name| pending.is_answered_by(name))).map(|(p, _)| p)
    }

    /// Waits for the reply to `pending` from now on.
    pub(super) fn await_again(&mut self, pending: Pending, now: Instant) {
        self.pending = Some((pending, now + REPLY_TIMEOUT));
    }

    /// Bytes came in: a reply waits behind the modem's notices, which may take seconds on a slow line.
    pub(super) fn extend(&mut self, now: Instant) {
        let latest = self.sent_at + MAX_REPLY_WAIT;
        if let Some((_, deadline)) = &mut self.pending {
            *deadline = (*deadline).max((now + QUIET).min(latest));
        }
    }

    pub(super) fn deadline(&self) -> Option<Instant> {
        self.pending.as_ref().map(|(_, deadline)| *deadline)
    }

    /// Counts a command that was never answered.
    pub(super) fn count_silence(&mut self) {
        self.unanswered += 1;
    }

    pub(super) fn forget_silences(&mut self) {
        self.unanswered = 0;
    }

    /// Forgets lines and commands; returns the transmission of the outstanding one.
    pub(super) fn clear(&mut self) -> Option<Token> {
        self.output.clear();
        self.parser.clear();
        self.pending.take().and_then(|(pending, _)| pending.token())
    }

    pub(super) fn poll_output(&mut self) -> Option<Vec<u8>> {
        self.output.pop_front()
    }
}

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
