//! The vehicle's side of the map: what the surface is known to hold, what it ought to hold, what is on its way.

use super::{Cell, LabelGrid, MapDigest, StateSource, TILE, UNEXPLORED};
use crate::map_codec::{self, Codec};
use crate::time::Instant;
use std::collections::BTreeMap;

type TileKey = (i32, i32);

fn tile_of(cell: Cell) -> TileKey {
    (cell.y.div_euclid(TILE), cell.x.div_euclid(TILE))
}

/// The map to be replicated.
///
/// Invariant: a cell is dirty exactly if its target label differs from what the surface is known to hold.
#[derive(Debug)]
pub struct MapSource {
    codec: Codec,
    /// What each label is worth to the operator, 0..=1.
    interest: [f64; 256],
    /// Learned size of the stream, bytes a changed cell.
    bytes_per_cell: f64,
    target: LabelGrid,
    acked: LabelGrid,
    acked_digest: MapDigest,
    /// Dirty cells by tile, with the time since when.
    dirty: BTreeMap<TileKey, BTreeMap<Cell, Instant>>,
    dirty_cells: usize,
    /// Cells in frames of unknown fate. At most one frame has a given cell.
    in_flight: BTreeMap<Cell, u8>,
    version: u64,
}

impl MapSource {
    /// An empty map that goes out by `codec`.
    pub fn new(codec: Codec) -> Self {
        Self {
            codec,
            interest: [0.0; 256],
            bytes_per_cell: 1.0,
            target: LabelGrid::default(),
            acked: LabelGrid::default(),
            acked_digest: MapDigest::default(),
            dirty: BTreeMap::new(),
            dirty_cells: 0,
            in_flight: BTreeMap::new(),
            version: 0,
        }
    }

    /// What each label is worth to the operator, 0..=1; what differs from his picture goes out in that order.
    pub fn set_interest(&mut self, weight: impl Fn(u8) -> f64) {
        for (label, worth) in (0..=u8::MAX).zip(self.interest.iter_mut()) {
            *worth = weight(label).abs().min(1.0);
        }
    }

    /// Makes every cell unexplored: labels mean something else from now on.
    pub fn clear(&mut self, now: Instant) {
        let labelled: Vec<Cell> = self.target.iter().map(|(cell, _)| cell).collect();
        self.set(labelled.into_iter().map(|cell| (cell, UNEXPLORED)), now);
    }

    /// Sets the labels that the surface ought to hold; returns how many changed. A change makes a new version.
    pub fn set(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        let mut changed = 0;
        for (cell, label) in cells {
            if self.target.set(cell, label) != label {
                changed += 1;
                self.refresh(cell, now);
            }
        }
        self.version += u64::from(changed > 0);
        changed
    }

    /// The map as the vehicle sees it.
    pub fn target(&self) -> &LabelGrid {
        &self.target
    }

    /// The map that the surface is known to hold.
    pub fn acked(&self) -> &LabelGrid {
        &self.acked
    }

    /// Versions so far.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Dirty cells that are not on their way.
    fn waiting_cells(&self) -> usize {
        let on_their_way = self.in_flight.keys().filter(|&&c| self.is_dirty(c)).count();
        self.dirty_cells - on_their_way
    }

    /// Worth of telling the operator that a cell has changed.
    fn worth(&self, old: u8, new: u8) -> f64 {
        let of = |label: u8| self.interest.get(usize::from(label)).copied().unwrap_or_default();
        let surprise = if old == UNEXPLORED { 1.0 } else { 0.5 };
        surprise * (0.2 + of(old).max(of(new)))
    }

    fn is_dirty(&self, cell: Cell) -> bool {
        self.target.get(cell) != self.acked.get(cell)
    }

    fn refresh(&mut self, cell: Cell, now: Instant) {
        let key = tile_of(cell);
        if self.is_dirty(cell) {
            let tile = self.dirty.entry(key).or_default();
            if let std::collections::btree_map::Entry::Vacant(entry) = tile.entry(cell) {
                entry.insert(now);
                self.dirty_cells += 1;
            }
        } else if let Some(tile) = self.dirty.get_mut(&key) {
            if tile.remove(&cell).is_some() {
                self.dirty_cells -= 1;
            }
            if tile.is_empty() {
                self.dirty.remove(&key);
            }
        }
    }

    /// The dirty cell to start from: the most valuable one of the most valuable tile.
    fn best_seed(&self, now: Instant) -> Option<Cell> {
        let value = |cell: Cell, since: Instant| {
            let age_s = 1.0 + now.since(since).as_secs_f64();
            self.worth(self.acked.get(cell), self.target.get(cell)) * age_s
        };
        let mut best: Option<(f64, Cell)> = None;
        for tile in self.dirty.values() {
            let mut sum = 0.0;
            let mut first: Option<(f64, Cell)> = None;
            for (&cell, &since) in tile.iter().filter(|(c, _)| !self.in_flight.contains_key(c)) {
                let v = value(cell, since);
                sum += v;
                if first.is_none_or(|(most, _)| v > most) {
                    first = Some((v, cell));
                }
            }
            if let Some((_, cell)) = first
                && best.is_none_or(|(most, _)| sum > most)
            {
                best = Some((sum, cell));
            }
        }
        best.map(|(_, cell)| cell)
    }
}

impl StateSource for MapSource {
    type Carried = Vec<(Cell, u8)>;

    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        let seed = self.best_seed(now)?;
        let wanted = |cell: Cell| !self.in_flight.contains_key(&cell);
        let chunk = map_codec::encode(self.codec, &self.acked, &self.target, seed, room, &wanted)?;
        let per_cell = chunk.bytes.len() as f64 / chunk.changes.len().max(1) as f64;
        self.bytes_per_cell += (per_cell - self.bytes_per_cell) * 0.1;
        self.in_flight.extend(chunk.changes.iter().copied());
        Some((chunk.bytes, chunk.changes))
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant) {
        for (cell, label) in carried {
            self.in_flight.remove(&cell);
            if delivered {
                let old = self.acked.set(cell, label);
                self.acked_digest.change(cell, old, label);
            }
            self.refresh(cell, now);
        }
    }

    fn handle_peer_restart(&mut self, now: Instant) {
        self.acked.clear();
        self.acked_digest = MapDigest::default();
        self.in_flight.clear();
        self.dirty.clear();
        self.dirty_cells = 0;
        let explored: Vec<Cell> = self.target.iter().map(|(c, _)| c).collect();
        for cell in explored {
            self.refresh(cell, now);
        }
    }

    fn backlog_bytes(&self) -> usize {
        (self.waiting_cells() as f64 * self.bytes_per_cell).ceil() as usize
    }

    fn is_settled(&self) -> bool {
        self.dirty_cells == 0 && self.in_flight.is_empty()
    }

    fn digest(&self) -> u16 {
        self.acked_digest.value()
    }
}
