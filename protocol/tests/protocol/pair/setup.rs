//! The settings of two ends, and of the channel between them.

use scenecast_protocol::link::Authenticity;
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::seal::{HeldKey, MissionKey};
use scenecast_protocol::wire::{MapOrigin, MissionId};
use std::time::Duration;

/// How the channel treats frames.
#[derive(Debug, Clone)]
pub(crate) struct LossyChannel {
    pub(crate) loss: f64,
    pub(crate) duplication: f64,
    pub(crate) reordering: f64,
    pub(crate) corruption: f64,
    /// Share of transmissions after which a third party transmits noise or an overheard frame.
    pub(crate) talker: f64,
    pub(crate) propagation: Duration,
}

/// A channel that loses a few frames, and does no other harm.
pub(crate) const CALM: LossyChannel = LossyChannel {
    loss: 0.05,
    duplication: 0.0,
    reordering: 0.0,
    corruption: 0.0,
    talker: 0.0,
    propagation: Duration::from_millis(100),
};

/// The settings that both ends share.
#[derive(Debug, Clone)]
pub(crate) struct Setup {
    pub(crate) mission: MissionId,
    pub(crate) frame_bytes: usize,
    pub(crate) budget_bps: u32,
    pub(crate) codec: Codec,
    pub(crate) access: Access,
    /// The most frames that a modem requests in its cycle.
    pub(crate) cycle_frames: u32,
    pub(crate) authenticity: Option<Authenticity>,
    pub(crate) origin: Option<MapOrigin>,
    /// The longest time between two discovery calls; `None`: there are none.
    pub(crate) discovery: Option<Duration>,
    /// How long a new label must be stable.
    pub(crate) debounce: Duration,
    /// The share of each layer in percent of the map's; `None`: no layers are sent.
    pub(crate) layers: Option<[u8; 2]>,
}

impl Setup {
    pub(crate) fn new(frame_bytes: usize, budget_bps: u32, codec: Codec) -> Self {
        Self {
            mission: MissionId(7),
            frame_bytes,
            budget_bps,
            codec,
            access: Access::Shared,
            cycle_frames: 8,
            authenticity: None,
            origin: None,
            discovery: None,
            debounce: Duration::ZERO,
            layers: None,
        }
    }

    pub(crate) fn keyed(self, all: bool, encrypt: bool) -> Self {
        let key = HeldKey::Mission(MissionKey::from_bytes([42; 16]));
        Self { authenticity: Some(Authenticity::new(key, all, encrypt)), ..self }
    }

    pub(crate) fn modem(&self) -> ModemProfile {
        ModemProfile {
            frame_bytes: self.frame_bytes,
            bit_rate_bps: 10_000.0,
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
            access: self.access,
        }
    }
}
