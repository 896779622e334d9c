//! The label map as both ends hold it.

mod grid;

pub use grid::{Cell, LabelGrid, Rect, TILE};

/// Label of a cell nobody has seen.
pub const UNEXPLORED: u8 = 0;
/// Highest label id on the map; 255 stays free for the codecs' own use.
pub const MAX_LABEL: u8 = 254;
