//! Medium access: who may speak, and for how long.
//!
//! No clock is shared; every wait comes from measured ranges and known airtimes. What the modem does by itself decides how
//! turns are made: [`Access`].

mod clock_map;
mod floor;
mod grant;
mod master;

pub use clock_map::ClockMap;
pub use floor::Floor;
pub use grant::{Grant, quarter_seconds};
pub use master::{Master, MasterConfig};

use std::time::Duration;

/// How the ends share the medium; the modem's driver chooses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Access {
    /// The surface grants turns, a vehicle speaks only in one. Also right for a full-duplex link.
    #[default]
    Shared,
    /// The modem does half duplex, and repeats, by itself; each end speaks as long as the modem's pool takes frames.
    ModemOwned {
        /// Frames that may be in the modem at a time: a turn's worth, so that what waits there does not grow old.
        pool_frames: u32,
    },
    /// The modem asks for the frames of a cycle that the surface's modem has begun.
    Polled,
}

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
    /// How the ends share the medium.
    pub access: Access,
}

impl ModemProfile {
    /// Bits on air of a transmission of `bytes`; the frames of a cycle are on air as whole ones, however full they are.
    pub fn bits_on_air(&self, bytes: usize) -> u64 {
        let bytes = if self.access == Access::Polled { bytes.max(self.frame_bytes) } else { bytes };
        bytes as u64 * 8 + self.overhead_bits
    }

    /// Time on air of a transmission of `bytes`.
    pub fn airtime(&self, bytes: usize) -> Duration {
        self.time_of(self.bits_on_air(bytes))
    }

    /// Time that `bits` take on air.
    pub fn time_of(&self, bits: u64) -> Duration {
        Duration::from_secs_f64(bits as f64 / self.bit_rate_bps.max(1.0))
    }

    /// Time on air of a full frame.
    pub fn frame_airtime(&self) -> Duration {
        self.airtime(self.frame_bytes)
    }
}
