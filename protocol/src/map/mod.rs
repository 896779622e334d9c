//! The label map as both ends hold it.

mod bits;
mod coarse;
mod digest;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
#[allow(clippy::indexing_slicing)] // A cell's place is less than the size of its tile.
mod grid;
mod plane;
mod replica;
mod scale;
mod settle;
mod source;
mod stream;
mod value;

pub use digest::MapDigest;
pub use grid::{Cell, LabelGrid, Rect, TILE};
pub use plane::{PlaneChunk, PlaneReplica, PlaneSource};
pub use replica::Replica;
pub use scale::{PlaneKind, PlaneScale};
pub use settle::MOST_CONFIDENT;
pub use source::MapSource;
pub use stream::{StateReplica, StateSource};

/// Label of a cell nobody has seen.
pub const UNEXPLORED: u8 = 0;
/// Highest label id on the map; 255 stays free for the codecs' own use.
pub const MAX_LABEL: u8 = 254;
