//! EvoLogics S2C: bulk as bursts, commands as instant messages, acknowledgements as piggybacks.
//!
//! The NET interpreter is preferred. The driver detects a port of the AT interpreter and sends commands to it with
//! `+++AT`. Burst records are pieces of a framed stream ([`super::framing`]), so modems with different interpreters can
//! communicate, and no payload contains a command.

mod dialogue;
mod line;
mod notice;
mod receive;
mod send;
mod setup;

pub use line::{Line, LineParser};
pub use setup::{BURST_FRAME_BYTES, INSTANT_BYTES, S2cConfig, S2cMode, instant_airtime};

use super::driver::{Class, Destination, Driver, Event, Refusal, Token, check_length};
use dialogue::{Dialogue, Job, Jobs, Pending};
use receive::{BurstAirtime, BurstStreams};
use scenecast_core::ModemAddress;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::time::Instant;
use setup::{Step, Supervision, Verdict};
use std::collections::VecDeque;
use std::time::Duration;

/// Quiet before the modem is spoken to: half a line may be under way.
const SETTLE: Duration = Duration::from_millis(300);
/// Longest wait for a reply, beyond the transfer time of the line; modems take a tenth of it.
const REPLY_TIMEOUT: Duration = Duration::from_secs(1);
/// A line that has been idle for this long brings no reply any more.
const QUIET: Duration = Duration::from_millis(500);
/// Longest wait for a reply while notices arrive: the reply may have been lost on the line.
const MAX_REPLY_WAIT: Duration = Duration::from_secs(9);
const DATA_MODE: Duration = Duration::from_millis(1500);
/// After a wrong address, or a setting that was not taken.
const AFTER_REFUSAL: Duration = Duration::from_secs(10);
const EVERYBODY: ModemAddress = 255;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// The port is not open.
    Closed,
    /// Waits for quiet on the line.
    Settling(Instant),
    /// Asks which interpreter there is.
    Discovering,
    SettingUp(usize),
    Ready,
}

/// A driver for an S2C modem.
#[derive(Debug)]
pub struct S2c {
    config: S2cConfig,
    phase: Phase,
    dialogue: Dialogue,
    supervision: Supervision,
    jobs: Jobs,
    streams: BurstStreams,
    airtime: BurstAirtime,
    events: VecDeque<Event>,
    tokens: Token,
}

impl S2c {
    /// A driver whose port is not open yet.
    pub fn new(config: S2cConfig) -> Self {
        Self {
            config,
            phase: Phase::Closed,
            dialogue: Dialogue::default(),
            supervision: Supervision::default(),
            jobs: Jobs::default(),
            streams: BurstStreams::default(),
            airtime: BurstAirtime::default(),
            events: VecDeque::new(),
            tokens: 0,
        }
    }

    /// Starts over after `pause`: the modem's contents are lost or unknown.
    fn start_over(&mut self, pause: Duration, now: Instant) {
        let tokens = self.jobs.clear();
        let pending = self.dialogue.clear();
        self.events.extend(tokens.into_iter().chain(pending).map(Event::Unknown));
        if self.phase == Phase::Ready {
            self.events.push_back(Event::Reset);
        }
        self.streams.clear();
        self.supervision.set_counter(None);
        self.phase = Phase::Settling(now + pause);
    }

    /// Reports a fault to a person, once for each text.
    fn refuse(&mut self, what: String) {
        self.events.extend(self.supervision.refuse(what).map(Event::Refused));
    }

    fn request(&mut self, command: &[u8], pending: Pending, now: Instant) {
        self.dialogue.request(command, pending, &self.config, now);
    }

    /// Sends the next command, unless a reply is outstanding.
    fn proceed(&mut self, now: Instant) {
        if !self.dialogue.is_idle() {
            return;
        }
        match self.phase {
            Phase::Closed => {}
            Phase::Settling(until) if now < until => {}
            Phase::Settling(_) => {
                self.phase = Phase::Discovering;
                self.dialogue.discover(&self.config, now);
            }
            Phase::Discovering => {}
            Phase::SettingUp(index) => match self.supervision.start_up(&self.config, index) {
                Some(step) => self.request(step.command.clone().as_bytes(), Pending::Setup(step), now),
                None => {
                    self.phase = Phase::Ready;
                    self.supervision.set_ready(now);
                    self.dialogue.forget_silences();
                    self.jobs.resume(now);
                    self.events.push_back(Event::Ready);
                    self.proceed_at_work(now);
                }
            },
            Phase::Ready => self.proceed_at_work(now),
        }
    }

    fn proceed_at_work(&mut self, now: Instant) {
        if self.send_next(now) {
            return;
        }
        if let Some(step) = self.supervision.next_beat(&self.config, now) {
            self.request(step.command.clone().as_bytes(), Pending::Beat(step), now);
        }
    }

    /// The reply to a step of the start-up, or to a question at work.
    fn handle_step(&mut self, step: &Step, reply: &str, now: Instant) {
        match step.judge(reply, &self.config) {
            Verdict::Good => {}
            // Less than it was: the modem has restarted, and what it held is gone.
            Verdict::Counter(count)
                if self.phase == Phase::Ready && self.supervision.counter().is_some_and(|c| count != c) =>
            {
                return self.start_over(SETTLE, now);
            }
            Verdict::Counter(count) => self.supervision.set_counter(Some(count)),
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
                if self.supervision.fails_again(step) {
                    self.refuse(format!("the modem answers AT{} with {reply:?}", step.command));
                }
                return self.start_over(REPLY_TIMEOUT, now);
            }
        }
        if let Phase::SettingUp(index) = self.phase {
            self.phase = Phase::SettingUp(index + 1);
        }
    }

    /// Handles the reply that names the interpreter: NET, AT in command mode, AT in data mode.
    fn handle_interpreter(&mut self, pending: &Pending, reply: &str, now: Instant) {
        match (pending, reply) {
            (Pending::Interpreter, "AT") => self.phase = Phase::SettingUp(0),
            // The line end, or the escape, was not understood: there is no data mode now.
            (Pending::Interpreter, _) => {
                self.dialogue.set_escaped(false);
                self.request(b"?MODE", Pending::Mode, now);
            }
            (_, "NET") => self.phase = Phase::SettingUp(0),
            (_, "AT") => {
                // Command mode hides burst data: to data mode, which nothing answers.
                self.dialogue.enter_data_mode(&self.config);
                self.phase = Phase::Settling(now + DATA_MODE);
            }
            // A reply to something else.
            _ => self.dialogue.await_again(Pending::Mode, now),
        }
    }
}

impl Driver for S2c {
    fn profile(&self) -> ModemProfile {
        let turn_around = Duration::from_millis(150) + self.config.line_time(2 * INSTANT_BYTES + 60);
        match self.config.mode {
            S2cMode::Instant => ModemProfile {
                frame_bytes: INSTANT_BYTES,
                bit_rate_bps: setup::INSTANT_BPS,
                overhead_bits: setup::INSTANT_OVERHEAD_BITS,
                turn_around,
                access: Access::Shared,
            },
            S2cMode::Burst => ModemProfile {
                frame_bytes: BURST_FRAME_BYTES,
                bit_rate_bps: self.config.burst_bps,
                overhead_bits: setup::BURST_OVERHEAD_BITS,
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
        self.supervision.open(now);
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
        // A long line is under way for longer than an idle one is waited for.
        self.dialogue.extend(now);
        self.dialogue.push(bytes);
        while let Some(line) = self.dialogue.next_line() {
            self.handle_line(line, now);
        }
        self.proceed(now);
    }

    fn handle_timeout(&mut self, now: Instant) {
        if self.dialogue.deadline().is_some_and(|deadline| deadline <= now) {
            // Half a line may hide the reply, or the modem restarts: quiet first.
            self.dialogue.count_silence();
            self.start_over(SETTLE, now);
        }
        self.give_up_late(now);
        self.proceed(now);
    }

    fn poll_timeout(&self) -> Option<Instant> {
        let next = match (self.dialogue.deadline(), self.phase) {
            (_, Phase::Closed) => return None,
            (Some(deadline), _) => Some(deadline),
            (None, Phase::Settling(until)) => Some(until),
            (None, _) => Some(self.supervision.beat_at()),
        };
        let message = self.jobs.message.as_ref().map(|m| m.until);
        let pauses = self.next_try();
        [next, message, pauses].into_iter().flatten().min()
    }

    fn poll_output(&mut self, _now: Instant) -> Option<Vec<u8>> {
        self.dialogue.poll_output()
    }

    fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn wants_reopening(&self, now: Instant) -> bool {
        self.phase != Phase::Closed && self.supervision.is_deaf(now)
    }
}
