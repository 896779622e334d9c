//! The wire format: frames, acknowledgement statements and chunks.
//!
//! Multi-byte integers are big-endian. Diagrams count bits from the most significant one of the first byte.

mod ack;
mod address;
mod chunk;
mod details;
mod frame;
mod header;
mod introduction;
mod listener;
mod path;
mod refusal;
mod stamp;
mod status;
mod trail;

pub use crate::bytes::{Reader, Truncated};
pub use ack::{AckForm, AckStatement, Horizon, MAX_WINDOW};
pub use address::{Address, MissionId, SessionId};
pub(crate) use chunk::room_for_payload;
pub use chunk::{Chunk, ChunkKind, Chunks};
pub use details::{Backlog, DiskReport, EquipmentFaults, PoseDetails};
pub use frame::{Envelope, Frame, FrameBuilder, Seal};
pub use header::{FrameKind, Header};
pub use introduction::{CellEdge, Introduction, MapOrigin, SurfaceName, UtcHours};
pub use listener::{Heard, Listener};
pub use path::{Placement, PlannedPath};
pub use refusal::{FrameError, StatusError};
pub use stamp::Stamp;
pub use status::{ModeReason, VehicleMode, VehicleStatus};
pub use trail::{FrameTie, Intent, RegistrationReport, Trail, TrailCorner};

/// The version of the wire format. Of another version only hellos are read, so that both ends can name the difference.
pub const WIRE_VERSION: u8 = 4;
