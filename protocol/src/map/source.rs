//! The vehicle's side of the map: what the surface is known to hold, what it ought to hold, what is on its way.

use super::{Cell, LabelGrid, MapDigest, TILE};
use crate::map_codec::{self, Codec, MapChunk};
use crate::time::Instant;
use std::collections::BTreeMap;

/// Worth of telling the operator about a cell: from its old and new label, 0 where unexplored.
pub type CellWorth<'a> = dyn Fn(u8, u8) -> f64 + 'a;

type TileKey = (i32, i32);

fn tile_of(cell: Cell) -> TileKey {
    (cell.y.div_euclid(TILE), cell.x.div_euclid(TILE))
}

/// The map to be replicated.
///
/// Invariant: a cell is dirty exactly if its target label differs from what the surface is known to hold.
#[derive(Debug, Default)]
pub struct MapSource {
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

    /// Fingerprint of [`Self::acked`].
    pub fn acked_digest(&self) -> u16 {
        self.acked_digest.value()
    }

    /// Versions so far.
    pub fn version(&self) -> u64 {
        self.version
    }

    /// Whether the surface is known to hold the target.
    pub fn is_settled(&self) -> bool {
        self.dirty_cells == 0 && self.in_flight.is_empty()
    }

    /// Dirty cells that are not on their way.
    pub fn backlog_cells(&self) -> usize {
        let waiting = self.in_flight.keys().filter(|&&c| self.is_dirty(c)).count();
        self.dirty_cells - waiting
    }

    /// The most useful chunk of at most `room` bytes, if anything is left to say.
    pub fn next_chunk(&self, codec: Codec, room: usize, now: Instant, worth: &CellWorth<'_>) -> Option<MapChunk> {
        let seed = self.best_seed(now, worth)?;
        let wanted = |cell: Cell| !self.in_flight.contains_key(&cell);
        map_codec::encode(codec, &self.acked, &self.target, seed, room, &wanted)
    }

    /// A frame with these changes was written.
    pub fn mark_in_flight(&mut self, changes: &[(Cell, u8)]) {
        self.in_flight.extend(changes.iter().copied());
    }

    /// The fate of a frame with these changes is known. Fates must be told in the order of frame numbers.
    pub fn handle_fate(&mut self, changes: &[(Cell, u8)], delivered: bool, now: Instant) {
        for &(cell, label) in changes {
            self.in_flight.remove(&cell);
            if delivered {
                let old = self.acked.set(cell, label);
                self.acked_digest.change(cell, old, label);
            }
            self.refresh(cell, now);
        }
    }

    /// The surface has lost its replica, or lost count: it is known to hold nothing.
    pub fn handle_peer_restart(&mut self, now: Instant) {
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
    fn best_seed(&self, now: Instant, worth: &CellWorth<'_>) -> Option<Cell> {
        let value = |cell: Cell, since: Instant| {
            let age_s = 1.0 + now.since(since).as_secs_f64();
            worth(self.acked.get(cell), self.target.get(cell)) * age_s
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
