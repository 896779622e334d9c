//! EvoLogics S2C: the AT and NET interpreters over an emulated acoustic layer.
//!
//! Syntax, replies and notifications follow what fielded drivers send and parse. The acoustic layer is a model: instant
//! messages with the measured air times, and connections with trains of packets, selective acknowledgement and turns.

mod air;
mod burst;
mod commands;
mod config;
mod frame;
mod input;
mod instant;
mod reception;
mod reply;
mod send_command;
mod settings;
mod status;
mod timing;
mod usbl_lines;

pub use config::{Interpreter, S2cConfig};

use super::board::{Board, Machine};
use super::{Fault, Host, ModemEvent, Transmission};
use crate::usbl::UsblHead;
use crate::{Arrival, Duration, Onset, Stream};
use air::{After, Air};
use burst::Burst;
use frame::Frame;
use input::{InputParser, Reading};
use instant::{InstantSlot, Piggyback, Synchronous};
use reception::{LastHeard, Signal};
use reply::Mode;
use settings::Settings;
use std::collections::{BTreeMap, BTreeSet};
use usbl_lines::Measured;

/// Air time of an instant message of `bytes` (1..=64), for schedules and budgets.
///
/// Source: a fit to the table of measured durations shipped with a fielded driver, 161 ms + 10.9 ms a byte.
pub fn instant_airtime(bytes: usize) -> Duration {
    timing::instant(bytes)
}

/// An emulated S2C modem with one port, at which there may be several hosts.
#[derive(Debug)]
pub struct S2c {
    config: S2cConfig,
    board: Board<Plan>,
    parsers: BTreeMap<Host, InputParser>,
    /// Whose command is being answered.
    asking: Host,
    mode: Mode,
    settings: Settings,
    stored: Settings,
    options: Options,
    controls: bool,
    physical: Physical,
    booting: bool,
    busy_until: Duration,
    clock_offset: Duration,
    air: Air,
    instant: InstantSlot,
    synchronous: Option<Synchronous>,
    synchronous_number: u64,
    piggyback: Option<Piggyback>,
    burst: Burst,
    /// Transmissions whose beginning was told.
    begun: BTreeSet<u64>,
    last: LastHeard,
    head: Option<UsblHead>,
    last_fix: Option<Measured>,
}

/// What the port asked for by `@Z..`.
#[derive(Clone, Copy, Debug, Default)]
struct Options {
    extended: bool,
    usbl: bool,
    networking: bool,
    other: bool,
}

/// What the receiver does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Physical {
    Listen,
    Noise,
    Deaf,
}

/// Something to do later.
#[derive(Debug)]
pub(super) struct Plan(Event);

impl From<Event> for Plan {
    fn from(event: Event) -> Self {
        Self(event)
    }
}

#[derive(Debug)]
enum Event {
    Sent {
        dst: u8,
        label: &'static str,
        airtime: Duration,
        then: After,
    },
    Heard(Box<(Frame, Signal)>),
    Notify(String),
    Instant,
    InstantTimeout {
        attempt: u32,
    },
    Synchronous {
        number: u64,
        late: bool,
    },
    CancelMessages,
    Kick,
    RequestTimeout {
        epoch: u32,
    },
    Turn {
        number: u64,
        owes: bool,
    },
    AnswerTimeout {
        number: u64,
    },
    Rest {
        number: u64,
    },
    Idle {
        number: u64,
    },
    Usbl(Box<Measured>),
    /// A host may have been silent for the guard time of an escape.
    Silence(Host),
    Reboot,
    Booted,
}

impl S2c {
    /// A modem that has just been switched on and is ready.
    pub fn new(config: S2cConfig) -> Self {
        const PURPOSE: u64 = 0x52c;
        let settings = Settings::factory(config.address, config.remote);
        Self {
            board: Board::new(config.baud, Stream::new(config.seed, &[PURPOSE])),
            parsers: BTreeMap::new(),
            asking: Host::FIRST,
            mode: Mode::Data,
            stored: settings.clone(),
            settings,
            options: Options::default(),
            controls: false,
            physical: Physical::Listen,
            booting: false,
            busy_until: Duration::ZERO,
            clock_offset: Duration::ZERO,
            air: Air::default(),
            instant: InstantSlot::default(),
            synchronous: None,
            synchronous_number: 0,
            piggyback: None,
            burst: Burst::default(),
            begun: BTreeSet::new(),
            last: LastHeard::default(),
            head: config.usbl.map(|usbl| UsblHead::new(usbl, config.seed)),
            last_fix: None,
            config,
        }
    }

    /// The local address in force.
    pub fn address(&self) -> u8 {
        self.settings.byte("AL")
    }

    /// The modem's physical clock, us, 32 bit: it wraps each 71.6 minutes.
    fn clock_us(&self, now: Duration) -> u32 {
        (now + self.clock_offset).as_micros() as u32
    }

    fn reading(&self) -> Reading {
        if self.in_data_mode() { Reading::Data } else { Reading::Commands }
    }

    fn carry_out(&mut self, event: Event, at: Duration) {
        match event {
            Event::Sent { dst, label, airtime, then } => self.on_sent(dst, label, airtime, then, at),
            Event::Heard(heard) => self.on_heard(heard.0, &heard.1, at),
            Event::Notify(line) => self.notify(line, at),
            Event::Instant => self.try_instant(at),
            Event::InstantTimeout { attempt } => self.on_instant_timeout(attempt, at),
            Event::Synchronous { number, late } => self.on_synchronous(number, late, at),
            Event::CancelMessages => self.cancel_messages(at),
            Event::Kick => self.kick(at),
            Event::RequestTimeout { epoch } => self.on_request_timeout(epoch, at),
            Event::Turn { number, owes } => self.on_turn(number, owes, at),
            Event::AnswerTimeout { number } => self.on_answer_timeout(number, at),
            Event::Rest { number } => self.on_rest(number, at),
            Event::Idle { number } => self.on_idle(number),
            Event::Usbl(measured) => self.on_measured(&measured, at),
            Event::Silence(host) => self.on_silence(host, at),
            Event::Reboot => self.reboot(at),
            Event::Booted => self.booting = false,
        }
    }

    /// Reads what a host wrote up to a time.
    fn read_bytes(&mut self, host: Host, bytes: &[u8], at: Duration) {
        if self.booting {
            return;
        }
        self.asking = host;
        self.parsers.entry(host).or_default().push(bytes, at);
        while let Some(input) = self.next_input(host) {
            self.on_input(input, at);
        }
        if let Some(end) = self.parsers.get(&host).and_then(|parser| parser.timeout(self.reading())) {
            self.board.plan(end, Event::Silence(host));
        }
    }

    fn next_input(&mut self, host: Host) -> Option<input::Input> {
        let reading = self.reading();
        self.parsers.get_mut(&host)?.next(reading)
    }

    /// What a host has left unfinished has another meaning after a silence.
    fn on_silence(&mut self, host: Host, at: Duration) {
        let reading = self.reading();
        self.asking = host;
        if let Some(input) = self.parsers.get_mut(&host).and_then(|parser| parser.handle_timeout(at, reading)) {
            self.on_input(input, at);
        }
    }

    /// Restarts with the stored settings; the host's connection ends, messages and data are gone.
    fn reboot(&mut self, now: Duration) {
        if now < self.air.busy_until {
            self.board.cut_short();
        }
        let mut fresh = Self::new(self.config.clone());
        std::mem::swap(&mut fresh.board, &mut self.board);
        fresh.board.restart();
        fresh.settings = self.stored.clone();
        fresh.stored = self.stored.clone();
        fresh.head = self.head.take();
        fresh.booting = true;
        fresh.board.events.push_back(ModemEvent::HangUp);
        fresh.board.plan(now + Duration::from_millis(u64::from(self.config.boot_ms)), Event::Booted);
        *self = fresh;
    }
}

impl Machine for S2c {
    type Event = Plan;

    fn board(&self) -> &Board<Plan> {
        &self.board
    }

    fn board_mut(&mut self) -> &mut Board<Plan> {
        &mut self.board
    }

    fn read_host(&mut self, host: Host, bytes: &[u8], at: Duration) {
        self.read_bytes(host, bytes, at);
    }

    fn forget_host(&mut self, host: Host) {
        self.parsers.remove(&host);
    }

    fn on_event(&mut self, Plan(event): Plan, at: Duration) {
        self.carry_out(event, at);
    }

    fn on_onset(&mut self, onset: &Onset, now: Duration) {
        self.hear_beginning(onset, now);
    }

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration) {
        self.hear(arrival, now);
    }

    fn next_transmission(&mut self, now: Duration) -> Option<Transmission> {
        self.begin_transmission(now)
    }

    fn break_down(&mut self, fault: Fault, now: Duration) {
        match fault {
            Fault::Busy(length) => self.busy_until = now + length,
            Fault::Reboot | Fault::BrownOut => self.reboot(now),
            Fault::WrongAddress(address) => {
                for settings in [&mut self.settings, &mut self.stored] {
                    // An address out of range is none: the modem keeps its own.
                    let _ = settings.set("AL", &address.to_string(), false);
                }
            }
            // Done by the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            Fault::BigBuffer => self.settings.pool = 1024 * 1024,
        }
    }
}

#[cfg(test)]
mod tests;
