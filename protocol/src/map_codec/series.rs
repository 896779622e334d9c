//! A whole change in as many chunks as it takes.

use super::{Codec, MapChunk, encode};
use crate::map::{Cell, LabelGrid};
use std::collections::BTreeSet;

/// Chunks of at most `room` bytes that together turn `base` into `target`; each decodes alone against `base`.
///
/// Looks at both maps as a whole. `None` if `room` is too small for a single cell.
pub fn encode_all(codec: Codec, base: &LabelGrid, target: &LabelGrid, room: usize) -> Option<Vec<MapChunk>> {
    let cells = base.iter().chain(target.iter()).map(|(cell, _)| cell);
    let mut left: BTreeSet<(i32, i32)> =
        cells.filter(|&cell| base.get(cell) != target.get(cell)).map(|cell| (cell.y, cell.x)).collect();
    let mut chunks = Vec::new();
    while let Some(&(y, x)) = left.first() {
        let chunk = encode(codec, base, target, Cell::new(x, y), room, &|cell| left.contains(&(cell.y, cell.x)))?;
        for (cell, _) in &chunk.changes {
            left.remove(&(cell.y, cell.x));
        }
        chunks.push(chunk);
    }
    Some(chunks)
}
