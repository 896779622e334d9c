//! How far an order has come: the series that its version counts in, the vehicle's decision, and what the surface knows of it.

use super::{RefusalReason, Slot, SlotId};
use crate::time::Instant;
use serde::{Deserialize, Serialize};

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
            Self::Superseded => "a newer order of this kind is in force",
            Self::Overtaken => {
                "another surface gave an order of this kind, perhaps a newer one, before it arrived: is it still to be sent?"
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

/// The vehicle's decision about a slot of the directive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlotState {
    /// No version was received in this session of the surface.
    #[default]
    Unknown,
    /// The vehicle has put it in force.
    Applied,
    /// Refused; the previous version stays in force.
    Refused(RefusalReason),
    /// Received, and waits for the decision: an order that the vehicle obeys while its disk does not keep it.
    Pending,
}

impl SlotState {
    /// The number on the wire: 0 unknown, 1 applied, 2..=12 a reason of refusal, 15 pending.
    pub(crate) fn code(self) -> u8 {
        match self {
            Self::Unknown => 0,
            Self::Applied => 1,
            Self::Refused(reason) => reason.code(),
            Self::Pending => 15,
        }
    }

    pub(crate) fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Unknown),
            1 => Some(Self::Applied),
            15 => Some(Self::Pending),
            code => RefusalReason::from_code(code).map(Self::Refused),
        }
    }
}

/// The latest version of a slot that the vehicle decided about, and the decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SlotReport {
    /// Low 8 bits of the version.
    pub version_low: u8,
    /// The decision about that version.
    pub state: SlotState,
}

/// The series of a surface: a random number of 48 bits, under which it counts the versions of its orders.
///
/// A surface that has forgotten its orders begins a new series. Among a thousand series of one mission, two are equal
/// with a probability of 2 in 10^9.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Series(u64);

impl Series {
    /// The series with the low 48 of these random bits.
    pub fn from_random(bits: u64) -> Self {
        Self(bits & 0xFFFF_FFFF_FFFF)
    }

    /// The series after this one of the same surface.
    #[must_use]
    pub fn next(self) -> Self {
        Self::from_random(self.0.wrapping_add(1))
    }

    /// Whether two series are of one surface, which counts them up; those of two surfaces are far apart.
    pub fn is_of_same_surface(self, other: Self) -> bool {
        const NEAR: u64 = 1 << 12;
        let apart = Self::from_random(self.0.wrapping_sub(other.0)).0;
        apart < NEAR || Self::from_random(apart.wrapping_neg()).0 < NEAR
    }

    /// The number on the wire.
    pub fn get(self) -> u64 {
        self.0
    }
}
