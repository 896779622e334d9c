//! What the surface keeps across restarts, as events.
//!
//! [`Recorder`] compares the surface with its [`SurfaceMemory`] and yields the [`Event`]s between them; the host writes
//! these before it shows or sends anything that depends on them. Folding all events gives the memory again.

mod cells;
mod encode;
mod event;
mod memory;
mod observe;
mod restore;
mod stored;

pub use cells::{EarlierMap, MapCopy};
pub use encode::{DecodeError, decode, encode};
pub use event::{
    Event, EventKind, EventSource, EventTime, RunId, StoredBudget, StoredCells, StoredContact, StoredImage,
    StoredIntent, StoredLabel, StoredNote, StoredOrder, StoredRange, StoredRequest, VehicleEvent,
};
pub use memory::{Began, SurfaceMemory, VehicleMemory};
pub use observe::{Archive, Observation, Recorder};
