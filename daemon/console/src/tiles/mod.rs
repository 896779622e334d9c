//! The map in tiles for the page: which tiles have changed since a reader's last request, and their bytes.

mod bytes;
mod tiled_map;

pub use tiled_map::TiledMap;
