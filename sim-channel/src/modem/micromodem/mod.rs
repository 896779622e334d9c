//! WHOI Micromodem 1 and 2: NMEA sentences over an emulated acoustic layer.
//!
//! Cycle inits, data at rates 0 to 6, acknowledgements, flexible data, pings, user minipackets, statistics of version 6,
//! configuration, clock and reboot, in the sequences that fielded drivers wait for.

mod clock;
mod cycle;
mod flexible;
mod housekeeping;
mod minipacket;
mod nvram;
mod packet;
mod rates;
mod receive;
mod sentence;
mod transmit;

use super::board::{Board, Machine};
use super::{Fault, Host, Transmission};
use crate::{Arrival, Duration, Onset, Stream};
use clock::Clock;
use cycle::Cycle;
use nvram::Nvram;
use packet::Packet;
use rates::Rate;
use receive::Signal;
use sentence::{Collector, Line, Sentence, line};
use std::collections::{BTreeMap, BTreeSet};
use transmit::{Air, Sent};

/// Which of the two Micromodems.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Generation {
    /// Statistics without version; no flexible data, no `CCTMS`, `CCTMQ`, `CCALQ`.
    One,
    /// Statistics of version 6.
    Two,
}

/// The make of an emulated Micromodem.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MicromodemConfig {
    /// The sentences it knows and the layout of its statistics.
    pub generation: Generation,
    /// `SRC` after the first start; 0 for one that was never set and so never acknowledges.
    pub address: u8,
    /// Baud rate, 8N1; `None` without pacing. At 19200 rate 5 cannot be kept fed.
    pub baud: Option<u32>,
    /// What its clock shows at the start of the run, seconds since 1970.
    pub unix_s: u64,
    /// Firmware version, three or four numbers with dots.
    pub version: String,
    /// Seeds the noise of the line.
    pub seed: u64,
}

impl MicromodemConfig {
    /// A Micromodem 2 of that address at 19200 baud, its clock at the start of 2025.
    pub fn new(address: u8) -> Self {
        Self {
            generation: Generation::Two,
            address,
            baud: Some(19_200),
            unix_s: 1_735_689_600,
            version: "2.0.27087".to_string(),
            seed: u64::from(address),
        }
    }

    /// A Micromodem 1 of that address, otherwise the same.
    pub fn first_generation(address: u8) -> Self {
        Self { generation: Generation::One, version: "0.94.0.04".to_string(), ..Self::new(address) }
    }
}

/// Air time of a packet of `frames` at a rate, for schedules and budgets; `None` for a rate above 6 or frames that do not
/// fit.
///
/// Source: fixed time for each frame, from packet sizes and nominal bit rates in a band of 5 kHz.
pub fn packet_airtime(rate: u8, frames: u8) -> Option<Duration> {
    Rate::of(rate).filter(|rate| (1..=rate.max_frames).contains(&frames)).map(|rate| rate.airtime(frames))
}

/// An emulated Micromodem.
#[derive(Debug)]
pub struct Micromodem {
    config: MicromodemConfig,
    board: Board<Plan>,
    collectors: BTreeMap<Host, Collector>,
    nvram: Nvram,
    clock: Clock,
    air: Air,
    cycle: Option<Cycle>,
    requests: u32,
    unique: u8,
    awake: bool,
    wakes_on_host: bool,
    busy_until: Duration,
    /// Transmissions whose detection was told.
    detected: BTreeSet<u64>,
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
    Sent(Box<Sent>),
    Received(Box<(Packet, Signal)>),
    DataTimeout { request: u32 },
    Tell(String),
    Reply(Box<Packet>),
    Revision,
    Reboot,
    Init,
    Awake,
}

/// Between the periodic `CAREV`.
const REVISION_EVERY: Duration = Duration::from_secs(30);
/// Packets that may wait for the transducer.
const QUEUE_LIMIT: usize = 8;
/// From reset to `INIT`, and from there to the main firmware.
const BOOT_STEP: Duration = Duration::from_millis(500);

impl Micromodem {
    /// A modem that has just been switched on and is ready.
    pub fn new(config: MicromodemConfig) -> Self {
        const PURPOSE: u64 = 0x3d3;
        let mut board = Board::new(config.baud, Stream::new(config.seed, &[PURPOSE]));
        board.plan(REVISION_EVERY, Event::Revision);
        Self {
            board,
            collectors: BTreeMap::new(),
            nvram: Nvram::factory(config.address),
            clock: Clock::new(config.unix_s),
            air: Air::default(),
            cycle: None,
            requests: 0,
            unique: 0,
            awake: true,
            wakes_on_host: false,
            busy_until: Duration::ZERO,
            detected: BTreeSet::new(),
            config,
        }
    }

    /// `SRC`, 0 if it is not set or none.
    fn address(&self) -> u8 {
        u8::try_from(self.nvram.number("SRC")).unwrap_or_default()
    }

    /// Tells the host a sentence, given without `$` and checksum.
    fn tell(&mut self, body: &str, now: Duration) {
        self.board.tell_all(line(body).as_bytes(), now);
    }

    /// `CAERR`: a sentence was not understood, or cannot be done.
    fn complain(&mut self, module: &str, number: u8, message: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        self.tell(&format!("CAERR,{time},{module},{number},{message}"), now);
    }

    fn tell_revision(&mut self, ident: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        let version = self.config.version.clone();
        self.tell(&format!("CAREV,{time},{ident},{version}"), now);
    }

    fn read_bytes(&mut self, host: Host, bytes: &[u8], at: Duration) {
        if std::mem::take(&mut self.wakes_on_host) && !self.awake {
            self.reboot(at);
        }
        if !self.awake {
            return;
        }
        self.collectors.entry(host).or_default().push(bytes);
        while let Some(line) = self.collectors.get_mut(&host).and_then(Collector::next) {
            match line {
                Line::Sentence(sentence) => self.on_sentence(&sentence, at),
                Line::BadChecksum => self.complain("NMEA", 2, "Bad checksum", at),
                Line::NotUnderstood => self.complain("NMEA", 3, "Not a sentence", at),
            }
        }
    }

    fn on_sentence(&mut self, sentence: &Sentence, now: Duration) {
        let busy = now < self.busy_until || self.air.queue.len() >= QUEUE_LIMIT;
        let newer = matches!(sentence.name.as_str(), "CCTDP" | "CCTMS" | "CCTMQ" | "CCALQ");
        if newer && self.config.generation == Generation::One {
            return self.complain("NMEA", 1, "Unknown command", now);
        }
        match sentence.name.as_str() {
            "CCCYC" | "CCTDP" | "CCMPC" | "CCMUC" if busy => self.complain("MODEM", 4, "Busy", now),
            "CCCYC" => self.on_cycle_command(sentence, now),
            "CCTXD" => self.on_data(sentence, false, now),
            "CCTXA" => self.on_data(sentence, true, now),
            "CCTDP" => self.on_flexible_command(sentence, now),
            "CCMPC" => self.on_ping_command(sentence, now),
            "CCMUC" => self.on_user_command(sentence, now),
            _ => self.on_housekeeping(sentence, now),
        }
    }

    fn carry_out(&mut self, event: Event, at: Duration) {
        match event {
            Event::Sent(sent) => self.on_sent(&sent, at),
            Event::Received(received) => self.on_received(&received.0, &received.1, at),
            Event::DataTimeout { request } => self.on_data_timeout(request, at),
            Event::Tell(body) => self.tell(&body, at),
            Event::Reply(packet) => self.send_quietly(*packet),
            Event::Revision => {
                if self.awake && self.nvram.is_on("REV") {
                    self.tell_revision("AUV", at);
                }
                self.board.plan(at + REVISION_EVERY, Event::Revision);
            }
            Event::Reboot => self.reboot(at),
            Event::Init => self.tell_revision("INIT", at),
            Event::Awake => {
                self.awake = true;
                self.tell_revision("AUV", at);
            }
        }
    }

    /// Restarts; the configuration and the clock stay, everything under way is gone.
    fn reboot(&mut self, now: Duration) {
        self.fall_silent(now);
        self.board.plan(now + BOOT_STEP, Event::Init);
        self.board.plan(now + 2 * BOOT_STEP, Event::Awake);
    }

    fn fall_silent(&mut self, now: Duration) {
        if now < self.air.busy_until {
            self.board.cut_short();
        }
        self.awake = false;
        self.cycle = None;
        self.detected.clear();
        self.air = Air::default();
        self.collectors.clear();
        self.board.restart();
        self.board.plan(now + REVISION_EVERY, Event::Revision);
    }
}

impl Machine for Micromodem {
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
        self.collectors.remove(&host);
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
            Fault::Reboot => {
                self.nvram = Nvram::factory(self.config.address);
                self.reboot(now);
            }
            Fault::BrownOut => self.reboot(now),
            Fault::WrongAddress(address) => self.nvram.set("SRC", &address.to_string()),
            // Done by the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            // It asks for each frame and has no buffer that could be too big.
            Fault::BigBuffer => {}
        }
    }
}

#[cfg(test)]
mod tests;
