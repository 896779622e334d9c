//! The map as georeferenced files for other programs.

mod cells;
mod files;
mod projection;
mod regions;

pub use cells::{CellLayer, MapCells};
pub(crate) use files::{csv, geojson, indexed_png, ply, projection, world_file};
