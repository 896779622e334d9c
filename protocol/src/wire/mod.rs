//! The wire format: frames, acknowledgement statements and chunks, and why received bytes are refused.
//!
//! Multi-byte integers are big-endian. Diagrams count bits from the most significant one of the first byte.

mod ack;
mod chunk;
mod details;
mod fields;
mod frame;
mod header;
mod introduction;
mod listener;
mod path;
mod status;
mod trail;

pub use crate::bytes::{Reader, Truncated};
pub use ack::{AckForm, AckStatement, Horizon, MAX_WINDOW};
pub(crate) use chunk::room_for_payload;
pub use chunk::{Chunk, ChunkKind, Chunks};
pub use details::{Backlog, DiskReport, EquipmentFaults, PoseDetails};
pub use fields::{Address, MissionId, SessionId, Stamp};
pub use frame::{Envelope, Frame, FrameBuilder, Seal};
pub use header::{FrameKind, Header};
pub use introduction::{CellEdge, Introduction, MapOrigin, SurfaceName, UtcHours};
pub use listener::{Heard, Listener};
pub use path::{Placement, PlannedPath};
pub use status::{ModeReason, VehicleMode, VehicleStatus};
pub use trail::{FrameTie, Intent, RegistrationReport, Trail, TrailCorner};

/// The version of the wire format. Of another version only hellos are read, so that both ends can name the difference.
pub const WIRE_VERSION: u8 = 4;

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
