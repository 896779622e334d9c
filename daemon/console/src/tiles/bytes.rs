//! The bytes of tiles: format 1 of `docs/reference/map-tiles.md`.

use crate::export::{MapCells, Tiles};
use crate::state::MapIndex;
use scenecast_protocol::map::{REPLICA_TILE, ReplicaTile, ReplicaTileKey};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;

const MAGIC: [u8; 4] = *b"SCMT";
const FORMAT: u8 = 1;
const EDGE: usize = REPLICA_TILE as usize;

/// The index, then the tiles of `keys`. All numbers are little-endian, and each part begins at a multiple of 4 bytes.
pub(super) fn encode(index: &MapIndex, cells: &MapCells, keys: &[ReplicaTileKey]) -> Vec<u8> {
    // The members of the index are numbers, strings and lists of these, so this cannot fail.
    let mut json = serde_json::to_vec(index).unwrap_or_default();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = Vec::new();
    out.extend(MAGIC);
    out.extend([FORMAT, 0, 0, 0]);
    out.extend((json.len() as u32).to_le_bytes());
    out.extend(json);
    let layers: Vec<&Tiles> = std::iter::once(&cells.tiles).chain(cells.layers.iter().map(|l| &l.tiles)).collect();
    for key in keys {
        let at = out.len();
        out.extend([0; 4]);
        let mut parts = 0u32;
        for (layer, tiles) in (0u8..).zip(&layers) {
            if let Some(tile) = tiles.get(key)
                && encode_part(layer, tile, &mut out)
            {
                parts += 1;
            }
        }
        out[at..at + 4].copy_from_slice(&parts.to_le_bytes());
    }
    out
}

/// The rectangle of a tile that has values; `false` if there is none.
fn encode_part(layer: u8, tile: &ReplicaTile, out: &mut Vec<u8>) -> bool {
    let known = || (0..EDGE * EDGE).filter(|&place| tile.labels()[place] != 0);
    let range = |of: fn(usize) -> usize| {
        let (low, high) = known().map(of).fold((EDGE, 0), |(low, high), v| (low.min(v), high.max(v)));
        (low, (high + 1).saturating_sub(low))
    };
    let ((x, width), (y, height)) = (range(|place| place % EDGE), range(|place| place / EDGE));
    if width == 0 {
        return false;
    }
    let received: Vec<Option<Instant>> = tile.received().collect();
    let places = || (y..y + height).flat_map(|line| (x..x + width).map(move |column| line * EDGE + column));
    let time = |place: usize| {
        let at = received[place].filter(|_| tile.labels()[place] != 0)?;
        Some(at.as_secs_f64() as u32)
    };
    let mut times: BTreeMap<u32, u16> = places().filter_map(time).map(|time| (time, 0)).collect();
    times.values_mut().zip(1..).for_each(|(index, n)| *index = n);
    let is_long = times.len() > usize::from(u8::MAX);
    out.extend([layer, x as u8, y as u8, width as u8, height as u8, if is_long { 2 } else { 1 }]);
    out.extend((times.len() as u16).to_le_bytes());
    times.keys().for_each(|time| out.extend(time.to_le_bytes()));
    for place in places() {
        let index = time(place).and_then(|time| times.get(&time)).copied().unwrap_or(0);
        let bytes = index.to_le_bytes();
        out.extend(&bytes[..if is_long { 2 } else { 1 }]);
    }
    out.extend(places().map(|place| tile.labels()[place]));
    out.resize(out.len().next_multiple_of(4), 0);
    true
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LabelGrid, Rect};

    /// The index of encoded tiles.
    pub(in crate::tiles) fn index(bytes: &[u8]) -> MapIndex {
        let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[12..12 + length]).unwrap()
    }

    #[test]
    fn a_tile_has_the_bytes_of_its_document() {
        let grid: LabelGrid = [(Cell::new(-3, 2), 5), (Cell::new(-2, 3), 7)].into_iter().collect();
        let cells = MapCells { version: 4, ..MapCells::of_labels(&grid, 0.25) };
        let bytes = crate::tiles::TiledMap::first(cells, 0xab).tiles_since(None);
        assert_eq!(bytes[..8], *b"SCMT\x01\0\0\0");
        let found = index(&bytes);
        let Rect { x, y, width, height } = grid.bounds().unwrap();
        assert_eq!((found.x0, found.y0, found.width, found.height), (x, y, width, height));
        assert_eq!((found.tag.as_str(), found.version, found.tiles), ("000000ab-1", 4, vec![(-1, 0)]));
        // One part: layer 0, a square of 2 at (61, 2), one byte for each index, no times; indices, levels.
        let golden = [1, 0, 0, 0, 0, 61, 2, 2, 2, 1, 0, 0, 0, 0, 0, 0, 5, 0, 0, 7];
        assert_eq!(bytes[bytes.len() - golden.len()..], golden);
    }
}
