//! The map as georeferenced files for other programs.

mod annotations;
mod cells;
mod files;
mod floor;
mod geotiff;
mod projection;
mod regions;
mod tiff;

use geotiff::{MAX_TILES, TILE};
use scenecast_core::label_picture::{self, PictureError};
use scenecast_protocol::map::Rect;
use scenecast_surface::MapCells;

pub(crate) use cells::map_body;
pub use files::MapFormat;
pub(crate) use files::harmless;
pub(crate) use floor::{FloorPicture, floor_tiff};
pub(crate) use projection::TransverseMercator;

/// Why the map is not written in a format; as text one line for the operator.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error(
        "the map spans {width} x {height} cells: a PNG has at most {}; a GeoTIFF (map.tif) has all",
        label_picture::MAX_CELLS
    )]
    LargePicture { width: u32, height: u32 },
    #[error(
        "the map spans {width} x {height} cells: JSON has at most {}; request a region with x0, y0, width and height in cells, or \
         the tiles of the map",
        cells::MAX_JSON_CELLS
    )]
    LargeJson { width: u32, height: u32 },
    #[error("the map spans {width} x {height} cells: a GeoTIFF has at most {MAX_TILES} tiles of {TILE} x {TILE}")]
    ManyTiles { width: u32, height: u32 },
    #[error("the map is too large for a GeoTIFF of 4 GB")]
    ManyBytes,
    #[error("the mission has no origin in latitude and longitude: set mission.origin_deg, or take map.tif in metres")]
    NoOrigin,
    #[error("UTM reaches from 80 degrees south to 84 degrees north: take map.wgs84.tif or map.tif")]
    OutsideUtm,
    #[error("within a degree of a pole a map has no rectangle of longitudes and latitudes: take map.tif")]
    AtPole,
    #[error("the map lies across 180 degrees of longitude: take map.tif, or map.utm.tif up to 84 degrees north")]
    AcrossDateLine,
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Whether the map is small enough for a picture. The error is one line for people.
fn check_picture(cells: &MapCells) -> Result<(), ExportError> {
    let Rect { width, height, .. } = cells.rectangle();
    if cells.rectangle().area() > label_picture::MAX_CELLS {
        return Err(ExportError::LargePicture { width, height });
    }
    Ok(())
}
