//! The settings of both ends of a link in virtual time.

use scenecast_protocol::link::{Authenticity, SlotInboxState, SurfaceConfig, SurfaceLink, VehicleConfig, VehicleLink};
use scenecast_protocol::mac::{Access, ModemProfile};
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::seal::{HeldKey, MissionKey};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, MissionId};
use sim_channel::RandomStream;
use std::time::Duration;

pub(crate) const MISSION: MissionId = MissionId(7);
pub(crate) const FRAME_BYTES: usize = 64;
pub(crate) const BUDGET_BPS: u32 = 10_000;

/// The vehicle of every link.
pub(crate) fn auv() -> Address {
    Address::vehicle(1).unwrap_or(Address::EVERYBODY)
}

/// What both ends must have in common.
#[derive(Debug, Clone)]
pub(crate) struct EndsSetup {
    pub(crate) access: Access,
    pub(crate) authenticity: Option<Authenticity>,
    /// The longest time between two discovery calls; `None`: there are none.
    pub(crate) discovery: Option<Duration>,
    /// Age after which an abort that has not arrived is withdrawn; `None`: it never is.
    pub(crate) abort_lifetime: Option<Duration>,
}

impl EndsSetup {
    pub(crate) fn new(access: Access) -> Self {
        Self { access, authenticity: None, discovery: None, abort_lifetime: None }
    }

    /// Both ends with a key.
    pub(crate) fn keyed(self, all: bool, encrypt: bool) -> Self {
        let key = HeldKey::Mission(MissionKey::from_bytes([42; 16]));
        Self { authenticity: Some(Authenticity::new(key, all, encrypt)), ..self }
    }

    pub(crate) fn modem(&self) -> ModemProfile {
        ModemProfile {
            frame_bytes: FRAME_BYTES,
            bit_rate_bps: 10_000.0,
            overhead_bits: 0,
            turn_around: Duration::from_millis(200),
            access: self.access,
        }
    }

    pub(crate) fn vehicle(&self, seed: u64, durable: SlotInboxState, now: Instant) -> VehicleLink {
        let config = VehicleConfig {
            authenticity: self.authenticity.clone(),
            ..VehicleConfig::new(auv(), MISSION, self.modem(), BUDGET_BPS)
        };
        VehicleLink::new(config, Codec::Context, seed, durable, now)
    }

    pub(crate) fn surface(&self, seed: u64, now: Instant) -> SurfaceLink {
        let config = SurfaceConfig {
            vehicles: vec![auv()],
            discovery_period: self.discovery,
            abort_lifetime: self.abort_lifetime,
            authenticity: self.authenticity.clone(),
            ..SurfaceConfig::new(MISSION, self.modem(), BUDGET_BPS)
        };
        SurfaceLink::new(config, seed, now)
    }
}

/// The seed of one end.
pub(crate) fn draw_seed(rng: &mut RandomStream) -> u64 {
    (rng.uniform() * 2f64.powi(53)) as u64
}
