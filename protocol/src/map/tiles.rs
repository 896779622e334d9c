//! The cells that a replica has received, in tiles that readers share, and sets of cells of one tile.

use super::{Cell, LabelGrid, MAX_LABEL, Rect};
use crate::grid::TILE_CELLS;
use crate::map_codec::Stride;
use crate::time::Instant;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Edge of a tile of a replica in cells.
pub const REPLICA_TILE: i32 = 64;
const CELLS: usize = (REPLICA_TILE * REPLICA_TILE) as usize;
/// The most tiles of a replica. A few frames can claim cells in many places, and each place takes a tile.
const MAX_TILES: usize = 1 << 15;
/// Receptions after which a tile forgets those that no cell refers to any more.
const MAX_RECEPTIONS: usize = 2 * CELLS;

/// Row and column of a tile of a replica, counted in tiles from the origin.
pub type ReplicaTileKey = (i32, i32);
/// Tiles of a replica by their place; a clone shares them.
pub type SharedTiles = BTreeMap<ReplicaTileKey, Arc<ReplicaTile>>;

static NO_TILES: SharedTiles = BTreeMap::new();

/// A frame that covered cells of a tile.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CellReception {
    number: u64,
    at: Instant,
}

/// The received cells of a square of [`REPLICA_TILE`] x [`REPLICA_TILE`] cells, row by row from the south-west.
#[derive(Clone)]
pub struct ReplicaTile {
    labels: [u8; CELLS],
    /// One more than the index of each cell's reception; 0 = never received.
    received: [u16; CELLS],
    receptions: Vec<CellReception>,
}

impl ReplicaTile {
    const EMPTY: Self = Self { labels: [0; CELLS], received: [0; CELLS], receptions: Vec::new() };

    /// The label or level of each cell, row by row from the south-west; 0 = unexplored.
    pub fn labels(&self) -> &[u8] {
        &self.labels
    }

    /// When a chunk last covered each cell, in the order of [`Self::labels`].
    pub fn received(&self) -> impl Iterator<Item = Option<Instant>> + '_ {
        self.received.iter().map(|&index| Some(self.reception(index)?.at))
    }

    /// The tile with other labels, which `label` gives for those of this one.
    #[must_use]
    pub fn relabelled(&self, label: impl Fn(u8) -> u8) -> Self {
        Self { labels: self.labels.map(label), ..self.clone() }
    }

    /// The tiles of a map of which no times are known.
    pub fn tiles_of(grid: &LabelGrid) -> SharedTiles {
        let mut tiles = SharedTiles::new();
        for (cell, label) in grid.iter() {
            let tile = Arc::make_mut(tiles.entry(key(cell)).or_insert_with(|| Arc::new(Self::EMPTY)));
            if let Some(at) = tile.labels.get_mut(place(cell)) {
                *at = label;
            }
        }
        tiles
    }

    fn reception(&self, index: u16) -> Option<CellReception> {
        self.receptions.get(usize::from(index).checked_sub(1)?).copied()
    }

    /// Enters a reception unless the last one is the same; the result is the number by which cells refer to it.
    fn enter(&mut self, reception: CellReception) -> u16 {
        if self.receptions.last() != Some(&reception) {
            if self.receptions.len() >= MAX_RECEPTIONS {
                self.forget_unused();
            }
            self.receptions.push(reception);
        }
        self.receptions.len() as u16
    }

    /// At most one reception for each cell stays, so its number fits 16 bits.
    fn forget_unused(&mut self) {
        let mut kept = BTreeMap::new();
        let mut receptions = Vec::new();
        for index in &mut self.received {
            let Some(&reception) = usize::from(*index).checked_sub(1).and_then(|at| self.receptions.get(at)) else {
                continue;
            };
            *index = *kept.entry(*index).or_insert_with(|| {
                receptions.push(reception);
                receptions.len() as u16
            });
        }
        self.receptions = receptions;
    }
}

impl std::fmt::Debug for ReplicaTile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ReplicaTile").field("receptions", &self.receptions.len()).finish_non_exhaustive()
    }
}

/// The received cells of a replica: labels, times of reception, and figures of the whole map that would take long to count.
#[derive(Debug)]
pub(super) struct ReplicaTiles {
    tiles: SharedTiles,
    received: usize,
    /// The number of cells of each label.
    counts: [u32; MAX_LABEL as usize + 2],
    bounds: Option<Rect>,
}

impl Default for ReplicaTiles {
    fn default() -> Self {
        Self { tiles: BTreeMap::new(), received: 0, counts: [0; MAX_LABEL as usize + 2], bounds: None }
    }
}

fn key(cell: Cell) -> ReplicaTileKey {
    (cell.y.div_euclid(REPLICA_TILE), cell.x.div_euclid(REPLICA_TILE))
}

fn place(cell: Cell) -> usize {
    (cell.y.rem_euclid(REPLICA_TILE) * REPLICA_TILE + cell.x.rem_euclid(REPLICA_TILE)) as usize
}

impl ReplicaTiles {
    pub(super) fn tiles(&self) -> &SharedTiles {
        &self.tiles
    }

    pub(super) fn received_cells(&self) -> usize {
        self.received
    }

    pub(super) fn received_at(&self, cell: Cell) -> Option<Instant> {
        let tile = self.tiles.get(&key(cell))?;
        Some(tile.reception(*tile.received.get(place(cell))?)?.at)
    }

    /// Every cell that a chunk has covered, with its label and when that was received, tile by tile.
    pub(super) fn cells(&self) -> impl Iterator<Item = (Cell, u8, Instant)> + '_ {
        self.cells_apart_from(&NO_TILES)
    }

    /// [`Self::cells`] without the tiles that are the same as those of `earlier`, an earlier copy of [`Self::tiles`].
    pub(super) fn cells_apart_from<'a>(
        &'a self,
        earlier: &'a SharedTiles,
    ) -> impl Iterator<Item = (Cell, u8, Instant)> + 'a {
        let is_other = |key, tile| earlier.get(key).is_none_or(|known| !Arc::ptr_eq(known, tile));
        self.tiles.iter().filter(move |(key, tile)| is_other(*key, *tile)).flat_map(|(&(row, column), tile)| {
            let cells = (0i32..).zip(&tile.labels).zip(&tile.received);
            cells.filter_map(move |((place, &label), &index)| {
                let (x, y) = (place % REPLICA_TILE, place / REPLICA_TILE);
                let cell = Cell::new(column.wrapping_mul(REPLICA_TILE) + x, row.wrapping_mul(REPLICA_TILE) + y);
                Some((cell, label, tile.reception(index)?.at))
            })
        })
    }

    /// Labels on the map with the number of their cells.
    pub(super) fn counts(&self) -> impl Iterator<Item = (u8, u32)> + '_ {
        (0..=u8::MAX).zip(self.counts).filter(|&(label, cells)| label > 0 && cells > 0)
    }

    pub(super) fn bounds(&self) -> Option<Rect> {
        self.bounds
    }

    /// Whether the replica has room for these cells.
    pub(super) fn has_room(&self, changes: &[(Cell, u8)]) -> bool {
        if self.tiles.len() + changes.len() <= MAX_TILES {
            return true;
        }
        let mut new: Vec<ReplicaTileKey> = changes.iter().map(|&(cell, _)| key(cell)).collect();
        new.sort_unstable();
        new.dedup();
        new.retain(|key| !self.tiles.contains_key(key));
        self.tiles.len() + new.len() <= MAX_TILES
    }

    /// Enters a cell of frame `number` and returns its label until now; `None` if a later frame has covered the cell.
    pub(super) fn receive(&mut self, cell: Cell, label: u8, number: u64, at: Instant) -> Option<u8> {
        let shared = self.tiles.entry(key(cell)).or_insert_with(|| Arc::new(ReplicaTile::EMPTY));
        let place = place(cell);
        let held = shared.received.get(place).and_then(|&index| shared.reception(index));
        if held.is_some_and(|held| held.number > number) {
            return None;
        }
        let tile = Arc::make_mut(shared);
        let index = tile.enter(CellReception { number, at });
        *tile.received.get_mut(place)? = index;
        let old = std::mem::replace(tile.labels.get_mut(place)?, label);
        self.received += usize::from(held.is_none());
        self.count(cell, old, label);
        Some(old)
    }

    fn count(&mut self, cell: Cell, old: u8, label: u8) {
        if old == label {
            return;
        }
        let mut add = |label: u8, by: i32| {
            if let Some(count) = self.counts.get_mut(usize::from(label)) {
                *count = count.saturating_add_signed(by);
            }
        };
        add(old, -1);
        add(label, 1);
        if label == 0 {
            self.bounds = self.measure();
        } else if self.bounds.is_none_or(|b| !b.contains(cell)) {
            let (west, south) = self.bounds.map_or((cell.x, cell.y), |b| (b.x, b.y));
            let last = |first: i32, count: u32| first.wrapping_add_unsigned(count.wrapping_sub(1));
            let (east, north) = self.bounds.map_or((cell.x, cell.y), |b| (last(b.x, b.width), last(b.y, b.height)));
            self.bounds = Rect::around([Cell::new(west, south), Cell::new(east, north), cell]);
        }
    }

    /// The bounds from the cells themselves, for the rare case that a cell became unexplored.
    fn measure(&self) -> Option<Rect> {
        Rect::around(self.tiles.iter().flat_map(|(&(row, column), tile)| {
            (0i32..).zip(&tile.labels).filter(|&(_, &label)| label != 0).map(move |(place, _)| {
                let (x, y) = (place % REPLICA_TILE, place / REPLICA_TILE);
                Cell::new(column.wrapping_mul(REPLICA_TILE) + x, row.wrapping_mul(REPLICA_TILE) + y)
            })
        }))
    }
}

/// Cells of a tile by index, one bit each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct TileSet([u64; TILE_CELLS / 64]);

impl TileSet {
    pub(super) fn contains(&self, cell: u8) -> bool {
        self.word(cell).is_some_and(|word| word >> (cell % 64) & 1 == 1)
    }

    /// Adds a cell or removes it.
    pub(super) fn set(&mut self, cell: u8, inside: bool) {
        if let Some(word) = self.0.get_mut(usize::from(cell / 64)) {
            *word = *word & !(1 << (cell % 64)) | u64::from(inside) << (cell % 64);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0 == [0; TILE_CELLS / 64]
    }

    /// The cells of `self` that are in neither of the other sets.
    pub(super) fn without(&self, one: &Self, other: &Self) -> Self {
        let mut left = *self;
        for ((word, one), other) in left.0.iter_mut().zip(one.0).zip(other.0) {
            *word &= !(one | other);
        }
        left
    }

    /// The cells on a lattice. Four rows of a tile share a word, and the rows of the lattice begin with the tile's.
    pub(super) fn on(&self, stride: Stride) -> Self {
        let mask = match stride {
            Stride::One => u64::MAX,
            Stride::Four => 0x1111,
        };
        Self(self.0.map(|word| word & mask))
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = u8> + use<> {
        [0u8, 64, 128, 192].into_iter().zip(self.0).flat_map(|(first, word)| {
            let mut left = word;
            std::iter::from_fn(move || {
                let bit = left.trailing_zeros() as u8;
                (left != 0).then(|| {
                    left &= left - 1;
                    first + bit
                })
            })
        })
    }

    fn word(&self, cell: u8) -> Option<&u64> {
        self.0.get(usize::from(cell / 64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(s)
    }

    #[test]
    fn counts_and_bounds_follow_every_change() {
        let mut tiles = ReplicaTiles::default();
        let corners = [(-100, 7), (70_000, -70_000), (i32::MAX, i32::MIN), (3, 3)];
        for (i, (x, y)) in corners.into_iter().enumerate() {
            assert_eq!(tiles.receive(Cell::new(x, y), 5, i as u64, at(1.0)), Some(0));
        }
        assert_eq!(tiles.bounds(), Rect::around(corners.map(|(x, y)| Cell::new(x, y))));
        assert_eq!(tiles.receive(Cell::new(i32::MAX, i32::MIN), 0, 9, at(2.0)), Some(5));
        assert_eq!(tiles.receive(Cell::new(3, 3), 8, 9, at(2.0)), Some(5));
        assert_eq!(tiles.bounds(), Some(Rect { x: -100, y: -70_000, width: 70_101, height: 70_008 }));
        assert_eq!(tiles.counts().collect::<Vec<_>>(), [(5, 2), (8, 1)]);
        assert_eq!((tiles.received_cells(), tiles.tiles().len()), (4, 4));
    }

    #[test]
    fn a_tile_that_a_reader_holds_does_not_change_for_him() {
        let mut tiles = ReplicaTiles::default();
        tiles.receive(Cell::new(1, 1), 5, 1, at(1.0));
        tiles.receive(Cell::new(100, 1), 5, 1, at(1.0));
        let held = tiles.tiles().clone();
        assert_eq!(tiles.receive(Cell::new(1, 1), 6, 0, at(2.0)), None, "an earlier frame");
        assert_eq!(tiles.receive(Cell::new(1, 1), 6, 2, at(2.0)), Some(5));
        let same = |key| Arc::ptr_eq(&held[&key], &tiles.tiles()[&key]);
        assert_eq!((same((0, 0)), same((0, 1))), (false, true));
        assert_eq!((held[&(0, 0)].labels()[65], tiles.tiles()[&(0, 0)].labels()[65]), (5, 6));
        assert_eq!(tiles.received_at(Cell::new(1, 1)), Some(at(2.0)));
    }

    #[test]
    fn times_of_reception_survive_any_number_of_frames() {
        let mut tiles = ReplicaTiles::default();
        for i in 0..100_000u64 {
            tiles.receive(Cell::new((i % 64) as i32, (i / 64 % 3) as i32), 1, i, Instant::ZERO);
        }
        tiles.receive(Cell::new(9, 9), 1, 100_000, at(7.0));
        assert_eq!(tiles.received_at(Cell::new(9, 9)), Some(at(7.0)));
        assert_eq!(tiles.received_at(Cell::new(0, 0)), Some(Instant::ZERO));
        assert_eq!((tiles.received_at(Cell::new(0, 5)), tiles.received_cells()), (None, 3 * 64 + 1));
    }

    #[test]
    fn cells_in_more_places_than_allowed_have_no_room() {
        let mut tiles = ReplicaTiles::default();
        for i in 0..MAX_TILES as i32 {
            tiles.receive(Cell::new(i * REPLICA_TILE, 0), 1, 1, Instant::ZERO);
        }
        assert!(tiles.has_room(&[(Cell::new(5, 5), 1), (Cell::new(70, 7), 2)]));
        assert!(!tiles.has_room(&[(Cell::new(5, 64), 1)]));
    }

    #[test]
    fn cells_are_listed_in_order_until_removed() {
        let mut set = TileSet::default();
        for cell in [255, 0, 64, 63, 7] {
            set.set(cell, true);
        }
        assert_eq!(set.iter().collect::<Vec<_>>(), [0, 7, 63, 64, 255]);
        set.set(63, false);
        assert!(set.len() == 4 && !set.contains(63) && set.contains(64));
        assert_eq!(set.on(Stride::Four).iter().collect::<Vec<_>>(), [0, 64]);
        assert!(set.without(&set, &TileSet::default()).is_empty());
    }
}
