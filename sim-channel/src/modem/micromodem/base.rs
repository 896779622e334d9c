//! The parts that every service of the modem uses: configuration, clock, the port to the hosts and the transmitter.
//!
//! A service (cycles, flexible data, minipackets, detection) borrows this base for the length of one call. The base never
//! calls a service.

use super::clock::ModemClock;
use super::nvram::Nvram;
use super::packet::Packet;
use super::sentence;
use super::signal::PacketSignal;
use super::transmitter::{SentPacket, Transmitter};
use super::{Generation, MicromodemConfig};
use crate::modem::emulator::board::ModemBoard;
use crate::modem::emulator::{ModemEvent, Transmission};
use crate::random::RandomStream;
use std::time::Duration;

/// Period of the revision sentence `CAREV`.
const REVISION_INTERVAL: Duration = Duration::from_secs(30);

/// Work that the modem has scheduled for later.
#[derive(Debug)]
pub(crate) enum MicromodemTask {
    Sent(Box<SentPacket>),
    Received(Box<(Packet, PacketSignal)>),
    DataTimeout { request: u32 },
    Report(String),
    Reply(Box<Packet>),
    Revision,
    Reboot,
    Init,
    Awake,
}

#[derive(Debug)]
pub(super) struct MicromodemBase {
    pub config: MicromodemConfig,
    pub board: ModemBoard<MicromodemTask>,
    pub nvram: Nvram,
    pub clock: ModemClock,
    pub transmitter: Transmitter,
    awake: bool,
    /// End of the fault `Busy`.
    refuses_until: Duration,
}

impl MicromodemBase {
    pub(super) fn new(config: MicromodemConfig) -> Self {
        const PURPOSE: u64 = 0x3d3;
        let mut board = ModemBoard::new(config.baud, RandomStream::new(config.seed, &[PURPOSE]));
        board.schedule(REVISION_INTERVAL, MicromodemTask::Revision);
        Self {
            board,
            nvram: Nvram::factory(config.address),
            clock: ModemClock::new(config.unix_s),
            transmitter: Transmitter::default(),
            awake: true,
            refuses_until: Duration::ZERO,
            config,
        }
    }

    /// `SRC`; 0 if it is not set or not an address.
    pub(super) fn address(&self) -> u8 {
        u8::try_from(self.nvram.number("SRC")).unwrap_or_default()
    }

    pub(super) fn is_first_generation(&self) -> bool {
        self.config.generation == Generation::One
    }

    pub(super) fn is_awake(&self) -> bool {
        self.awake
    }

    /// The main firmware has started.
    pub(super) fn wake(&mut self, now: Duration) {
        self.awake = true;
        self.report_revision("AUV", now);
    }

    /// Drops all packets and scheduled work; only the revision sentences continue.
    pub(super) fn fall_asleep(&mut self, now: Duration) {
        if self.transmitter.is_busy(now) {
            self.board.emit(ModemEvent::CutShort);
        }
        self.awake = false;
        self.transmitter.clear();
        self.board.restart();
        self.board.schedule(now + REVISION_INTERVAL, MicromodemTask::Revision);
    }

    pub(super) fn refuse_until(&mut self, until: Duration) {
        self.refuses_until = until;
    }

    /// Whether commands that need the transducer are refused.
    pub(super) fn is_busy(&self, now: Duration) -> bool {
        now < self.refuses_until || self.transmitter.is_full()
    }

    /// Sends a sentence to every host; `body` is without `$` and checksum.
    pub(super) fn report(&mut self, body: &str, now: Duration) {
        self.board.write_to_all(sentence::line(body).as_bytes(), now);
    }

    /// `CAERR`: a sentence was not understood, or cannot be carried out.
    pub(super) fn report_error(&mut self, module: &str, number: u8, message: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        self.report(&format!("CAERR,{time},{module},{number},{message}"), now);
    }

    pub(super) fn report_revision(&mut self, ident: &str, now: Duration) {
        let time = self.clock.hhmmss(now);
        let version = self.config.version.clone();
        self.report(&format!("CAREV,{time},{ident},{version}"), now);
    }

    /// The periodic `CAREV`, if `REV` is set.
    pub(super) fn on_revision_due(&mut self, now: Duration) {
        if self.awake && self.nvram.is_on("REV") {
            self.report_revision("AUV", now);
        }
        self.board.schedule(now + REVISION_INTERVAL, MicromodemTask::Revision);
    }

    /// The next packet, if the transducer is free and the modem awake.
    pub(super) fn begin_transmission(&mut self, now: Duration) -> Option<Transmission> {
        if !self.awake {
            return None;
        }
        let mut out = self.transmitter.begin(now)?;
        out.packet.header_version = u8::from(self.nvram.is_on("psk.packet.mod_hdr_version"));
        if out.reported {
            self.report(&format!("CATXP,{}", out.bytes), now);
        }
        let transmission = Transmission { bytes: out.packet.encode(), airtime: out.airtime };
        self.board.schedule(now + out.airtime, MicromodemTask::Sent(Box::new(SentPacket { out, began: now })));
        Some(transmission)
    }
}
