//! Settings of the vehicle's end.

use crate::link::Authenticity;
use crate::mac::ModemProfile;
use crate::schedule::Shares;
use crate::wire::{Address, CellEdge, MissionId};
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
            modem,
            budget_bps,
            budget_window: Duration::from_secs(10),
            shares: Shares::default(),
            status_period: Duration::from_secs(10),
            authenticity: None,
        }
    }
}
