//! A raw byte pipe: what one host writes, the others read, if the water lets it through.
//!
//! No frames, no addresses, no acknowledgement, no word of what was lost. Bytes are sent when enough of them wait or when
//! the host pauses. The pipe may eat `+++AT` up to the end of its line, as modems that listen for an escape do.

use crate::channel::{Arrival, Outcome};
use crate::modem::emulator::board::{ModemBoard, ModemLogic};
use crate::modem::emulator::{Fault, Host, ModemEvent, Transmission};
use crate::random::Stream;
use std::collections::VecDeque;
use std::time::Duration;

/// The make of a pipe.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TransparentConfig {
    /// Baud rate, 8N1; `None` without pacing.
    pub baud: Option<u32>,
    /// Bits a second on air.
    pub bit_rate: u32,
    /// Air time of the preamble of each packet.
    pub preamble: Duration,
    /// Most bytes in a packet.
    pub packet_bytes: usize,
    /// A pause of the host after which a short packet goes out.
    pub gap: Duration,
    /// Bytes that wait at most; more are lost without a word.
    pub buffer_bytes: usize,
    /// Whether `+++AT` and the rest of its line are eaten and answered `OK`.
    pub eats_escape: bool,
    /// Seeds the noise of the line.
    pub seed: u64,
}

impl Default for TransparentConfig {
    /// 9600 baud to the host and 9600 bit/s on air, packets of 256 bytes: assumed, of the order of data sheets.
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

/// An emulated transparent modem.
#[derive(Debug)]
pub struct Transparent {
    config: TransparentConfig,
    board: ModemBoard<TransparentTask>,
    waiting: VecDeque<u8>,
    last_byte: Duration,
    eating: bool,
    quiet_until: Duration,
    on_air_until: Duration,
}

/// What the pipe plans.
#[derive(Debug)]
pub(crate) enum TransparentTask {
    /// Look whether a packet can go.
    Look,
}

const ESCAPE: &[u8] = b"+++AT";
/// From reset until it works again.
const BOOT: Duration = Duration::from_secs(2);

impl Transparent {
    /// A pipe that is ready.
    pub fn new(config: TransparentConfig) -> Self {
        const PURPOSE: u64 = 0x7a9e;
        Self {
            board: ModemBoard::new(config.baud, Stream::new(config.seed, &[PURPOSE])),
            waiting: VecDeque::new(),
            last_byte: Duration::ZERO,
            eating: false,
            quiet_until: Duration::ZERO,
            on_air_until: Duration::ZERO,
            config,
        }
    }

    fn look_for_escape(&mut self) {
        let tail = self.waiting.len().saturating_sub(ESCAPE.len());
        if self.config.eats_escape && self.waiting.iter().skip(tail).eq(ESCAPE) {
            self.waiting.truncate(tail);
            self.eating = true;
        }
    }

    fn reboot(&mut self, now: Duration) {
        if now < self.on_air_until {
            self.board.emit(ModemEvent::CutShort);
        }
        self.waiting.clear();
        self.eating = false;
        self.on_air_until = now;
        self.be_quiet(BOOT, now);
    }

    fn be_quiet(&mut self, length: Duration, now: Duration) {
        self.quiet_until = now + length;
        self.board.schedule(self.quiet_until, TransparentTask::Look);
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

    fn read_host(&mut self, host: Host, bytes: &[u8], at: Duration) {
        self.last_byte = at;
        for byte in bytes {
            if self.eating {
                self.eating = !matches!(byte, b'\r' | b'\n');
                if !self.eating {
                    self.board.write_to(host, b"OK\r\n", at);
                }
            } else if self.waiting.len() < self.config.buffer_bytes {
                self.waiting.push_back(*byte);
                self.look_for_escape();
            }
        }
        self.board.schedule(at + self.config.gap, TransparentTask::Look);
    }

    /// `next_transmission`, which is asked after every call, does what there is to do.
    fn on_task(&mut self, _task: TransparentTask, _at: Duration) {}

    fn on_arrival(&mut self, arrival: &Arrival, now: Duration) {
        if let Outcome::Delivered { bytes, .. } = &arrival.outcome {
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
        self.board.schedule(self.on_air_until, TransparentTask::Look);
        Some(Transmission { bytes, airtime })
    }

    fn break_down(&mut self, fault: Fault, now: Duration) {
        match fault {
            Fault::Busy(length) => self.be_quiet(length, now),
            Fault::Reboot | Fault::BrownOut => self.reboot(now),
            // It has no address.
            Fault::WrongAddress(_) => {}
            // Done by the line.
            Fault::Garbage(_) | Fault::HalfLine | Fault::Freeze(_) => {}
            Fault::BigBuffer => self.config.buffer_bytes = 1024 * 1024,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::channel::ChannelConfig;
    use crate::modem::Emulator;
    use crate::modem::tests::rig::{Bench, SECOND};

    fn bench(config: ChannelConfig) -> Bench {
        let boxed = |node| (node, Box::new(Transparent::new(TransparentConfig::default())) as Box<dyn Emulator>);
        Bench::join(vec![boxed(1), boxed(2)], 1500.0, config)
    }

    #[test]
    fn bytes_cross_in_order_and_only_to_the_others() {
        let mut bench = bench(ChannelConfig::default());
        bench.write(1, b"hello");
        bench.write(1, &[7; 600]);
        bench.run(10 * SECOND);
        assert_eq!(bench.told[&2], [b"hello".to_vec(), vec![7; 600]].concat());
        assert!(bench.told[&1].is_empty());
    }

    #[test]
    fn time_is_that_of_line_preamble_air_and_water() {
        let mut bench = bench(ChannelConfig::default());
        bench.write(1, &[1; 96]);
        // 100 ms over the line, 30 ms pause, 100 ms preamble, 80 ms of bits, 1 s of water, and 1 ms a byte out.
        bench.run(Duration::from_millis(1310));
        assert!(bench.told[&2].is_empty());
        bench.run(Duration::from_millis(5));
        assert_eq!(bench.told[&2].len(), 4);
    }

    #[test]
    fn an_escape_is_eaten_up_to_its_line_end() {
        let mut bench = bench(ChannelConfig::default());
        bench.write(1, b"ab+++AT?S\rcd");
        bench.run(10 * SECOND);
        assert_eq!(bench.take(2), "abcd");
        assert_eq!(bench.take(1), "OK\r\n");
    }

    #[test]
    fn too_much_is_lost_without_a_word() {
        let mut bench = bench(ChannelConfig::default());
        bench.basin.inject(crate::nodes::NodeId(1), Fault::Busy(30 * SECOND), Duration::ZERO);
        bench.write(1, &[7; 10_000]);
        bench.run(60 * SECOND);
        assert_eq!(bench.told[&2].len(), 4096);
        assert!(bench.told[&1].is_empty());
    }

    #[test]
    fn both_at_once_is_a_loss_for_both() {
        let mut bench = bench(ChannelConfig::default());
        bench.channel_range(1.0);
        bench.write(1, &[1; 100]);
        bench.write(2, &[2; 100]);
        bench.run(10 * SECOND);
        assert!(bench.told.values().all(Vec::is_empty));
    }
}
