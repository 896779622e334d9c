//! Medium access: who may transmit, and for how long.
//!
//! The ends share no clock; every wait follows from measured propagation times and known airtimes. [`Access`] describes
//! how a modem divides the medium by itself.

mod floor;
mod master;

pub use floor::Grant;
pub use floor::Wish;
pub(crate) use floor::{Floor, quarter_seconds};
pub(crate) use master::Master;
pub use master::MasterConfig;

use std::time::Duration;

/// How the ends share the medium; the modem's driver selects it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Access {
    /// The surface grants turns, and a vehicle transmits only in its turn. This works over any medium.
    #[default]
    Shared,
    /// The modem does half duplex and repetition by itself; each end transmits as long as
    /// the modem's pool takes frames.
    ModemOwned {
        /// Frames in the modem at a time: about a turn's worth, so that queued frames do not become outdated.
        pool_frames: u32,
    },
    /// The modem requests the frames of a cycle that the surface's modem has begun.
    Polled,
    /// The medium carries both directions at once, as a radio or a network does: each end transmits one frame after the
    /// other whenever it has a reason to, without turns. Acknowledgements are prompt, so that lost frames are known soon.
    FullDuplex,
}

impl Access {
    /// Frames in the modem at a time where the ends transmit without turns; `None` where they take turns.
    #[must_use]
    pub fn pool_frames(self) -> Option<u32> {
        match self {
            Self::ModemOwned { pool_frames } => Some(pool_frames),
            // The next frame is written when the last one is on its way, so that none becomes outdated in a queue.
            Self::FullDuplex => Some(1),
            Self::Shared | Self::Polled => None,
        }
    }

    /// Whether the ends transmit without turns.
    pub(crate) fn is_free(self) -> bool {
        self.pool_frames().is_some()
    }
}

/// The properties of a modem that the link depends on.
///
/// ```
/// use scenecast_protocol::mac::{Access, ModemProfile};
/// use std::time::Duration;
///
/// let modem = ModemProfile {
///     frame_bytes: 64,
///     bit_rate_bps: 1000.0,
///     overhead_bits: 100,
///     turn_around: Duration::from_millis(300),
///     access: Access::Shared,
/// };
/// assert_eq!(modem.bits_on_air(50), 500);
/// assert_eq!(modem.frame_airtime(), Duration::from_millis(612));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModemProfile {
    /// The size of a full frame in bytes.
    pub frame_bytes: usize,
    /// The bit rate on air in bit/s.
    pub bit_rate_bps: f64,
    /// Bits on air that each transmission costs besides its bytes (preamble, header of the modem).
    pub overhead_bits: u64,
    /// Time from the end of a reception or transmission to the beginning of an own transmission.
    pub turn_around: Duration,
    /// How the ends share the medium through this modem.
    pub access: Access,
}

impl ModemProfile {
    /// Bits on air of a transmission of `bytes`. In a polled cycle every frame occupies the airtime of a full one.
    #[must_use]
    pub fn bits_on_air(&self, bytes: usize) -> u64 {
        let bytes = if self.access == Access::Polled { bytes.max(self.frame_bytes) } else { bytes };
        bytes as u64 * 8 + self.overhead_bits
    }

    /// The airtime of a transmission of `bytes`.
    #[must_use]
    pub fn airtime(&self, bytes: usize) -> Duration {
        self.time_of(self.bits_on_air(bytes))
    }

    /// The airtime of `bits`, at least 1 bit/s assumed.
    pub fn time_of(&self, bits: u64) -> Duration {
        Duration::from_secs_f64(bits as f64 / self.bit_rate_bps.max(1.0))
    }

    /// Where the ends transmit without turns, how long an acknowledgement may wait for further frames, or for content that
    /// carries it; `usual` for a modem that does half duplex by itself.
    pub(crate) fn answer_wait(&self, usual: Duration) -> Duration {
        const RANGE: (Duration, Duration) = (Duration::from_millis(50), Duration::from_secs(1));
        match self.access {
            Access::FullDuplex => (self.frame_airtime() * 2).clamp(RANGE.0, RANGE.1),
            _ => usual,
        }
    }

    /// The airtime of a full frame.
    pub fn frame_airtime(&self) -> Duration {
        self.airtime(self.frame_bytes)
    }
}
