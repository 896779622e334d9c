//! The vehicle's decisions about slots, as its report names them.

use super::RefusalReason;

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
