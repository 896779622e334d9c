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

use super::agenda::Agenda;
use super::port::Port;
use super::{Emulator, Fault, ModemEvent, Transmission};
use crate::{Arrival, Duration, Onset, Stream};
use clock::Clock;
use cycle::Cycle;
use nvram::Nvram;
use packet::Packet;
use rates::Rate;
use receive::Signal;
use sentence::{Collector, Line, Sentence, line};
use std::collections::{BTreeSet, VecDeque};
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
    port: Port,
    collector: Collector,
    nvram: Nvram,
    clock: Clock,
    agenda: Agenda<Event>,
    air: Air,
    cycle: Option<Cycle>,
    requests: u32,
    unique: u8,
    awake: bool,
    wakes_on_host: bool,
    busy_until: Duration,
    /// Transmissions whose detection was told.
    detected: BTreeSet<u64>,
    chance: Stream,
    events: VecDeque<ModemEvent>,
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
        let mut agenda = Agenda::new();
        agenda.add(REVISION_EVERY, Event::Revision);
        Self {
            port: Port::new(config.baud),
            collector: Collector::default(),
            nvram: Nvram::factory(config.address),
            clock: Clock::new(config.unix_s),
            agenda,
            air: Air::default(),
            cycle: None,
            requests: 0,
            unique: 0,
            awake: true,
            wakes_on_host: false,
            busy_until: Duration::ZERO,
            detected: BTreeSet::new(),
            chance: Stream::new(config.seed, &[PURPOSE]),
            events: VecDeque::new(),
            config,
        }
    }

    /// `SRC`, 0 if it is not set or none.
    fn address(&self) -> u8 {
        u8::try_from(self.nvram.number("SRC")).unwrap_or_default()
    }

    /// Tells the host a sentence, given without `$` and checksum.
    fn tell(&mut self, body: &str, now: Duration) {
        self.port.write(line(body).as_bytes(), now);
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

    fn read_host(&mut self, bytes: &[u8], at: Duration) {
        if std::mem::take(&mut self.wakes_on_host) && !self.awake {
            self.reboot(at);
        }
        if !self.awake {
            return;
        }
        self.collector.push(bytes);
        while let Some(line) = self.collector.next() {
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

    fn on_event(&mut self, event: Event, at: Duration) {
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
                self.agenda.add(at + REVISION_EVERY, Event::Revision);
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
        self.agenda.add(now + BOOT_STEP, Event::Init);
        self.agenda.add(now + 2 * BOOT_STEP, Event::Awake);
    }

    fn fall_silent(&mut self, now: Duration) {
        if now < self.air.busy_until {
            self.events.push_back(ModemEvent::CutShort);
        }
        self.awake = false;
        self.cycle = None;
        self.detected.clear();
        self.air = Air::default();
        self.collector = Collector::default();
        self.agenda = Agenda::new();
        self.agenda.add(now + REVISION_EVERY, Event::Revision);
    }
}

impl Emulator for Micromodem {
    fn port(&self) -> &Port {
        &self.port
    }

    fn port_mut(&mut self) -> &mut Port {
        &mut self.port
    }

    fn handle_onset(&mut self, onset: &Onset, now: Duration) {
        self.handle_timeout(now);
        self.on_onset(onset, now);
    }

    fn handle_arrival(&mut self, arrival: &Arrival, now: Duration) {
        self.handle_timeout(now);
        self.on_arrival(arrival, now);
    }

    fn poll_transmit(&mut self, now: Duration) -> Option<Transmission> {
        self.next_transmission(now)
    }

    fn poll_event(&mut self) -> Option<ModemEvent> {
        self.events.pop_front()
    }

    fn poll_timeout(&self) -> Option<Duration> {
        [self.agenda.next(), self.port.next_input()].into_iter().flatten().min()
    }

    fn handle_timeout(&mut self, now: Duration) {
        while let Some(due) = self.poll_timeout().filter(|due| *due <= now) {
            if let Some((at, event)) = self.agenda.pop(due) {
                self.on_event(event, at);
            } else if let Some((at, bytes)) = self.port.take_input(due) {
                self.read_host(&bytes, at);
            }
        }
    }

    fn inject(&mut self, fault: Fault, now: Duration) {
        if self.port.inject(fault, &mut self.chance, now) {
            return;
        }
        match fault {
            Fault::Busy(length) => self.busy_until = now + length,
            Fault::Reboot => {
                self.nvram = Nvram::factory(self.config.address);
                self.reboot(now);
            }
            Fault::BrownOut => self.reboot(now),
            Fault::WrongAddress(address) => self.nvram.set("SRC", &address.to_string()),
            // Done by the port.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            // It asks for each frame and has no buffer that could be too big.
            Fault::BigBuffer => {}
        }
    }
}

#[cfg(test)]
mod tests;
