//! What the surface keeps across restarts, as events. Folding all events gives the [`SurfaceMemory`] again.

mod cells;
mod event;
mod memory;
mod vehicle_memory;

pub use super::label_book::StoredLabel;
pub use super::log::StoredLogEntry;
pub use cells::{EarlierMap, MapCopy};
pub use event::{
    DecodeError, Event, EventKind, EventSource, EventTime, RunId, StoredBudget, StoredCells, StoredCommand,
    StoredCommandChange, StoredContact, StoredDraft, StoredImage, StoredIntent, StoredMarker, StoredNote, StoredOrder,
    StoredPlaces, StoredRange, StoredRequest, VehicleEvent, decode, encode,
};
pub(crate) use memory::MAX_COMMAND_CHANGES;
pub use memory::{Began, SurfaceMemory};
pub(crate) use vehicle_memory::MAX_MARKERS;
pub use vehicle_memory::VehicleMemory;
