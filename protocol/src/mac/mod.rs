//! Medium access: who may speak, and for how long.
//!
//! `Shared` access, for modems that leave half duplex to the host: the surface grants turns, a vehicle speaks only in one.
//! No clock is shared; every wait comes from measured ranges and known airtimes.

mod grant;
mod master;

pub use grant::{Grant, quarter_seconds};
pub use master::{Master, MasterConfig};

use std::time::Duration;

/// What the link must know of the modem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModemProfile {
    /// Bytes of a full frame.
    pub frame_bytes: usize,
    /// Bits a second on air.
    pub bit_rate_bps: f64,
    /// Bits on air that each transmission costs besides its bytes (preamble, header of the modem).
    pub overhead_bits: u64,
    /// Time from the end of a reception or transmission to the beginning of one's own.
    pub turn_around: Duration,
}

impl ModemProfile {
    /// Bits on air of a transmission of `bytes`.
    pub fn bits_on_air(&self, bytes: usize) -> u64 {
        bytes as u64 * 8 + self.overhead_bits
    }

    /// Time on air of a transmission of `bytes`.
    pub fn airtime(&self, bytes: usize) -> Duration {
        Duration::from_secs_f64(self.bits_on_air(bytes) as f64 / self.bit_rate_bps.max(1.0))
    }

    /// Time on air of a full frame.
    pub fn frame_airtime(&self) -> Duration {
        self.airtime(self.frame_bytes)
    }
}
