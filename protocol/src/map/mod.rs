//! The label map as both ends hold it.

mod bits;
mod coarse;
mod digest;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
mod plane;
mod replica;
mod scale;
mod settle;
mod source;
mod stream;
mod value;

pub use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect, TILE, UNEXPLORED};
pub use digest::MapDigest;
pub use plane::{PlaneChunk, PlaneReplica, PlaneSource};
pub use replica::Replica;
pub use scale::{PlaneKind, PlaneScale};
pub use settle::MOST_CONFIDENT;
pub use source::MapSource;
pub use stream::{StateReplica, StateSource};
