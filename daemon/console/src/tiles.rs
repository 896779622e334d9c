//! The map in tiles for the page: which have changed since a reader's last request, and their bytes.

use crate::bodies::{MapIndex, TileLayer};
use scenecast_protocol::map::{Quantity, REPLICA_TILE, ReplicaTile, ReplicaTileKey, SharedTiles};
use scenecast_protocol::time::Instant;
use scenecast_surface::state::seconds;
use scenecast_surface::{CellLayer, MapCells};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

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
    let layers: Vec<&SharedTiles> =
        std::iter::once(&cells.tiles).chain(cells.layers.iter().map(|l| &l.tiles)).collect();
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

/// A map at one moment. Revisions count the maps that were compared one after the other; a tile has the revision at which it
/// last differed. Equal tiles are the same memory, so comparing two maps does not read their cells.
#[derive(Debug)]
pub struct TiledMap {
    cells: MapCells,
    /// Random for each run of the server, since revisions begin again.
    run: u32,
    revision: u64,
    tiles: BTreeMap<ReplicaTileKey, u64>,
    /// A reader with an earlier revision may hold tiles or layers that are no more.
    complete_since: u64,
}

impl TiledMap {
    /// The first map of a run of the server, which a random number names.
    pub fn first(cells: MapCells, run: u32) -> Self {
        let tiles = keys(&cells).into_iter().map(|key| (key, 1)).collect();
        Self { cells, run, revision: 1, tiles, complete_since: 1 }
    }

    /// The next map after this one.
    pub fn next(&self, cells: MapCells) -> Self {
        let revision = self.revision + 1;
        let keys = keys(&cells);
        let names = |cells: &MapCells| -> Vec<_> { cells.layers.iter().map(|l| l.descriptor.clone()).collect() };
        let is_continued = self.tiles.keys().all(|key| keys.contains(key)) && names(&self.cells) == names(&cells);
        let is_same = |key: &ReplicaTileKey| {
            let same = |a: &SharedTiles, b: &SharedTiles| match (a.get(key), b.get(key)) {
                (Some(a), Some(b)) => Arc::ptr_eq(a, b),
                (a, b) => a.is_none() && b.is_none(),
            };
            let mut layers = self.cells.layers.iter().zip(&cells.layers);
            same(&self.cells.tiles, &cells.tiles) && layers.all(|(a, b)| same(&a.tiles, &b.tiles))
        };
        let of = |key: ReplicaTileKey| {
            let held = self.tiles.get(&key).filter(|_| is_continued && is_same(&key));
            (key, held.copied().unwrap_or(revision))
        };
        let tiles = keys.into_iter().map(of).collect();
        let complete_since = if is_continued { self.complete_since } else { revision };
        Self { cells, run: self.run, revision, tiles, complete_since }
    }

    /// The cells of the map.
    pub fn cells(&self) -> &MapCells {
        &self.cells
    }

    /// Names this map: an answer that begins `since` this text continues it.
    pub fn tag(&self) -> String {
        format!("{:08x}-{}", self.run, self.revision)
    }

    /// The revision that a reader holds, from a tag; `None` if it needs every tile.
    fn held(&self, since: Option<&str>) -> Option<u64> {
        let (run, revision) = since?.split_once('-')?;
        let revision = revision.parse().ok()?;
        let is_ours = run == format!("{:08x}", self.run) && revision <= self.revision;
        (is_ours && revision >= self.complete_since).then_some(revision)
    }

    /// The tiles that have changed since a tag, or all of them, in the format of `docs/reference/map-tiles.md`.
    pub fn tiles_since(&self, since: Option<&str>) -> Vec<u8> {
        let held = self.held(since);
        let changed: Vec<ReplicaTileKey> =
            self.tiles.iter().filter(|(_, at)| held.is_none_or(|held| **at > held)).map(|(key, _)| *key).collect();
        encode(&self.index(held, &changed), &self.cells, &changed)
    }

    fn index(&self, held: Option<u64>, changed: &[ReplicaTileKey]) -> MapIndex {
        let cells = &self.cells;
        let bounds = cells.rectangle();
        MapIndex {
            tag: self.tag(),
            since: held.map(|revision| format!("{:08x}-{revision}", self.run)),
            version: cells.version,
            at_s: seconds(cells.at),
            cell_m: cells.cell_m,
            x0: bounds.x,
            y0: bounds.y,
            width: bounds.width,
            height: bounds.height,
            layers: cells.layers.iter().map(tile_layer).collect(),
            tiles: changed.iter().map(|&(row, column)| (column, row)).collect(),
        }
    }
}

fn tile_layer(layer: &CellLayer) -> TileLayer {
    let d = &layer.descriptor;
    TileLayer {
        name: d.name.clone().into_owned(),
        unit: d.unit.clone().into_owned(),
        is_depth: d.quantity == Quantity::Depth,
        palette: d.palette.name().to_owned(),
        spread: d.spread.name().to_owned(),
        lowest: layer.lowest,
        edges: layer.edges.clone(),
    }
}

fn keys(cells: &MapCells) -> BTreeSet<ReplicaTileKey> {
    let layers = cells.layers.iter().flat_map(|layer| layer.tiles.keys());
    cells.tiles.keys().chain(layers).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::{Cell, LabelGrid, Rect};

    /// The index of encoded tiles.
    fn index_of(bytes: &[u8]) -> MapIndex {
        let length = u32::from_le_bytes(bytes[8..12].try_into().unwrap()) as usize;
        serde_json::from_slice(&bytes[12..12 + length]).unwrap()
    }

    #[test]
    fn a_tile_has_the_bytes_of_its_document() {
        let grid: LabelGrid = [(Cell::new(-3, 2), 5), (Cell::new(-2, 3), 7)].into_iter().collect();
        let cells = MapCells { version: 4, ..MapCells::of_labels(&grid, 0.25) };
        let bytes = crate::tiles::TiledMap::first(cells, 0xab).tiles_since(None);
        assert_eq!(bytes[..8], *b"SCMT\x01\0\0\0");
        let found = index_of(&bytes);
        let Rect { x, y, width, height } = grid.bounds().unwrap();
        assert_eq!((found.x0, found.y0, found.width, found.height), (x, y, width, height));
        assert_eq!((found.tag.as_str(), found.version, found.tiles), ("000000ab-1", 4, vec![(-1, 0)]));
        // One part: layer 0, a square of 2 at (61, 2), one byte for each index, no times; indices, levels.
        let golden = [1, 0, 0, 0, 0, 61, 2, 2, 2, 1, 0, 0, 0, 0, 0, 0, 5, 0, 0, 7];
        assert_eq!(bytes[bytes.len() - golden.len()..], golden);
    }

    fn map(cells: &[(i32, i32)]) -> MapCells {
        MapCells::of_labels(&cells.iter().map(|&(x, y)| (Cell::new(x, y), 3)).collect(), 0.25)
    }

    fn index(map: &TiledMap, since: Option<&str>) -> MapIndex {
        index_of(&map.tiles_since(since))
    }

    #[test]
    fn a_reader_receives_only_the_tiles_that_have_changed() {
        let first = TiledMap::first(map(&[(0, 0), (64, 0), (9000, -9000)]), 7);
        let mut cells = first.cells().clone();
        cells.tiles.extend(map(&[(65, 1), (-1, 0)]).tiles);
        let second = first.next(cells.clone());
        let third = second.next(cells);
        let changed = |since: Option<&str>| index(&third, since);
        assert_eq!(changed(Some(&first.tag())).tiles, [(-1, 0), (1, 0)]);
        assert_eq!(changed(Some(&second.tag())).tiles, []);
        assert_eq!(changed(Some(&first.tag())).since, Some(first.tag()));
        let all = changed(None);
        assert_eq!((all.tiles.len(), all.since, all.tag), (4, None, third.tag()));
    }

    #[test]
    fn a_tag_of_another_run_or_of_a_map_that_is_gone_gets_all_tiles() {
        let first = TiledMap::first(map(&[(0, 0), (64, 0)]), 7);
        let second = first.next(map(&[(0, 0)]));
        for since in [first.tag(), "00000008-2".to_owned(), "00000007-3".to_owned(), "7".to_owned(), String::new()] {
            let found = index(&second, Some(&since));
            assert_eq!((found.since, found.tiles.len()), (None, 1), "{since}");
        }
        assert_eq!(index(&second, Some(&second.tag())).since, Some(second.tag()));
    }
}
