//! Packets of a Micromodem at each rate, and sizes that depend on the make of a modem.

use std::time::Duration;

/// The capacity of a packet of one rate, in a band of 5 kHz.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MicromodemRate {
    pub number: u8,
    pub frames: u8,
    /// Bytes of a frame; air time is that of whole frames.
    pub frame_bytes: usize,
    /// Air time of a packet with all its frames, milliseconds.
    packet_ms: u64,
}

const fn rate(number: u8, frames: u8, frame_bytes: usize, packet_ms: u64) -> MicromodemRate {
    MicromodemRate { number, frames, frame_bytes, packet_ms }
}

const RATES: [MicromodemRate; 6] = [
    rate(0, 1, 32, 3200),
    rate(1, 3, 64, 3100),
    rate(2, 3, 64, 3100),
    rate(3, 2, 256, 3400),
    rate(4, 2, 256, 3150),
    rate(5, 8, 256, 3050),
];

/// The packet that a modem sends to have another one send, or before one of its own at rate 0.
pub const CYCLE_INIT: Duration = Duration::from_millis(900);
/// Bits that the cycle-init and the head of a packet add to a frame: 21 bits and the address fields, rounded up.
pub const OVERHEAD_BITS: u64 = 64;

impl MicromodemRate {
    /// The rate of that number; the highest one beyond.
    pub fn of(number: u8) -> Self {
        RATES.into_iter().find(|rate| rate.number == number).unwrap_or(RATES[5])
    }

    /// Air time of a full packet.
    pub fn packet(&self) -> Duration {
        Duration::from_millis(self.packet_ms)
    }

    /// Bits a second while a packet is on air, overhead included.
    pub fn bits_per_s(&self) -> f64 {
        let bits = (self.frame_bytes as u64 * 8 + OVERHEAD_BITS) * u64::from(self.frames);
        bits as f64 / self.packet().as_secs_f64()
    }
}

/// Bytes of an instant message of an EvoLogics S2C, at most.
pub const S2C_INSTANT_BYTES: usize = 64;
/// Bytes of a frame in a burst record of 1000 bytes of an S2C, its delimiters excluded.
pub const S2C_BURST_FRAME_BYTES: usize = 992;
