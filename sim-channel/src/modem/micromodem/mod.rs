//! WHOI Micromodem 1 and 2: NMEA sentences over an emulated acoustic layer.
//!
//! The emulator knows cycle inits, data at rates 0 to 6, acknowledgements, flexible data, pings, user minipackets,
//! statistics of version 6, configuration, clock and reboot, in the sequences that fielded drivers expect.

mod base;
mod cycle;
mod housekeeping;
mod minipacket;
mod nvram;
mod packet;
mod sentence;
mod transducer;
mod transmitter;

use crate::channel::{Arrival, Onset};
use crate::modem::emulator::board::{ModemBoard, ModemLogic};
use crate::modem::emulator::{Fault, HostId, Transmission};
use base::{MicromodemBase, MicromodemTask};
use cycle::CycleService;
use housekeeping::Sleep;
use nvram::Nvram;
use packet::{Packet, PacketKind, PacketRate};
use sentence::{HostLine, LineCollector, NmeaSentence};
use std::collections::BTreeMap;
use std::time::Duration;
use transducer::Detector;
use transmitter::{PacketSignal, QueuedPacket, SentPacket};

/// The generation of a Micromodem.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Generation {
    /// Micromodem 1: statistics without version; no flexible data, `CCTMS`, `CCTMQ` or `CCALQ`.
    One,
    /// Micromodem 2: statistics of version 6, and all sentences.
    Two,
}

/// The properties of an emulated Micromodem; fixed while it runs.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct MicromodemConfig {
    /// Decides the sentences that the modem knows and the layout of its statistics.
    pub generation: Generation,
    /// `SRC` after the first start; 0 for an unset address, with which the modem never acknowledges.
    pub address: u8,
    /// Baud rate, 8N1; `None` without pacing. 19200 baud are too slow to keep rate 5 supplied.
    pub baud: Option<u32>,
    /// Time of its clock at the start of the run, seconds since 1970.
    pub unix_s: u64,
    /// Firmware version, three or four numbers with dots.
    pub version: String,
    /// Seed of the noise that `Fault::Garbage` writes.
    pub seed: u64,
}

impl MicromodemConfig {
    /// A Micromodem 2 with `address` at 19200 baud, its clock at the start of 2025.
    #[must_use]
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

    /// A Micromodem 1 with `address`, otherwise as [`new`](Self::new).
    #[must_use]
    pub fn first_generation(address: u8) -> Self {
        Self { generation: Generation::One, version: "0.94.0.04".to_string(), ..Self::new(address) }
    }
}

/// Airtime of a packet of `frames` frames at `rate` (0..=6), for schedules and budgets.
///
/// ```
/// use sim_channel::modem::micromodem::packet_airtime;
///
/// assert_eq!(packet_airtime(1, 3).unwrap().as_millis(), 3100);
/// assert_eq!(packet_airtime(1, 4), None);
/// ```
///
/// `None` for a rate above 6, and for a number of frames that a packet cannot hold. Source: a fixed time for each frame,
/// from packet sizes and nominal bit rates in a band of 5 kHz.
#[must_use]
pub fn packet_airtime(rate: u8, frames: u8) -> Option<Duration> {
    PacketRate::of(rate).filter(|rate| (1..=rate.max_frames).contains(&frames)).map(|rate| rate.airtime(frames))
}

/// Time from a reset to `INIT`, and from there to the main firmware.
const BOOT_STEP: Duration = Duration::from_millis(500);

/// An emulated Micromodem with one port, at which there may be several hosts.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
/// use sim_channel::modem::{Emulator, HostId};
///
/// let mut modem = Micromodem::new(MicromodemConfig { baud: None, ..MicromodemConfig::new(4) });
/// modem.handle_host_bytes(HostId::FIRST, b"$CCCFQ,SRC\r\n", Duration::ZERO);
/// assert_eq!(modem.poll_host_bytes(HostId::FIRST, Duration::ZERO), b"$CACFG,SRC,4*36\r\n");
/// ```
#[derive(Debug)]
pub struct Micromodem {
    base: MicromodemBase,
    collectors: BTreeMap<HostId, LineCollector>,
    cycles: CycleService,
    detector: Detector,
    /// The modem sleeps until a host writes.
    wakes_on_host: bool,
}

impl Micromodem {
    /// A modem that has just been switched on and is ready.
    #[must_use]
    pub fn new(config: MicromodemConfig) -> Self {
        Self {
            base: MicromodemBase::new(config),
            collectors: BTreeMap::new(),
            cycles: CycleService::default(),
            detector: Detector::default(),
            wakes_on_host: false,
        }
    }

    fn on_line(&mut self, line: HostLine, now: Duration) {
        match line {
            HostLine::Sentence(sentence) => self.on_sentence(&sentence, now),
            HostLine::BadChecksum => self.base.report_error("NMEA", 2, "Bad checksum", now),
            HostLine::NotUnderstood => self.base.report_error("NMEA", 3, "Not a sentence", now),
        }
    }

    fn on_sentence(&mut self, sentence: &NmeaSentence, now: Duration) {
        let Self { base, cycles, .. } = self;
        let newer = matches!(sentence.name.as_str(), "CCTDP" | "CCTMS" | "CCTMQ" | "CCALQ");
        if newer && base.is_first_generation() {
            return base.report_error("NMEA", 1, "Unknown command", now);
        }
        match sentence.name.as_str() {
            "CCCYC" | "CCTDP" | "CCMPC" | "CCMUC" if base.is_busy(now) => base.report_error("MODEM", 4, "Busy", now),
            "CCCYC" => cycles.on_command(base, sentence, now),
            "CCTXD" => cycles.on_data(base, sentence, false, now),
            "CCTXA" => cycles.on_data(base, sentence, true, now),
            "CCTDP" => minipacket::on_flexible_command(base, sentence, now),
            "CCMPC" => minipacket::on_ping_command(base, sentence, now),
            "CCMUC" => minipacket::on_user_command(base, sentence, now),
            "CCMSC" => {
                if let Some(sleep) = housekeeping::on_sleep(base, sentence, now) {
                    self.sleep(sleep, now);
                }
            }
            _ => housekeeping::on_sentence(base, sentence, now),
        }
    }

    /// A packet has been decoded.
    fn on_packet(&mut self, packet: &Packet, signal: &PacketSignal, now: Duration) {
        let Self { base, cycles, .. } = self;
        match packet.kind {
            PacketKind::CycleInit => cycles.on_init(base, packet, signal, now),
            PacketKind::Data => cycle::on_data_packet(base, packet, signal, now),
            PacketKind::Ack => cycle::on_ack(base, packet, signal, now),
            PacketKind::Flexible => minipacket::on_flexible_packet(base, packet, signal, now),
            PacketKind::Ping => minipacket::on_ping(base, packet, signal, now),
            PacketKind::PingReply => minipacket::on_ping_reply(base, packet, signal, now),
            PacketKind::User => minipacket::on_user(base, packet, signal, now),
        }
    }

    fn on_sent(&mut self, sent: &SentPacket, now: Duration) {
        transducer::report_transmission(&mut self.base, sent, now);
        if sent.out.then_request_data {
            self.cycles.request_data(&mut self.base, now);
        }
    }

    /// Restarts; the configuration and the clock stay, packets and cycles are gone.
    fn reboot(&mut self, now: Duration) {
        self.fall_asleep(now);
        self.base.board.schedule(now + BOOT_STEP, MicromodemTask::Init);
        self.base.board.schedule(now + 2 * BOOT_STEP, MicromodemTask::Awake);
    }

    fn sleep(&mut self, sleep: Sleep, now: Duration) {
        self.fall_asleep(now);
        match sleep {
            Sleep::Until(at) => self.base.board.schedule(at, MicromodemTask::Reboot),
            Sleep::UntilHostWrites => self.wakes_on_host = true,
        }
    }

    fn fall_asleep(&mut self, now: Duration) {
        self.base.fall_asleep(now);
        self.cycles.abandon();
        self.detector.clear();
        self.collectors.clear();
    }
}

impl ModemLogic for Micromodem {
    type Task = MicromodemTask;

    fn board(&self) -> &ModemBoard<MicromodemTask> {
        &self.base.board
    }

    fn board_mut(&mut self) -> &mut ModemBoard<MicromodemTask> {
        &mut self.base.board
    }

    fn read_host(&mut self, host: HostId, bytes: &[u8], at: Duration) {
        if std::mem::take(&mut self.wakes_on_host) && !self.base.is_awake() {
            self.reboot(at);
        }
        if !self.base.is_awake() {
            return;
        }
        self.collectors.entry(host).or_default().push(bytes);
        while let Some(line) = self.collectors.get_mut(&host).and_then(LineCollector::next) {
            self.on_line(line, at);
        }
    }

    fn forget_host(&mut self, host: HostId) {
        self.collectors.remove(&host);
    }

    fn on_task(&mut self, task: MicromodemTask, at: Duration) {
        let Self { base, cycles, .. } = self;
        match task {
            MicromodemTask::Sent(sent) => self.on_sent(&sent, at),
            MicromodemTask::Received(received) => self.on_packet(&received.0, &received.1, at),
            MicromodemTask::DataTimeout { request } => cycles.on_data_timeout(base, request, at),
            MicromodemTask::Report(body) => base.report(&body, at),
            MicromodemTask::Reply(packet) => base.transmitter.push(QueuedPacket::reply(*packet)),
            MicromodemTask::Revision => base.on_revision_due(at),
            MicromodemTask::Reboot => self.reboot(at),
            MicromodemTask::Init => base.report_revision("INIT", at),
            MicromodemTask::Awake => base.wake(at),
        }
    }

    fn on_onset(&mut self, onset: &Onset, now: Duration) {
        self.detector.on_onset(&mut self.base, onset, now);
    }

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration) {
        self.detector.on_arrival(&mut self.base, arrival, now);
    }

    fn next_transmission(&mut self, now: Duration) -> Option<Transmission> {
        self.base.begin_transmission(now)
    }

    fn break_down(&mut self, fault: Fault, now: Duration) {
        match fault {
            Fault::Busy(length) => self.base.refuse_until(now + length),
            Fault::Reboot => {
                self.base.nvram = Nvram::factory(self.base.config.address);
                self.reboot(now);
            }
            Fault::BrownOut => self.reboot(now),
            Fault::WrongAddress(address) => self.base.nvram.set("SRC", &address.to_string()),
            // These are faults of the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            // It requests each frame and has no buffer that could be too big.
            Fault::BigBuffer => {}
        }
    }
}

#[cfg(test)]
mod tests;
