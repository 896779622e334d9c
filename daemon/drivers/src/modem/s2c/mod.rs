//! EvoLogics S2C: bulk as bursts, commands as instant messages, acknowledgements with what the modem sends anyway.
//!
//! The NET interpreter is preferred; a port of the AT interpreter is found out and spoken to by `+++AT`. Records of a burst
//! are pieces of a framed stream ([`super::framing`]), so both interpreters understand each other and no payload holds a
//! command.

mod config;
mod jobs;
mod line;
mod notice;
mod receive;
mod send;
mod setup;

pub use config::{BURST_FRAME_BYTES, INSTANT_BYTES, S2cConfig, S2cMode, instant_airtime};
pub use line::{Line, LineParser};

use super::driver::{Class, Destination, Driver, Event, Refusal, Token, check_length};
use super::framing::Deframer;
use jobs::{Job, Jobs};
use scenecast_core::ModemAddress;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::time::Instant;
use setup::{Step, Verdict};
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

/// Quiet before the modem is spoken to: half a line may be under way.
const SETTLE: Duration = Duration::from_millis(300);
/// Longest wait for a reply, beside what the line takes.
const PATIENCE: Duration = Duration::from_secs(2);
/// Longest wait however much else the modem has to say: the reply may have been lost on the line.
const LONGEST_WAIT: Duration = Duration::from_secs(9);
/// From `ATO` to data.
const DATA_MODE: Duration = Duration::from_millis(1500);
/// Between two questions to a modem at work.
const BEAT: Duration = Duration::from_secs(2);
/// After a wrong address, or a setting that was not taken.
const AFTER_REFUSAL: Duration = Duration::from_secs(10);
/// Silence after which the port is opened anew.
const DEAF: Duration = Duration::from_secs(15);
/// No command has more bytes to count.
const LONGEST_RECORD: usize = 1030;
/// Address of everybody.
const EVERYBODY: ModemAddress = 255;

/// Where the driver stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The port is not open.
    Closed,
    /// Waits for quiet on the line.
    Settling(Instant),
    /// Asks which interpreter there is.
    Discovering,
    /// Works through the start-up.
    SettingUp(usize),
    /// At work.
    Ready,
}

/// What a reply is waited for.
#[derive(Debug, Clone)]
enum Asked {
    /// `+++AT?MODE`, which not every port understands.
    Interpreter,
    /// `AT?MODE`
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

/// A driver for an S2C modem.
#[derive(Debug)]
pub struct S2c {
    config: S2cConfig,
    phase: Phase,
    parser: LineParser,
    /// Whether commands go as `+++AT`.
    ties: bool,
    asked: Option<(Asked, Instant)>,
    asked_at: Instant,
    output: VecDeque<Vec<u8>>,
    events: VecDeque<Event>,
    tokens: Token,
    jobs: Jobs,
    /// Neither messages nor records are tried before.
    message_pause: Instant,
    record_pause: Instant,
    beat_at: Instant,
    beats: usize,
    /// The packet counter, once it was read.
    counter: Option<u32>,
    /// When anything sensible was last heard of the modem.
    heard: Instant,
    opened: Instant,
    streams: BTreeMap<ModemAddress, Deframer>,
    /// When burst data of a modem was last heard: it will want an acknowledgement soon.
    burst_heard: BTreeMap<ModemAddress, Instant>,
    /// Bits of bursts that were given and that were on air.
    given_bits: u64,
    aired_bits: u64,
    local_rate: u32,
    /// Questions in a row without an answer.
    silences: u32,
    /// Whether it ever was at work.
    was_ready: bool,
    /// The step of the start-up that failed last.
    failed: Option<Step>,
    refusal: Option<String>,
}

impl S2c {
    /// A driver whose port is not open yet.
    pub fn new(config: S2cConfig) -> Self {
        Self {
            config,
            phase: Phase::Closed,
            parser: LineParser::default(),
            ties: false,
            asked: None,
            asked_at: Instant::ZERO,
            output: VecDeque::new(),
            events: VecDeque::new(),
            tokens: 0,
            jobs: Jobs::default(),
            message_pause: Instant::ZERO,
            record_pause: Instant::ZERO,
            beat_at: Instant::ZERO,
            beats: 0,
            counter: None,
            heard: Instant::ZERO,
            opened: Instant::ZERO,
            streams: BTreeMap::new(),
            burst_heard: BTreeMap::new(),
            given_bits: 0,
            aired_bits: 0,
            local_rate: 0,
            silences: 0,
            was_ready: false,
            failed: None,
            refusal: None,
        }
    }

    /// What the modem held is gone, or nobody knows: from the beginning, after `pause`.
    fn start_over(&mut self, pause: Duration, now: Instant) {
        let tokens = self.jobs.clear();
        let asked = self.asked.take().and_then(|(asked, _)| asked.token());
        self.events.extend(tokens.into_iter().chain(asked).map(Event::Unknown));
        if self.phase == Phase::Ready {
            self.events.push_back(Event::Reset);
        }
        self.output.clear();
        self.parser.clear();
        self.streams.clear();
        self.counter = None;
        self.phase = Phase::Settling(now + pause);
    }

    /// Tells a person, once for each thing.
    fn refuse(&mut self, what: String) {
        if self.refusal.as_ref() != Some(&what) {
            self.refusal = Some(what.clone());
            self.events.push_back(Event::Refused(what));
        }
    }

    fn end_of_line(&self) -> &'static [u8] {
        if self.config.ethernet { b"\n" } else { b"\r" }
    }

    /// Writes a command and waits for its reply.
    fn ask(&mut self, command: &[u8], asked: Asked, now: Instant) {
        let prefix: &[u8] = if self.ties { b"+++AT" } else { b"AT" };
        let bytes = [prefix, command, self.end_of_line()].concat();
        let deadline = now + PATIENCE + self.config.line_time(bytes.len());
        (self.asked, self.asked_at) = (Some((asked, deadline)), now);
        self.output.push_back(bytes);
    }

    /// Asks what is next, if the modem is not busy with a question.
    fn proceed(&mut self, now: Instant) {
        if self.asked.is_some() {
            return;
        }
        match self.phase {
            Phase::Closed => {}
            Phase::Settling(until) if now < until => {}
            Phase::Settling(_) => {
                self.phase = Phase::Discovering;
                self.parser.clear();
                self.ties = true;
                self.parser.set_ties(true);
                if self.silences > 1 {
                    // It may still count the bytes of a record that was cut off on its way.
                    self.output.push_back(self.end_of_line().repeat(LONGEST_RECORD));
                }
                self.ask(b"?MODE", Asked::Interpreter, now);
            }
            Phase::Discovering => {}
            Phase::SettingUp(index) => match setup::start_up(&self.config, !self.was_ready).into_iter().nth(index) {
                Some(step) => self.ask(step.command.clone().as_bytes(), Asked::Setup(step), now),
                None => {
                    (self.phase, self.was_ready) = (Phase::Ready, true);
                    (self.refusal, self.failed, self.silences) = (None, None, 0);
                    (self.message_pause, self.record_pause, self.beat_at) = (now, now, now + BEAT);
                    self.events.push_back(Event::Ready);
                    self.proceed_at_work(now);
                }
            },
            Phase::Ready => self.proceed_at_work(now),
        }
    }

    fn proceed_at_work(&mut self, now: Instant) {
        if self.send_next(now) || now < self.beat_at {
            return;
        }
        self.beat_at = now + BEAT;
        self.beats += 1;
        let step = setup::beat(&self.config, self.beats);
        self.ask(step.command.clone().as_bytes(), Asked::Beat(step), now);
    }

    /// The reply to a step of the start-up, or to a question at work.
    fn handle_step(&mut self, step: &Step, reply: &str, now: Instant) {
        match step.judge(reply, &self.config) {
            Verdict::Good => {}
            // Less than it was: the modem has restarted, and what it held is gone.
            Verdict::Counter(count) if self.phase == Phase::Ready && self.counter.is_some_and(|c| count != c) => {
                return self.start_over(SETTLE, now);
            }
            Verdict::Counter(count) => self.counter = Some(count),
            Verdict::WrongAddress(found) => {
                let ours = self.config.address;
                self.refuse(format!(
                    "the modem's address is {found} and ours is {ours}: set one of them \
                     (vehicle.address, modem.surface_address, or AT!AL{ours} and AT&W at the modem)"
                ));
                return self.start_over(AFTER_REFUSAL, now);
            }
            Verdict::Bad if self.phase == Phase::Ready => return self.start_over(SETTLE, now),
            Verdict::Bad => {
                // Once may be the answer to something else.
                if self.failed.replace(step.clone()).as_ref() == Some(step) {
                    self.refuse(format!("the modem answers AT{} with {reply:?}", step.command));
                }
                return self.start_over(PATIENCE, now);
            }
        }
        if let Phase::SettingUp(index) = self.phase {
            self.phase = Phase::SettingUp(index + 1);
        }
    }

    /// What is there: NET, AT in command mode, AT in data mode.
    fn handle_interpreter(&mut self, asked: &Asked, reply: &str, now: Instant) {
        match (asked, reply) {
            (Asked::Interpreter, "AT") => self.phase = Phase::SettingUp(0),
            // The line end, or the escape, was not understood: there is no data mode now.
            (Asked::Interpreter, _) => {
                self.ties = false;
                self.parser.set_ties(false);
                self.ask(b"?MODE", Asked::Mode, now);
            }
            (_, "NET") => self.phase = Phase::SettingUp(0),
            (_, "AT") => {
                // Command mode hides burst data: to data mode, which nothing answers.
                self.output.push_back([b"ATO", self.end_of_line()].concat());
                self.phase = Phase::Settling(now + DATA_MODE);
            }
            // A reply to something else.
            _ => self.asked = Some((Asked::Mode, now + PATIENCE)),
        }
    }
}

impl Driver for S2c {
    fn profile(&self) -> ModemProfile {
        let turn_around = Duration::from_millis(150) + self.config.line_time(2 * INSTANT_BYTES + 60);
        match self.config.mode {
            S2cMode::Instant => ModemProfile {
                frame_bytes: INSTANT_BYTES,
                bit_rate_bps: config::INSTANT_BPS,
                overhead_bits: config::INSTANT_OVERHEAD_BITS,
                turn_around,
                access: Access::Shared,
            },
            S2cMode::Burst => ModemProfile {
                frame_bytes: BURST_FRAME_BYTES,
                bit_rate_bps: self.config.burst_bps,
                overhead_bits: config::BURST_OVERHEAD_BITS,
                turn_around,
                access: Access::ModemOwned { pool_frames: self.config.pool_frames },
            },
        }
    }

    fn is_ready(&self) -> bool {
        self.phase == Phase::Ready
    }

    fn send(&mut self, dst: Destination, bytes: Vec<u8>, class: Class, now: Instant) -> Result<Token, Refusal> {
        let most = match (self.config.mode, dst) {
            (S2cMode::Burst, Destination::Modem(_)) => BURST_FRAME_BYTES,
            _ => INSTANT_BYTES,
        };
        check_length(bytes.len(), most)?;
        let highest = self.config.highest_address;
        let address = match dst {
            Destination::Everybody => EVERYBODY,
            Destination::Modem(a) if a == self.config.address => {
                return Err(Refusal::NoSuchAddress(dst, "it is the modem's own"));
            }
            Destination::Modem(a) if a == 0 || a > highest => {
                return Err(Refusal::NoSuchAddress(dst, "it is above the network's highest address"));
            }
            Destination::Modem(a) => a,
        };
        if self.phase != Phase::Ready {
            return Err(Refusal::NotReady);
        }
        self.tokens += 1;
        let job = Job { token: self.tokens, dst: address, bytes, class, tries: 0, refused: None };
        match class {
            Class::Command => self.jobs.commands.push_back(job),
            Class::Service => {
                for old in std::mem::take(&mut self.jobs.services) {
                    self.events.push_back(Event::Failed(old.token));
                }
                self.jobs.services.push_back(job);
            }
            Class::Bulk => self.jobs.bulk.push_back(job),
        }
        self.proceed(now);
        Ok(self.tokens)
    }

    fn handle_open(&mut self, now: Instant) {
        (self.opened, self.heard) = (now, now);
        self.start_over(SETTLE, now);
    }

    fn handle_closed(&mut self, now: Instant) {
        self.start_over(SETTLE, now);
        self.phase = Phase::Closed;
    }

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant) {
        if self.phase == Phase::Closed {
            return;
        }
        self.parser.push(bytes);
        while let Some(line) = self.parser.next_line() {
            self.handle_line(line, now);
        }
        self.proceed(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.asked.as_ref().is_some_and(|(_, deadline)| *deadline <= now) {
            // Half a line may hide the reply, or the modem restarts: quiet first.
            self.silences += 1;
            self.start_over(SETTLE, now);
        }
        self.give_up_late(now);
        self.proceed(now);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = match (&self.asked, self.phase) {
            (_, Phase::Closed) => return None,
            (Some((_, deadline)), _) => Some(*deadline),
            (None, Phase::Settling(until)) => Some(until),
            (None, _) => Some(self.beat_at),
        };
        let message = self.jobs.message.as_ref().map(|m| m.until);
        let pauses = self.next_try();
        [next, message, pauses].into_iter().flatten().min()
    }

    fn poll_output(&mut self, _now: Instant) -> Option<Vec<u8>> {
        self.output.pop_front()
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn wants_reopening(&self, now: Instant) -> bool {
        self.phase != Phase::Closed && now.since(self.heard.max(self.opened)) >= DEAF
    }
}
