//! Why received bytes are refused.

use super::WIRE_VERSION;
use crate::bytes::Truncated;

/// Why received bytes are not a frame for this end.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// Too short, or the header exceeds the frame.
    #[error("the frame is too short")]
    Truncated,
    /// The frame has another wire version.
    #[error("the frame has wire version {0}, this is version {WIRE_VERSION}")]
    Version(u8),
    /// The frame is addressed to another end.
    #[error("the frame is for another address")]
    NotForUs,
    /// Damaged, of another mission, or sealed to a session that is not ours.
    #[error("the checksum or tag does not match")]
    Checksum,
    /// A field has a value that no sender writes.
    #[error("the frame has a field out of range")]
    BadField,
}

impl From<Truncated> for FrameError {
    fn from(_: Truncated) -> Self {
        Self::Truncated
    }
}

/// Why bytes are not a status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StatusError {
    /// They are too short or too long.
    #[error("the status has another length")]
    Length,
    /// A field has a value that no vehicle writes.
    #[error("the status has a field out of range")]
    BadField,
}

impl From<Truncated> for StatusError {
    fn from(_: Truncated) -> Self {
        Self::Length
    }
}
