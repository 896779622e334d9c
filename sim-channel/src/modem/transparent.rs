//! A raw byte pipe between hosts: each host reads the bytes that the others wrote, as far as the channel lets them pass.
//!
//! The pipe has no frames, no addresses and no acknowledgements, and it does not report losses. It sends when enough bytes
//! wait or when the host pauses. It may remove `+++AT` up to the end of the line, as modems do that listen for an escape.

use crate::channel::{Arrival, ReceptionOutcome};
use crate::modem::emulator::board::{ModemBoard, ModemLogic};
use crate::modem::emulator::{Fault, HostId, ModemEvent, Transmission};
use crate::random::RandomStream;
use std::collections::VecDeque;
use std::time::Duration;

/// The properties of a pipe; fixed while it runs.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TransparentConfig {
    /// Baud rate, 8N1; `None` without pacing.
    pub baud: Option<u32>,
    /// Acoustic bit rate without preamble, bit/s.
    pub bit_rate: u32,
    /// Airtime of the preamble of each packet.
    pub preamble: Duration,
    /// Maximal bytes of a packet.
    pub packet_bytes: usize,
    /// Pause of the host after which a short packet is sent.
    pub gap: Duration,
    /// Capacity of the buffer, bytes; more are lost silently.
    pub buffer_bytes: usize,
    /// Whether the pipe removes `+++AT` and the rest of its line, and replies `OK`.
    pub eats_escape: bool,
    /// Seed of the noise that [`Fault::Garbage`] writes.
    pub seed: u64,
}

impl Default for TransparentConfig {
    /// 9600 baud to the host, 9600 bit/s on air and packets of 256 bytes; assumed, of the order of data sheets.
    fn default() -> Self {
        Self {
            baud: Some(9600),
            bit_rate: 9600,
            preamble: Duration::from_millis(100),
            packet_bytes: 256,
            gap: Duration::from_millis(30),
            buffer_bytes: 4096,
            eats_escape: true,
            seed: 0,
        }
    }
}

/// An emulated transparent modem; see [`Basin`](super::Basin) for an example.
#[derive(Debug)]
pub struct Transparent {
    config: TransparentConfig,
    board: ModemBoard<TransparentTask>,
    waiting: VecDeque<u8>,
    last_byte: Duration,
    /// Within the line of an escape.
    in_escape: bool,
    quiet_until: Duration,
    on_air_until: Duration,
}

#[derive(Debug)]
pub(crate) enum TransparentTask {
    /// A packet may be ready to be sent.
    CheckBuffer,
}

const ESCAPE: &[u8] = b"+++AT";
const BOOT_TIME: Duration = Duration::from_secs(2);

impl Transparent {
    /// A pipe that is switched on and ready.
    #[must_use]
    pub fn new(config: TransparentConfig) -> Self {
        const PURPOSE: u64 = 0x7a9e;
        Self {
            board: ModemBoard::new(config.baud, RandomStream::new(config.seed, &[PURPOSE])),
            waiting: VecDeque::new(),
            last_byte: Duration::ZERO,
            in_escape: false,
            quiet_until: Duration::ZERO,
            on_air_until: Duration::ZERO,
            config,
        }
    }

    fn remove_escape(&mut self) {
        let tail = self.waiting.len().saturating_sub(ESCAPE.len());
        if self.config.eats_escape && self.waiting.iter().skip(tail).eq(ESCAPE) {
            self.waiting.truncate(tail);
            self.in_escape = true;
        }
    }

    fn reboot(&mut self, now: Duration) {
        if now < self.on_air_until {
            self.board.emit(ModemEvent::CutShort);
        }
        self.waiting.clear();
        self.in_escape = false;
        self.on_air_until = now;
        self.pause_sending(BOOT_TIME, now);
    }

    fn pause_sending(&mut self, length: Duration, now: Duration) {
        self.quiet_until = now + length;
        self.board.schedule(self.quiet_until, TransparentTask::CheckBuffer);
    }
}

impl ModemLogic for Transparent {
    type Task = TransparentTask;

    fn board(&self) -> &ModemBoard<TransparentTask> {
        &self.board
    }

    fn board_mut(&mut self) -> &mut ModemBoard<TransparentTask> {
        &mut self.board
    }

    fn read_host(&mut self, host: HostId, bytes: &[u8], at: Duration) {
        self.last_byte = at;
        for byte in bytes {
            if self.in_escape {
                self.in_escape = !matches!(byte, b'\r' | b'\n');
                if !self.in_escape {
                    self.board.write_to(host, b"OK\r\n", at);
                }
            } else if self.waiting.len() < self.config.buffer_bytes {
                self.waiting.push_back(*byte);
                self.remove_escape();
            }
        }
        self.board.schedule(at + self.config.gap, TransparentTask::CheckBuffer);
    }

    /// `next_transmission`, which is called after every task, does the work.
    fn on_task(&mut self, _task: TransparentTask, _at: Duration) {}

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration) {
        if let ReceptionOutcome::Delivered { bytes, .. } = &arrival.outcome {
            self.board.write_to_all(bytes, now);
        }
    }

    fn next_transmission(&mut self, now: Duration) -> Option<Transmission> {
        let full = self.waiting.len() >= self.config.packet_bytes;
        let paused = now >= self.last_byte + self.config.gap;
        let free = now >= self.on_air_until && now >= self.quiet_until;
        if self.waiting.is_empty() || !free || !(full || paused) {
            return None;
        }
        let count = self.waiting.len().min(self.config.packet_bytes.max(1));
        let bytes: Vec<u8> = self.waiting.drain(..count).collect();
        let airtime = self.config.preamble + Duration::from_secs(1) * (8 * count as u32) / self.config.bit_rate.max(1);
        self.on_air_until = now + airtime;
        self.board.schedule(self.on_air_until, TransparentTask::CheckBuffer);
        Some(Transmission { bytes, airtime })
    }

    fn break_down(&mut self, fault: Fault, now: Duration) {
        match fault {
            Fault::Busy(length) => self.pause_sending(length, now),
            Fault::Reboot | Fault::BrownOut => self.reboot(now),
            // A pipe has no address.
            Fault::WrongAddress(_) => {}
            // These are faults of the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            Fault::BigBuffer => self.config.buffer_bytes = 1024 * 1024,
        }
    }
}
