//! The rectangle around a map, which is small enough for an image.

use scene_model::topics::FlatCell;
use scenecast_core::UserError;
use scenecast_protocol::map::Rect;

/// Maximum number of cells in the rectangle around a map.
const MAX_CELLS: u64 = 1 << 26;

/// A map whose cells lie too far apart for an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the map would reach over {width} x {height} cells, more than {MAX_CELLS}: a position far off, or --cell-size too small"
)]
pub(super) struct LargeExtent {
    width: u64,
    height: u64,
}

/// The rectangle around cells from (west, south) to (east, north); an error if it is too large for an image.
pub(super) fn rectangle(west: i64, south: i64, east: i64, north: i64) -> Result<Rect, LargeExtent> {
    let (width, height) = ((east - west + 1) as u64, (north - south + 1) as u64);
    if width.saturating_mul(height) > MAX_CELLS {
        return Err(LargeExtent { width, height });
    }
    Ok(Rect { x: west as i32, y: south as i32, width: width as u32, height: height as u32 })
}

/// The rectangle around a map; one cell for an empty map.
pub(super) fn around(map: &[FlatCell]) -> Result<Rect, UserError> {
    let Some(first) = map.first() else { return Ok(Rect { x: 0, y: 0, width: 1, height: 1 }) };
    let mut limits = (first.x, first.y, first.x, first.y);
    for cell in map {
        limits = (limits.0.min(cell.x), limits.1.min(cell.y), limits.2.max(cell.x), limits.3.max(cell.y));
    }
    let (west, south, east, north) = limits;
    rectangle(west.into(), south.into(), east.into(), north.into()).map_err(UserError::input)
}
