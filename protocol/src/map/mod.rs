//! The label map as both ends hold it.

mod digest;
mod grid;
mod replica;
mod source;

pub use digest::MapDigest;
pub use grid::{Cell, LabelGrid, Rect, TILE};
pub use replica::Replica;
pub use source::{CellWorth, MapSource};

/// Label of a cell nobody has seen.
pub const UNEXPLORED: u8 = 0;
/// Highest label id on the map; 255 stays free for the codecs' own use.
pub const MAX_LABEL: u8 = 254;
