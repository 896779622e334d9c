//! The map as georeferenced files for other programs.

mod cells;
mod files;
mod format;
mod geotiff;
mod projection;
mod regions;

pub use cells::MapCells;
pub(crate) use cells::{CellLayer, Tiles};
pub use format::MapFormat;
