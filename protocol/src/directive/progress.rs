//! How far an order has come, as the surface knows it.

use super::{RefusalReason, Slot, SlotId};
use crate::time::Instant;

/// How far an order has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrderStatus {
    /// It waits for its first transmission.
    Queued,
    /// It was transmitted and is not acknowledged yet.
    OnAir,
    /// The vehicle has received it; its decision is not known yet.
    Received,
    /// It is in force at the vehicle.
    Applied,
    /// The vehicle refused it, and the previous version stays in force.
    Refused(RefusalReason),
    /// The surface sends it no more.
    Withdrawn(Withdrawal),
}

/// Why the surface sends an order no more.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Withdrawal {
    /// It was in force until another surface gave a newer one of its kind.
    Superseded,
    /// It had not arrived when another surface gave a newer one of its kind.
    Overtaken,
    /// It is an abort that has not arrived within the time that is set.
    Late,
    /// The vehicle has lost its record of it.
    Lost,
}

impl Withdrawal {
    /// Every reason for which an order is withdrawn.
    pub const ALL: [Self; 4] = [Self::Superseded, Self::Overtaken, Self::Late, Self::Lost];

    /// Whether the operator has to decide if the order is given again.
    pub fn asks(self) -> bool {
        self != Self::Superseded
    }

    /// An explanation for the operator, one clause.
    pub fn explain(self) -> &'static str {
        match self {
            Self::Superseded => "another surface has given a newer order of this kind",
            Self::Overtaken => {
                "another surface gave a newer order of this kind before it arrived: is it still to be sent?"
            }
            Self::Late => "it has not arrived in time: is it still to be sent?",
            Self::Lost => "the vehicle has no record of it any more: is it to be sent again?",
        }
    }
}

impl OrderStatus {
    /// Whether the vehicle's decision is not known yet.
    pub fn is_pending(self) -> bool {
        matches!(self, Self::Queued | Self::OnAir | Self::Received)
    }
}

/// The latest version of a slot, and how far it has come.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotProgress {
    /// The slot that was issued.
    pub id: SlotId,
    /// The version in this run of the surface, from 1; wraps.
    pub version: u16,
    /// The payload of this version.
    pub slot: Slot,
    /// How far it has come.
    pub status: OrderStatus,
    /// When the operator issued it.
    pub issued: Instant,
    /// When the status last changed.
    pub changed: Instant,
    /// When it was last put into a frame.
    pub sent: Option<Instant>,
}
