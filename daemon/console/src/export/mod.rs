//! The map as georeferenced files for other programs.

mod cells;
mod files;
mod geotiff;
mod projection;
mod regions;

pub use cells::MapCells;
pub(crate) use cells::{CellLayer, Tiles};
pub(crate) use files::{csv, geojson, indexed_png, ply, projection, world_file};
pub(crate) use geotiff::{Reference, geotiff};
