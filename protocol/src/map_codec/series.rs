//! A whole change in as many chunks as it takes.

use super::patch::{Lattice, MapChunk, Patch};
use super::{Codec, MAX_PATCH_CELLS, MAX_PATCH_SIDE, context, encode, png};
use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect};
use std::collections::{BTreeMap, BTreeSet};

/// Chunks of at most `room` bytes that together turn `base` into `target`; each decodes alone against `base`.
///
/// The encoder considers both maps as a whole and, unless the codec is `png`, tiles the change with patches that do not
/// overlap. This takes fewer bytes than repeated calls of [`encode`]. `None` if `room` is too small for a single cell.
///
/// ```
/// use scenecast_protocol::map::{Cell, LabelGrid};
/// use scenecast_protocol::map_codec::{Codec, encode_all};
///
/// let target: LabelGrid = (0..2500).map(|i| (Cell::new(i % 50, i / 50), 1 + (i / 50 % 3) as u8)).collect();
/// let chunks = encode_all(Codec::Auto, &LabelGrid::default(), &target, 64).unwrap();
/// assert!(chunks.iter().all(|chunk| chunk.bytes.len() <= 64));
/// assert_eq!(chunks.iter().map(|chunk| chunk.changes.len()).sum::<usize>(), 2500);
/// ```
pub fn encode_all(codec: Codec, base: &LabelGrid, target: &LabelGrid, room: usize) -> Option<Vec<MapChunk>> {
    let cells = base.iter().chain(target.iter()).map(|(cell, _)| cell);
    let differs = |cell| base.get(cell) != target.get(cell) && target.get(cell) <= MAX_LABEL;
    let dirty: BTreeSet<(i32, i32)> = cells.filter(|&cell| differs(cell)).map(|cell| (cell.y, cell.x)).collect();
    if codec == Codec::Png {
        return one_after_another(codec, base, target, room, dirty);
    }
    let mut chunks = Vec::new();
    for region in regions(&dirty) {
        let Some(bounds) = Rect::around(region.iter().map(|&(y, x)| Cell::new(x, y))) else { continue };
        for strip in strips(bounds, likely_bits(target, &region), room * 8) {
            let inside = |&&(y, x): &&(i32, i32)| strip.contains(Cell::new(x, y));
            let left: BTreeSet<(i32, i32)> = region.iter().filter(inside).copied().collect();
            chunks.extend(strip_chunks(base, target, strip, room, left)?);
        }
    }
    if codec == Codec::Auto {
        chunks = chunks.into_iter().map(|chunk| png::smaller(Lattice::whole(base), &chunk).unwrap_or(chunk)).collect();
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

/// Logarithm of the edge of the blocks that [`regions`] joins; changes farther apart do not share a patch.
const BLOCK_BITS: u32 = 8;

/// The changes in groups of adjoining blocks.
fn regions(dirty: &BTreeSet<(i32, i32)>) -> Vec<BTreeSet<(i32, i32)>> {
    let mut blocks: BTreeMap<(i32, i32), Vec<(i32, i32)>> = BTreeMap::new();
    for &(y, x) in dirty {
        blocks.entry((y >> BLOCK_BITS, x >> BLOCK_BITS)).or_default().push((y, x));
    }
    let mut regions = Vec::new();
    while let Some((first, cells)) = blocks.pop_first() {
        let mut region = BTreeSet::from_iter(cells);
        let mut edge = vec![first];
        while let Some((row, column)) = edge.pop() {
            let around = (-1..=1).flat_map(|north| (-1..=1).map(move |east| (row + north, column + east)));
            for block in around {
                if let Some(cells) = blocks.remove(&block) {
                    region.extend(cells);
                    edge.push(block);
                }
            }
        }
        regions.push(region);
    }
    regions
}

/// An estimate of the bits of all changes, from how each continues its western and southern neighbours.
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

/// Chunks for the changes `left` in the strip, from south to north, each as full as possible.
fn strip_chunks(
    base: &LabelGrid,
    target: &LabelGrid,
    strip: Rect,
    room: usize,
    mut left: BTreeSet<(i32, i32)>,
) -> Option<Vec<MapChunk>> {
    let mut chunks: Vec<MapChunk> = Vec::new();
    let most_rows = (MAX_PATCH_CELLS as u32 / strip.width).min(MAX_PATCH_SIDE as u32);
    while let Some(&(y, x)) = left.first() {
        let height = most_rows.min(strip.height - y.abs_diff(strip.y));
        let mut patch = Patch::between(Lattice::whole(base), Lattice::whole(target), Rect { y, height, ..strip });
        let sent = x.abs_diff(strip.x) as usize;
        patch.outcome[..sent].copy_from_slice(&patch.base[..sent]);
        let chunk = context::prefix_chunk(Lattice::whole(base), &patch.trimmed()?, room)?;
        for &(cell, _) in &chunk.changes {
            left.remove(&(cell.y, cell.x));
        }
        chunks.push(chunk);
    }
    Some(chunks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_far_apart_and_wider_than_a_patch_are_tiled() {
        let far = [(-30_000, 5), (0, -2000), (0, 0), (1500, 3), (1501, 40_000), (i32::MAX, i32::MIN)];
        let target: LabelGrid = far.into_iter().map(|(x, y)| (Cell::new(x, y), 3)).collect();
        for codec in [Codec::Auto, Codec::Png] {
            let chunks = encode_all(codec, &LabelGrid::default(), &target, 64).expect("room for a cell");
            let cells: usize = chunks.iter().map(|chunk| chunk.changes.len()).sum();
            assert_eq!(cells, far.len());
        }
    }
}
