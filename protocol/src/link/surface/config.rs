//! Settings of the surface's end.

use crate::link::Authenticity;
use crate::mac::{MasterConfig, ModemProfile};
use crate::schedule::Shares;
use crate::wire::{Address, CellEdge, MissionId, SurfaceName};
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
            name: SurfaceName::default(),
            abort_lifetime: None,
            vehicles: Vec::new(),
            discovery_period: None,
            authenticity: None,
        }
    }
}
