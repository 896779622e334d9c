//! The part of the vehicle's state that its host stores.

use super::kept_keys::KeptKeys;
use crate::LastPlace;
use scenecast_protocol::coordinates::DecimetrePoint;
use scenecast_protocol::directive::Series;
use scenecast_protocol::link::SlotInboxState;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The state that survives a restart of the vehicle, so that no order is applied twice and no label changes its meaning.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Durable {
    pub inbox: SlotInboxState,
    /// Epoch of the labels in use.
    pub epoch: u8,
    /// The highest label of the epoch that may have been sent.
    pub labels: u8,
    /// Random number of the mission, which its checkpoints carry too.
    pub lineage: u64,
    /// Utility in force: epoch, exploration, curiosity, weights; in hundredths.
    pub utility: Option<(u8, i8, i8, BTreeMap<u8, i8>)>,
    /// The highest label when that utility was applied.
    pub weighed: u8,
    /// Whether the operator has ordered the vehicle to hold.
    pub hold: bool,
    /// Whether the operator has ordered the vehicle to abort.
    pub abort: bool,
    /// Budget in force in bit/s, if it differs from the configuration.
    pub budget_bps: Option<u32>,
    /// Least shares in force in percent, if they differ from the configuration.
    pub shares: Option<[u8; 5]>,
    /// Order of the background streams as on the wire, if it differs from the configuration.
    pub background: Option<Vec<u8>>,
    /// Settings in force as on the wire. Empty: all as configured.
    pub settings: Vec<u8>,
    /// Limits in force as on the wire. Empty: none.
    pub limits: Vec<u8>,
    /// Metres and seconds of the limits that are used up, at most 50 m and 60 s behind the truth.
    pub used: (u32, u32),
    /// The breach that the operator has not answered yet: the reason's number on the wire, or 0.
    pub breach: u8,
    /// Fence in force as on the wire. Empty: none.
    pub fence: Vec<u8>,
    /// Position at the last fix that was used.
    pub place: Option<LastPlace>,
    /// The orders that this state knows nothing of, because an earlier state was lost.
    pub lost: LostOrders,
    /// Destination in force in the world frame: decimetres east and north.
    pub destination: Option<(i32, i32)>,
    /// Weighted areas in force as on the wire. Empty: none.
    pub areas: Vec<u8>,
    /// The keys that the surface has given.
    pub keys: KeptKeys,
}

impl Durable {
    /// The destination in force, in the world frame.
    pub fn destination(&self) -> Option<DecimetrePoint> {
        self.destination.map(|(east_dm, north_dm)| DecimetrePoint::new(east_dm, north_dm))
    }
}

/// The series of orders of which the vehicle no longer knows which versions it has applied.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum LostOrders {
    /// No series: every decision is known.
    #[default]
    None,
    /// The series in which the surface speaks, which is not known yet.
    Present,
    Of(Series),
}

impl LostOrders {
    /// Whether an order of `series` may have been applied before. The first series that is received counts as the one
    /// in which orders were lost; another one ends the loss.
    pub(super) fn may_contain(&mut self, series: Option<Series>) -> bool {
        match (*self, series) {
            (Self::None, _) => false,
            (Self::Present, Some(series)) => {
                *self = Self::Of(series);
                true
            }
            (Self::Of(lost), Some(series)) if lost != series => {
                *self = Self::None;
                false
            }
            _ => true,
        }
    }
}
