//! The map as georeferenced files for other programs.

mod annotations;
mod cells;
mod files;
mod geotiff;
mod projection;
mod regions;
mod tiff;

pub(crate) use cells::Tiles;
pub use cells::{CellLayer, MapCaption, MapCells};
pub use files::MapFormat;
pub(crate) use files::harmless;
pub(crate) use projection::TransverseMercator;
