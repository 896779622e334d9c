//! The surface's side of the map: the map to show, the bases of the next chunks, and the fingerprint of a map.

use super::tiles::{ReplicaTiles, SharedTiles};
use super::{Cell, LabelGrid, MAX_LABEL, Rect, StateReplica, UNEXPLORED};
use crate::map_codec;
use crate::time::Instant;
use std::collections::BTreeMap;

/// The most cells that a replica knows, and the most changes that wait for the base: a few bytes
/// can claim a whole patch.
const MAX_CELLS: usize = 1 << 23;

/// The operator's copy of a vehicle's map.
///
/// Invariant: `shown` is `base` with the changes of `log` applied in the order of frame numbers.
#[derive(Debug, Default)]
pub struct Replica {
    base: LabelGrid,
    base_digest: MapDigest,
    log: BTreeMap<u64, Vec<(Cell, u8)>>,
    logged: usize,
    shown: LabelGrid,
    received: ReplicaTiles,
    version: u64,
    updated: Option<Instant>,
    relabelled: Relabelled,
}

/// Cells that were given another label than they had, and the bytes of their chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Relabelled {
    /// Cells, each as often as it changed.
    pub cells: u64,
    /// Bytes of the chunks on air; of one that brought new cells too, the share of the others.
    pub bytes: u64,
}

impl Relabelled {
    /// What was added since an earlier sum.
    #[must_use]
    pub fn since(self, before: Self) -> Self {
        Self { cells: self.cells - before.cells, bytes: self.bytes - before.bytes }
    }
}

impl Replica {
    /// The cells that were given another label, since the map began.
    pub fn relabelled(&self) -> Relabelled {
        self.relabelled
    }

    /// The map to show; it holds exactly the cells that were sent.
    pub fn shown(&self) -> &LabelGrid {
        &self.shown
    }

    /// The label to paint at a cell, and the side of the square that it stands for, in cells. A cell without a label
    /// shows that of the coarse cell for its block of 4 x 4 cells. [`Self::shown`] has only the cells that were sent.
    pub fn painted(&self, cell: Cell) -> Option<(u8, i32)> {
        [1, 4].into_iter().find_map(|n| {
            let corner = Cell::new(cell.x.div_euclid(n) * n, cell.y.div_euclid(n) * n);
            let label = self.shown.get(corner);
            (label != UNEXPLORED).then_some((label, n))
        })
    }

    /// When a chunk last changed or confirmed a cell of [`Self::shown`].
    pub fn updated(&self) -> Option<Instant> {
        self.updated
    }

    /// The number of cells that a chunk has covered.
    pub fn received_cells(&self) -> usize {
        self.received.received_cells()
    }

    /// Every cell that a chunk has covered, with its label and when that was received, tile by tile.
    pub fn cells(&self) -> impl Iterator<Item = (Cell, u8, Instant)> + '_ {
        self.received.cells()
    }

    /// [`Self::cells`] of the tiles that have changed since `earlier`, an earlier copy of [`Self::tiles`].
    pub fn cells_apart_from<'a>(&'a self, earlier: &'a SharedTiles) -> impl Iterator<Item = (Cell, u8, Instant)> + 'a {
        self.received.cells_apart_from(earlier)
    }

    /// Puts a cell back that an earlier run of the surface has received. Such a replica is only shown: it
    /// is no base of a chunk.
    pub fn restore(&mut self, cell: Cell, label: u8, at: Instant) {
        if !self.received.has_room(&[(cell, label)]) {
            return;
        }
        self.received.receive(cell, label, 0, at);
        self.shown.set(cell, label);
        self.updated = self.updated.max(Some(at));
        self.version += 1;
    }

    /// When a chunk last covered a cell.
    pub fn received_at(&self, cell: Cell) -> Option<Instant> {
        self.received.received_at(cell)
    }

    /// The cells of [`Self::shown`] and when they were received, in tiles. A tile that a reader has cloned stays as it is; a
    /// change of one of its cells, also of the time alone, makes another one.
    pub fn tiles(&self) -> &SharedTiles {
        self.received.tiles()
    }

    /// The labels of [`Self::shown`] with the number of their cells, without a pass over the map.
    pub fn counts(&self) -> impl Iterator<Item = (u8, u32)> + '_ {
        self.received.counts()
    }

    /// The smallest rectangle around the explored cells of [`Self::shown`], without a pass over the map.
    pub fn bounds(&self) -> Option<Rect> {
        self.received.bounds()
    }
}

impl Replica {
    /// Whether a chunk with labels up to `max_label` decodes with the base that `horizon` gives.
    pub(super) fn decodes_up_to(&self, max_label: u8, horizon: u64, chunk: &[u8]) -> bool {
        let mut later = self.log.range(..=horizon).flat_map(|(_, changes)| changes).peekable();
        let decoded = match later.peek() {
            None => map_codec::decode(&self.base, chunk),
            Some(_) => {
                let mut base = self.base.clone();
                for &(cell, label) in later {
                    base.set(cell, label);
                }
                map_codec::decode(&base, chunk)
            }
        };
        decoded.is_ok_and(|changes| {
            let is_large = self.received_cells() + changes.len() > MAX_CELLS || !self.received.has_room(&changes);
            !is_large && changes.iter().all(|&(_, label)| label <= max_label)
        })
    }

    /// Applies a chunk of frame `number`, unless it does not decode here or has a label above `max_label`.
    pub(super) fn apply_up_to(&mut self, max_label: u8, number: u64, chunk: &[u8], now: Instant) -> bool {
        let Ok(changes) = map_codec::decode(&self.base, chunk) else { return false };
        let is_large = self.received_cells().max(self.logged) + changes.len() > MAX_CELLS;
        if is_large || !self.received.has_room(&changes) || changes.iter().any(|&(_, label)| label > max_label) {
            return false;
        }
        self.updated = Some(now);
        let (mut changed, mut relabelled) = (0, 0);
        for &(cell, label) in &changes {
            if self.received.receive(cell, label, number, now).is_some() {
                let before = self.shown.set(cell, label);
                changed += u64::from(before != label);
                relabelled += u64::from(before != label && before != UNEXPLORED);
            }
        }
        self.version += u64::from(changed > 0);
        self.relabelled.cells += relabelled;
        self.relabelled.bytes += (chunk.len() as u64 * relabelled).checked_div(changed).unwrap_or(0);
        self.logged += changes.len();
        self.log.entry(number).or_default().extend(changes);
        true
    }
}

impl StateReplica for Replica {
    fn decodes(&self, horizon: u64, chunk: &[u8]) -> bool {
        self.decodes_up_to(MAX_LABEL, horizon, chunk)
    }

    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool {
        self.apply_up_to(MAX_LABEL, number, chunk, now)
    }

    fn advance_base(&mut self, horizon: u64) {
        let later = self.log.split_off(&(horizon + 1));
        for (cell, label) in std::mem::replace(&mut self.log, later).into_values().flatten() {
            self.logged -= 1;
            let old = self.base.set(cell, label);
            self.base_digest.change(cell, old, label);
        }
    }

    fn base_digest(&self) -> u16 {
        self.base_digest.value()
    }

    fn version(&self) -> u64 {
        self.version
    }

    fn size(&self) -> usize {
        self.received_cells()
    }

    fn take(&mut self) -> Self {
        let empty = Self { version: self.version + 1, ..Self::default() };
        std::mem::replace(self, empty)
    }
}

/// A 16-bit fingerprint of a set of labelled cells; it does not depend on the order in which they were set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MapDigest(u64);

impl MapDigest {
    /// Updates the fingerprint for a cell whose label changes from `old` to `new`.
    pub fn change(&mut self, cell: Cell, old: u8, new: u8) {
        self.0 ^= term(cell, old) ^ term(cell, new);
    }

    /// The low 16 bits of the sum over all cells.
    pub fn value(self) -> u16 {
        (self.0 ^ self.0 >> 16 ^ self.0 >> 32 ^ self.0 >> 48) as u16
    }
}

/// The mixing function of SplitMix64 over cell and label; 0 for an unexplored cell.
fn term(cell: Cell, label: u8) -> u64 {
    if label == 0 {
        return 0;
    }
    let place = u64::from(cell.x as u32) << 32 | u64::from(cell.y as u32);
    let mut z = place.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ u64::from(label).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map_codec::{Codec, encode};

    #[test]
    fn chunks_that_claim_too_many_cells_are_refused() {
        let target: LabelGrid = (0..100).map(|i| (Cell::new(i % 10, i / 10), 7)).collect();
        let chunk = encode(Codec::Png, &LabelGrid::default(), &target, Cell::new(5, 5), 200, &|_| true).unwrap();
        let mut replica = Replica { logged: MAX_CELLS - 150, ..Replica::default() };
        assert!(replica.apply(1, &chunk.bytes, Instant::ZERO));
        assert!(!replica.apply(2, &chunk.bytes, Instant::ZERO));
        replica.advance_base(1);
        assert_eq!((replica.logged, replica.base.explored()), (MAX_CELLS - 150, 100));
    }
}
