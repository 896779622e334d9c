//! The configuration of an S2C modem.

pub use scenecast_config::S2cMode;
use scenecast_core::ModemAddress;
pub use scenecast_core::{S2C_BURST_FRAME_BYTES as BURST_FRAME_BYTES, S2C_INSTANT_BYTES as INSTANT_BYTES};
use std::time::Duration;

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
    /// connection: more would keep on speaking for long to a modem that has restarted. Idle connections end soon, so
    /// that others get to speak.
    pub(super) fn settings(&self) -> [(&'static str, u32); 10] {
        [
            ("L", self.source_level.into()),
            ("AM", self.highest_address.into()),
            ("C", 2),
            ("ZC", self.cluster.into()),
            ("ZP", self.packet_ms.into()),
            ("RC", 2),
            ("RT", 4000),
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
