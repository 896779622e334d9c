//! Settings of the vehicle's end, and the events for its host.

use crate::directive::{Slot, SlotId};
use crate::link::{Authenticity, Mismatch};
use crate::mac::ModemProfile;
use crate::object::ObjectId;
use crate::schedule::Shares;
use crate::seal::VehicleKey;
use crate::wire::{Address, CellEdge, MapOrigin, MissionId};
use std::time::Duration;

/// Settings of the vehicle's end.
#[derive(Debug, Clone)]
pub struct VehicleConfig {
    /// Own address; frames to other vehicles are dropped.
    pub address: Address,
    /// The mission; frames of another one fail their integrity check.
    pub mission: MissionId,
    /// The edge of a map cell, which the hello states.
    pub cell_edge: CellEdge,
    /// The configured origin of the map, which the hello states.
    pub origin: Option<MapOrigin>,
    /// Frame size, bit rate and access scheme of the modem.
    pub modem: ModemProfile,
    /// Bit budget on air in bit/s.
    pub budget_bps: u32,
    /// Window over which the budget holds.
    pub budget_window: Duration,
    /// Least share of each class while it has something to send.
    pub shares: Shares,
    /// Time between two statuses; longer where the budget is small, so that they take at most a twentieth of it.
    pub status_period: Duration,
    /// Key and scope of authentication; `None` sends frames with a CRC only.
    pub authenticity: Option<Authenticity>,
}

impl VehicleConfig {
    /// Settings of a vehicle without a key, with a window of 10 s and a status every 10 s.
    #[must_use]
    pub fn new(address: Address, mission: MissionId, modem: ModemProfile, budget_bps: u32) -> Self {
        Self {
            address,
            mission,
            cell_edge: CellEdge::default(),
            origin: None,
            modem,
            budget_bps,
            budget_window: Duration::from_secs(10),
            shares: Shares::default(),
            status_period: Duration::from_secs(10),
            authenticity: None,
        }
    }
}

/// An event of [`super::VehicleLink`] for its host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleEvent {
    /// A new version of a slot came in. The host decides about it ([`super::VehicleLink::decide`]), makes the decision
    /// durable, and confirms that with [`super::VehicleLink::handle_persisted`]; only then is it acknowledged.
    Slot {
        /// The slot, also where its content is unreadable.
        id: SlotId,
        /// Its version in the surface's series.
        version: u16,
        /// The content; `None` if it is unreadable and can only be refused.
        content: Option<Slot>,
    },
    /// The surface has acknowledged every part of an object.
    ObjectDelivered(ObjectId),
    /// A surface is heard for the first time. The host makes [`super::VehicleLink::persistent_state`] durable: after a restart,
    /// a vehicle without a record of a surface asks it for its orders anew.
    SurfaceMet,
    /// The surface began a new run; everything is sent to it again.
    SurfaceRestarted,
    /// The surface has offered the next key. The host makes it durable and calls [`super::VehicleLink::keep_next_key`].
    NextKey(VehicleKey),
    /// The surface has proven that it uses the next key, which is the present one from now on; the one before opens nothing more.
    KeyChanged,
    /// Frames of the surface are refused because a setting differs; each is reported once.
    Mismatch(Mismatch),
    /// A chunk was left out of a frame, and its content waits again.
    Oversized(OversizedChunk),
}

/// A [`crate::map::StateSource`] has made a chunk that is longer than the room it was given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a chunk of {bytes} bytes was made for {room}")]
pub struct OversizedChunk {
    /// The length of the chunk's payload, bytes.
    pub bytes: usize,
    /// The room that the source was given, bytes.
    pub room: usize,
}
