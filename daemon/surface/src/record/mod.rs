//! What the surface keeps across restarts, as events. Folding all events gives the [`SurfaceMemory`] again.

mod cells;
mod contact;
mod encode;
mod event;
mod former_labels;
mod memory;

pub use cells::{EarlierMap, MapCopy};
pub use contact::{StoredContact, StoredRange};
pub use encode::{DecodeError, decode, encode};
pub use event::{
    Event, EventKind, EventSource, EventTime, RunId, StoredBudget, StoredCells, StoredCommand, StoredCommandChange,
    StoredDraft, StoredImage, StoredIntent, StoredLabel, StoredLogEntry, StoredMarker, StoredNote, StoredOrder,
    StoredPlaces, StoredRequest, VehicleEvent,
};
pub use memory::{Began, SurfaceMemory, VehicleMemory};
pub(crate) use memory::{MAX_COMMAND_CHANGES, MAX_LOG, MAX_MARKERS};
