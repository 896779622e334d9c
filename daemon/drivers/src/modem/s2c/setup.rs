//! The configuration of an S2C modem: commands at the start, and checks that the modem still has it.

use super::setup::{self};
pub use scenecast_config::S2cMode;
use scenecast_core::ModemAddress;
pub use scenecast_core::{S2C_BURST_FRAME_BYTES as BURST_FRAME_BYTES, S2C_INSTANT_BYTES as INSTANT_BYTES};
use scenecast_protocol::time::Instant;
use std::time::Duration;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Expect {
    Ok,
    /// That, or an error: older firmware does not know it.
    Tolerated,
    /// A number, now or once the connection is over.
    Value(u32),
    /// The address that we were given.
    Address,
    Counter,
}

/// A command with its expected reply.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Step {
    pub command: String,
    pub expect: Expect,
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Verdict {
    Good,
    Counter(u32),
    /// The modem has another address.
    WrongAddress(String),
    /// The setting was refused or has been lost.
    Bad,
}

fn step(command: impl Into<String>, expect: Expect) -> Step {
    Step { command: command.into(), expect }
}

/// The start-up sequence; the `first` time, data in the modem belongs to another run.
pub(super) fn start_up(config: &S2cConfig, wait_ms: u32, first: bool) -> Vec<Step> {
    // Later it is still good, and throwing it away would end the connection.
    let drop = if first { "Z4" } else { "Z3" };
    let mut steps = vec![
        step("?AL", Expect::Address),
        step("@CTRL", Expect::Tolerated),
        step(drop, Expect::Tolerated),
        step("@ZF0", Expect::Tolerated),
        step("@ZX1", Expect::Ok),
        step("@ZU1", Expect::Tolerated),
    ];
    for (key, value) in config.settings(wait_ms) {
        steps.push(step(format!("!{key}{value}"), Expect::Ok));
        steps.push(step(format!("?{key}"), Expect::Value(value)));
    }
    steps.push(step("?PC", Expect::Counter));
    steps
}

/// The regular query of a modem at work: every second time the packet counter, which a restart resets.
pub(super) fn beat(config: &S2cConfig, wait_ms: u32, number: usize) -> Step {
    if number.is_multiple_of(2) {
        return step("?PC", Expect::Counter);
    }
    let settings = config.settings(wait_ms);
    match (number / 2) % (settings.len() + 3) {
        0 => step("?AL", Expect::Address),
        1 => step("@ZX1", Expect::Ok),
        2 => step("@ZU1", Expect::Tolerated),
        i => settings
            .get(i - 3)
            .map_or(step("?PC", Expect::Counter), |(key, value)| step(format!("?{key}"), Expect::Value(*value))),
    }
}

impl Step {
    pub(super) fn judge(&self, reply: &str, config: &S2cConfig) -> Verdict {
        let number: Option<u32> = reply.strip_prefix("[*]").unwrap_or(reply).trim().parse().ok();
        let good = match self.expect {
            Expect::Ok => matches!(reply, "OK" | "[*]OK"),
            Expect::Tolerated => matches!(reply, "OK" | "[*]OK") || reply.starts_with("ERROR"),
            Expect::Value(value) => number == Some(value),
            Expect::Address => match number {
                Some(n) if n == u32::from(config.address) => true,
                Some(n) => return Verdict::WrongAddress(n.to_string()),
                None => false,
            },
            Expect::Counter => return number.map_or(Verdict::Bad, Verdict::Counter),
        };
        if good { Verdict::Good } else { Verdict::Bad }
    }
}

/// Interval between two queries of a modem at work.
const BEAT_INTERVAL: Duration = Duration::from_secs(2);
/// After this silence the port is opened again.
const DEAF_TIMEOUT: Duration = Duration::from_secs(15);

/// The state of the modem as far as its replies show it.
#[derive(Debug, Default)]
pub(super) struct Supervision {
    beat_at: Instant,
    beats: usize,
    /// The modem's packet counter, once it was read.
    counter: Option<u32>,
    last_reply: Instant,
    opened: Instant,
    /// Whether the modem has ever been at work.
    was_ready: bool,
    /// The step of the start-up that failed last.
    failed: Option<Step>,
    refusal: Option<String>,
    wait: ConnectionWait,
}

/// How long the modem waits for the answer to a request of a connection, milliseconds (`RT`).
#[derive(Debug)]
struct ConnectionWait {
    set_ms: u32,
    wanted_ms: u32,
}

impl Default for ConnectionWait {
    fn default() -> Self {
        Self { set_ms: Self::UNMEASURED_MS, wanted_ms: Self::UNMEASURED_MS }
    }
}

impl ConnectionWait {
    const UNMEASURED_MS: u32 = 4000;
    /// What the modem takes.
    const ALLOWED_MS: std::ops::RangeInclusive<u32> = 500..=12_000;
    /// Beyond both ways: the other modem's header, and its turn.
    const BEYOND_MS: u32 = 1500;
    /// The wait is set again if it is so far from what is wanted.
    const NEAR_MS: u32 = 250;

    /// Takes the travel time of something that was heard, one way, microseconds.
    fn handle_travel(&mut self, travel_us: u32) {
        let (least, most) = (*Self::ALLOWED_MS.start(), *Self::ALLOWED_MS.end());
        self.wanted_ms = (travel_us / 500).saturating_add(Self::BEYOND_MS).clamp(least, most);
    }

    /// The wait to set, if it has changed.
    fn next(&mut self) -> Option<u32> {
        (self.wanted_ms.abs_diff(self.set_ms) > Self::NEAR_MS).then(|| {
            self.set_ms = self.wanted_ms;
            self.set_ms
        })
    }
}

impl Supervision {
    /// Takes the travel time of something that was heard, one way, microseconds.
    pub(super) fn handle_travel(&mut self, travel_us: u32) {
        self.wait.handle_travel(travel_us);
    }

    pub(super) fn open(&mut self, now: Instant) {
        (self.opened, self.last_reply) = (now, now);
    }

    pub(super) fn note_reply(&mut self, now: Instant) {
        self.last_reply = now;
    }

    pub(super) fn is_deaf(&self, now: Instant) -> bool {
        now.since(self.last_reply.max(self.opened)) >= DEAF_TIMEOUT
    }

    /// The step of the start-up at `index`; `None` behind the last one.
    pub(super) fn start_up(&self, config: &S2cConfig, index: usize) -> Option<Step> {
        setup::start_up(config, self.wait.set_ms, !self.was_ready).into_iter().nth(index)
    }

    pub(super) fn set_ready(&mut self, now: Instant) {
        self.was_ready = true;
        (self.refusal, self.failed) = (None, None);
        self.beat_at = now + BEAT_INTERVAL;
    }

    pub(super) fn beat_at(&self) -> Instant {
        self.beat_at
    }

    /// The next query of a modem at work, once it is due.
    pub(super) fn next_beat(&mut self, config: &S2cConfig, now: Instant) -> Option<Step> {
        if now < self.beat_at {
            return None;
        }
        self.beat_at = now + BEAT_INTERVAL;
        if let Some(wait_ms) = self.wait.next() {
            return Some(step(format!("!RT{wait_ms}"), Expect::Ok));
        }
        self.beats += 1;
        Some(setup::beat(config, self.wait.set_ms, self.beats))
    }

    pub(super) fn counter(&self) -> Option<u32> {
        self.counter
    }

    pub(super) fn set_counter(&mut self, counter: Option<u32>) {
        self.counter = counter;
    }

    /// Whether this step failed twice in a row: once may be the reply to another command.
    pub(super) fn fails_again(&mut self, step: &Step) -> bool {
        self.failed.replace(step.clone()).as_ref() == Some(step)
    }

    /// The text, if it was not the last one reported.
    pub(super) fn refuse(&mut self, text: String) -> Option<String> {
        if self.refusal.as_ref() == Some(&text) {
            return None;
        }
        self.refusal = Some(text.clone());
        Some(text)
    }
}

/// Settings of an S2C modem and of the way to it.
#[derive(Debug, Clone, PartialEq)]
pub struct S2cConfig {
    /// The address that the modem must have.
    pub address: ModemAddress,
    pub mode: S2cMode,
    /// Source level 0..=3: 3 is the least, and the only one for air.
    pub source_level: u8,
    /// Highest address of the network, the same on all modems.
    pub highest_address: u8,
    pub cluster: u8,
    /// Longest data packet, the same on all modems, milliseconds.
    pub packet_ms: u16,
    /// Whether commands end in LF, as over Ethernet, instead of CR.
    pub ethernet: bool,
    /// Speed of the serial line, bit/s; ten bits a byte.
    pub baud: Option<u32>,
    /// Bit rate of bursts for plans, bit/s.
    pub burst_bps: f64,
    /// Frames in the modem at most.
    pub pool_frames: u32,
}

/// An instant message takes 161 ms and 10.9 ms a byte: bits a second, and the preamble in bits.
///
/// Source: a fit to the table of measured durations shipped with a fielded driver.
pub const INSTANT_BPS: f64 = 8.0 / 0.0109;
pub const INSTANT_OVERHEAD_BITS: u64 = 119;
/// Bits around a frame in a burst: delimiters, stuffing, heads of pieces.
pub const BURST_OVERHEAD_BITS: u64 = 8 * 12;

/// Air time of an instant message.
pub fn instant_airtime(bytes: usize) -> Duration {
    Duration::from_secs_f64((bytes as f64 * 8.0 + INSTANT_OVERHEAD_BITS as f64) / INSTANT_BPS)
}

impl S2cConfig {
    /// Settings to write and to read back.
    ///
    /// No retries of messages: duplicates cost airtime, and the driver repeats by itself. Two retries of a
    /// connection: more would keep on speaking for long to a modem that has restarted, and so would a longer wait for it than the
    /// travel time asks for. Idle connections end soon, so that others get to speak.
    pub(super) fn settings(&self, wait_ms: u32) -> [(&'static str, u32); 10] {
        [
            ("L", self.source_level.into()),
            ("AM", self.highest_address.into()),
            ("C", 2),
            ("ZC", self.cluster.into()),
            ("ZP", self.packet_ms.into()),
            ("RC", 2),
            ("RT", wait_ms),
            ("RI", 0),
            ("ZI", 20),
            ("RP", 0),
        ]
    }

    /// Time that so many bytes take on the way to the modem.
    pub(super) fn line_time(&self, bytes: usize) -> Duration {
        self.baud.map_or(Duration::ZERO, |baud| Duration::from_secs_f64(bytes as f64 * 10.0 / f64::from(baud.max(1))))
    }
}
