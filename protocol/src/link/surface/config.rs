//! Settings of the surface's end, and the events and errors for its host.

use crate::directive::SlotId;
use crate::link::{Authenticity, Mismatch};
use crate::mac::{MasterConfig, ModemProfile};
use crate::schedule::Shares;
use crate::wire::{Address, CellEdge, MapOrigin, MissionId, SurfaceName};
use std::time::Duration;

/// Settings of the surface's end.
#[derive(Debug, Clone)]
pub struct SurfaceConfig {
    /// The mission; frames of another one fail their integrity check.
    pub mission: MissionId,
    /// Frame size, bit rate and access scheme of the modem.
    pub modem: ModemProfile,
    /// Bit budget on air in bit/s.
    pub budget_bps: u32,
    /// Window over which the budget holds.
    pub budget_window: Duration,
    /// Least share of each class while it has something to send.
    pub shares: Shares,
    /// Limits of turns and pauses in medium access.
    pub master: MasterConfig,
    /// The edge of a cell on the operator's map, until a vehicle has stated its own.
    pub cell_edge: CellEdge,
    /// The configured origin of the map, which the hello states.
    pub origin: Option<MapOrigin>,
    /// The name by which the vehicle shows this surface to others.
    pub name: SurfaceName,
    /// Age after which an abort that has not arrived is withdrawn, so that the operator is asked; `None`: it never is.
    pub abort_lifetime: Option<Duration>,
    /// The vehicles that are contacted from the beginning.
    pub vehicles: Vec<Address>,
    /// Longest time between two discovery calls; `None` disables them.
    pub discovery_period: Option<Duration>,
    /// Key and scope of authentication; `None` sends frames with a CRC only.
    pub authenticity: Option<Authenticity>,
}

impl SurfaceConfig {
    /// Settings of a surface that knows no vehicle and calls none, without a name and without a key, with a window of 10 s.
    #[must_use]
    pub fn new(mission: MissionId, modem: ModemProfile, budget_bps: u32) -> Self {
        Self {
            mission,
            modem,
            budget_bps,
            budget_window: Duration::from_secs(10),
            shares: Shares::default(),
            master: MasterConfig::default(),
            cell_edge: CellEdge::default(),
            origin: None,
            name: SurfaceName::default(),
            abort_lifetime: None,
            vehicles: Vec::new(),
            discovery_period: None,
            authenticity: None,
        }
    }
}

/// An event of [`super::SurfaceLink`] for its host.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum SurfaceEvent {
    /// An unknown vehicle answered a discovery call.
    VehicleFound(Address),
    /// The operator's map of a vehicle has changed.
    MapChanged(Address),
    /// A pose or a report came in, and both are known.
    Status(Address),
    /// A vehicle has applied or refused a slot, or the order in it was withdrawn.
    SlotDecided(Address, SlotId),
    /// A content in force at a vehicle came in that the surface did not know.
    InForceLearned(Address, SlotId),
    /// The last part of an object came in.
    Object(Address, Vec<u8>),
    /// A part of an object came in.
    ObjectProgress {
        /// The vehicle that sends it.
        vehicle: Address,
        /// Its first [`Self::OBJECT_HEAD`] bytes, once they are held.
        head: Option<Vec<u8>>,
        /// Bytes of it that the surface holds.
        held: usize,
        /// Bytes of the whole object.
        total: usize,
    },
    /// The name of a label of a vehicle's map came in.
    LabelNamed(Address),
    /// A new tree of its labels has arrived.
    LabelsJoined(Address),
    /// A vehicle began a new run; its map starts empty.
    VehicleRestarted(Address),
    /// Another surface holds a vehicle, has called it, or holds it no more; see [`super::PeerView::holder`] and
    /// [`super::PeerView::caller`].
    Rivalry(Address),
    /// A vehicle has no record of the orders that it had received: they are withdrawn.
    OrdersLost(Address),
    /// The copy of a run with this vehicle is kept as [`super::PeerView::ended_run`], because a new run begins.
    RunEnded(Address),
    /// A vehicle uses the next key from now on.
    KeyChanged(Address),
    /// A setting of a vehicle does not fit; each is reported once, and a second vehicle with its address again after a while.
    Mismatch(Address, Mismatch),
}

impl SurfaceEvent {
    /// Bytes of an object that [`Self::ObjectProgress`] shows.
    pub const OBJECT_HEAD: usize = 4;
}

/// Why a slot cannot be issued.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IssueError {
    /// No vehicle with this address is known.
    #[error("no such vehicle")]
    NoVehicle,
    /// It does not fit into a frame.
    #[error("it takes {bytes} bytes, and a frame has room for {room}: set a larger link.frame_bytes or say less")]
    TooLarge {
        /// Length of the encoded slot in bytes.
        bytes: usize,
        /// Room for a slot in a frame, in bytes.
        room: usize,
    },
}
