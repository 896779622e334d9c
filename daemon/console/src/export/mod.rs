//! The map as files that other programs open in the right place.

mod cells;
mod files;
mod projection;
mod regions;

pub use cells::{CellLayer, MapCells};
pub(crate) use files::{csv, geojson, indexed_png, ply, projection, world_file};
