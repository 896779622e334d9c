//! A whole change in as many chunks as it takes.

use super::window::Patch;
use super::{Codec, MAX_PATCH_CELLS, MAX_PATCH_SIDE, MapChunk, context, encode, png};
use crate::map::{Cell, LabelGrid, MAX_LABEL, Rect};
use std::collections::BTreeSet;

/// Chunks of at most `room` bytes that together turn `base` into `target`; each decodes alone against `base`.
///
/// Looks at both maps as a whole and, unless the codec is `png`, tiles the change with patches that do not overlap:
/// fewer bytes than [`encode`] one after another. `None` if `room` is too small for a single cell.
pub fn encode_all(codec: Codec, base: &LabelGrid, target: &LabelGrid, room: usize) -> Option<Vec<MapChunk>> {
    let cells = base.iter().chain(target.iter()).map(|(cell, _)| cell);
    let differs = |cell| base.get(cell) != target.get(cell) && target.get(cell) <= MAX_LABEL;
    let dirty: BTreeSet<(i32, i32)> = cells.filter(|&cell| differs(cell)).map(|cell| (cell.y, cell.x)).collect();
    if codec == Codec::Png {
        return one_after_another(codec, base, target, room, dirty);
    }
    let Some(bounds) = Rect::around(dirty.iter().map(|&(y, x)| Cell::new(x, y))) else { return Some(Vec::new()) };
    let mut chunks = Vec::new();
    for strip in strips(bounds, likely_bits(target, &dirty), room * 8) {
        chunks.extend(strip_chunks(base, target, strip, room)?);
    }
    if codec == Codec::Auto {
        chunks = chunks.into_iter().map(|chunk| png::smaller(base, &chunk).unwrap_or(chunk)).collect();
    }
    Some(chunks)
}

fn one_after_another(
    codec: Codec,
    base: &LabelGrid,
    target: &LabelGrid,
    room: usize,
    mut left: BTreeSet<(i32, i32)>,
) -> Option<Vec<MapChunk>> {
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

/// A guess at the bits of all changes, from how each goes on from its western and southern neighbours.
fn likely_bits(target: &LabelGrid, dirty: &BTreeSet<(i32, i32)>) -> usize {
    let bits = |&(y, x): &(i32, i32)| {
        let label = target.get(Cell::new(x, y));
        let same = |x: i32, y: i32| dirty.contains(&(y, x)) && target.get(Cell::new(x, y)) == label;
        match (same(x.saturating_sub(1), y), same(x, y.saturating_sub(1))) {
            (true, true) => 0,
            (false, false) => 9,
            _ => 2,
        }
    };
    dirty.iter().map(bits).sum()
}

/// Upright strips of `bounds`, about as wide as the patch of one chunk is high.
fn strips(bounds: Rect, bits: usize, room_bits: usize) -> Vec<Rect> {
    let width = u64::from(bounds.width);
    let patch_cells = bounds.area() * room_bits as u64 / (bits as u64).max(1);
    let ideal = patch_cells.isqrt().clamp(1, MAX_PATCH_SIDE as u64).min((MAX_PATCH_CELLS as u64).isqrt());
    let whole = bits < room_bits && bounds.area() <= MAX_PATCH_CELLS as u64 && width <= MAX_PATCH_SIDE as u64;
    let count = if whole { 1 } else { (width + ideal / 2) / ideal }.max(width.div_ceil(MAX_PATCH_SIDE as u64)).max(1);
    let edge = |i: u64| (width * i / count) as u32;
    let strip = |i| Rect { x: bounds.x.wrapping_add_unsigned(edge(i)), width: edge(i + 1) - edge(i), ..bounds };
    (0..count).map(strip).collect()
}

/// Chunks for the strip from south to north, each as full as it gets.
fn strip_chunks(base: &LabelGrid, target: &LabelGrid, strip: Rect, room: usize) -> Option<Vec<MapChunk>> {
    let mut chunks: Vec<MapChunk> = Vec::new();
    let most_rows = (MAX_PATCH_CELLS as u32 / strip.width).min(MAX_PATCH_SIDE as u32);
    // Rows below, and cells of the first row, that have been sent.
    let (mut row, mut sent) = (0, 0);
    while row < strip.height {
        let y = strip.y.wrapping_add_unsigned(row);
        let height = most_rows.min(strip.height - row);
        let mut patch = Patch::between(base, target, Rect { y, height, ..strip });
        let done = sent as usize;
        patch.outcome[..done].copy_from_slice(&patch.base[..done]);
        let Some(patch) = patch.trimmed() else {
            (row, sent) = (row + height, 0);
            continue;
        };
        let chunk = context::prefix_chunk(base, &patch, room)?;
        let last = chunk.changes.last().map(|&(cell, _)| cell)?;
        (row, sent) = (last.y.abs_diff(strip.y), last.x.abs_diff(strip.x) + 1);
        chunks.push(chunk);
    }
    Some(chunks)
}
