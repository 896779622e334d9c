//! The vehicle's side of the map: the map itself, the surface's known copy, and the cells in flight.

use super::dirty::{CellChange, Coarse, Dirty};
use super::value::{Debounce, Hold, Interest};
use super::{Cell, LabelGrid, MAX_CONFIDENCE, MapDigest, StateSource, UNEXPLORED};
use crate::map_codec::{self, Codec, Stride};
use crate::time::Instant;
use std::time::Duration;

/// A map to be replicated.
///
/// Invariant: a cell is dirty exactly if its target label differs from the one that the surface is known to hold. A
/// dirty cell is in flight, held back until its label is stable, or waiting.
#[derive(Debug)]
pub struct MapSource {
    codec: Codec,
    /// Whether the peer reads bodies of the kind `png` alone.
    is_plain: bool,
    /// Whether chunks are made quickly rather than as small as possible.
    is_quick: bool,
    interest: Interest,
    debounce: Debounce,
    coarse: Coarse,
    /// A running estimate of bytes for each changed cell; the newest chunks weigh most.
    bytes_per_cell: f64,
    /// Bytes of recent chunks and the cells that they changed, exponentially weighted.
    spent: (f64, f64),
    target: LabelGrid,
    acked: LabelGrid,
    acked_digest: MapDigest,
    /// At most one frame of unknown fate has a given cell.
    dirty: Dirty,
    version: u64,
    flips_suppressed: u64,
}

impl MapSource {
    /// An empty map that is sent with `codec`, without debouncing.
    pub fn new(codec: Codec) -> Self {
        Self {
            codec,
            is_plain: false,
            is_quick: false,
            interest: Interest::default(),
            debounce: Debounce::default(),
            coarse: Coarse::default(),
            bytes_per_cell: 1.0,
            spent: (32.0, 32.0),
            target: LabelGrid::default(),
            acked: LabelGrid::default(),
            acked_digest: MapDigest::default(),
            dirty: Dirty::default(),
            version: 0,
            flips_suppressed: 0,
        }
    }

    /// Sets the operator's interest in each label, 0..=1, which decides the order of changes.
    pub fn set_interest(&mut self, weight: impl Fn(u8) -> f64) {
        self.interest = Interest::new(weight);
        self.dirty.revalue();
    }

    /// Sets how long a new label of a cell that the surface knows must be stable before it is sent: the wait of `hold` for
    /// a cell that has not flipped recently, up to eight times that for one that has. A difference is held back for at most
    /// sixteen times that wait.
    pub fn set_hold(&mut self, hold: Hold) {
        self.debounce.set_hold(hold);
    }

    /// As [`Self::set_hold`], with a wait that does not depend on the backlog.
    pub fn set_debounce(&mut self, usual: Duration) {
        self.set_hold(Hold::For(usual));
    }

    /// The number of cells that may be sent now.
    fn ready(&self) -> usize {
        let counts = self.dirty.counts();
        if counts.waiting == 0 && self.debounce.is_automatic() { counts.held } else { counts.waiting }
    }

    /// A backlog of more than about this many bytes goes out coarse to fine: first every fourth cell in both
    /// directions, then all. 0 means always, `None` never.
    pub fn set_coarse_limit(&mut self, after_bytes: Option<usize>) {
        self.coarse.set_limit(after_bytes);
    }

    /// Changes that were never sent, because they were reverted or superseded while they were held back.
    pub fn flips_suppressed(&self) -> u64 {
        self.flips_suppressed
    }

    /// Makes every cell unexplored, because labels change their meaning.
    pub fn clear(&mut self, now: Instant) {
        let labelled: Vec<Cell> = self.target.iter().map(|(cell, _)| cell).collect();
        self.set(labelled.into_iter().map(|cell| (cell, UNEXPLORED)), now);
    }

    /// Sets labels of cells; returns how many changed. Each call with a change makes a new version.
    pub fn set(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        self.set_confident(cells.into_iter().map(|(cell, label)| (cell, label, 0)), now)
    }

    /// As [`Self::set`], with the model's confidence in each label, 0 to [`MAX_CONFIDENCE`]; certain
    /// labels are not held back.
    pub fn set_confident(&mut self, cells: impl IntoIterator<Item = (Cell, u8, u8)>, now: Instant) -> usize {
        let mut changed = 0;
        let usual = self.debounce.hold().usual_wait(self.expected_backlog_bytes());
        for (cell, label, confidence) in cells {
            let old = self.target.set(cell, label);
            if old != label {
                changed += 1;
                self.note_change(cell, (old, label), (confidence, usual), now);
            } else if confidence >= MAX_CONFIDENCE {
                self.dirty.settle(cell);
            }
        }
        self.version += u64::from(changed > 0);
        changed
    }

    fn note_change(&mut self, cell: Cell, (old, label): (u8, u8), (confidence, usual): (u8, Duration), now: Instant) {
        let seen = old != UNEXPLORED && label != UNEXPLORED;
        let wait = if seen { self.debounce.flip(cell, confidence, usual, now) } else { Duration::ZERO };
        let acked = self.acked.get(cell);
        let change = CellChange {
            differs: label != acked,
            known: acked != UNEXPLORED,
            due: now + wait,
            longest: Debounce::longest(usual),
        };
        self.flips_suppressed += self.dirty.change(cell, change, now);
    }

    /// The map as the vehicle sees it.
    pub fn target(&self) -> &LabelGrid {
        &self.target
    }

    /// The map that the surface is known to hold.
    pub fn acked(&self) -> &LabelGrid {
        &self.acked
    }

    /// The number of versions so far.
    pub fn version(&self) -> u64 {
        self.version
    }
}

impl StateSource for MapSource {
    type Carried = Vec<(Cell, u8)>;

    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        if self.dirty.counts().waiting == 0 && self.debounce.is_automatic() {
            self.dirty.release_all();
        }
        let stride = self.coarse.stride(&self.dirty.counts());
        let seed = self.dirty.best(stride, &self.acked, &self.target, &self.interest, now)?;
        let (base, waiting) = (&self.acked, self.dirty.waiting());
        let codec = if self.is_plain { Codec::Png } else { self.codec };
        let chunk = match self.is_quick && codec != Codec::Png {
            true => {
                let per_change = self.spent.0 / self.spent.1.max(1.0);
                map_codec::encode_quickly(stride, base, &self.target, seed, room, &waiting, per_change)?
            }
            false => map_codec::encode_every(stride, codec, base, &self.target, seed, room, &waiting)?,
        };
        drop(waiting);
        if stride == Stride::One {
            let per_cell = chunk.bytes.len() as f64 / chunk.changes.len().max(1) as f64;
            self.bytes_per_cell += (per_cell - self.bytes_per_cell) * 0.1;
            let (bytes, cells) = self.spent;
            self.spent = (bytes * 0.9 + chunk.bytes.len() as f64, cells * 0.9 + chunk.changes.len() as f64);
        }
        chunk.changes.iter().for_each(|&(cell, _)| self.dirty.depart(cell));
        Some((chunk.bytes, chunk.changes))
    }

    fn set_quick(&mut self, is_quick: bool) {
        self.is_quick = is_quick;
    }

    fn set_plain(&mut self, is_plain: bool) {
        self.is_plain = is_plain;
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant) {
        for (cell, label) in carried {
            if delivered {
                let old = self.acked.set(cell, label);
                self.acked_digest.change(cell, old, label);
            }
            let acked = self.acked.get(cell);
            self.dirty.arrive(cell, delivered, acked != self.target.get(cell), acked != UNEXPLORED, now);
        }
    }

    fn handle_peer_restart(&mut self, now: Instant) {
        self.acked.clear();
        self.acked_digest = MapDigest::default();
        self.dirty.reset(&self.target, now);
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.dirty.release(now)
    }

    fn next_due(&self) -> Option<Instant> {
        self.dirty.next_due()
    }

    fn backlog_bytes(&self) -> usize {
        (self.ready() as f64 * self.bytes_per_cell).ceil() as usize
    }

    fn is_refining(&self) -> bool {
        self.coarse.is_refining(&self.dirty.counts())
    }

    fn expected_backlog_bytes(&self) -> usize {
        let (bytes, cells) = self.spent;
        (self.ready() as f64 * bytes / cells.max(1.0)).ceil() as usize
    }

    fn is_quiet(&self) -> bool {
        self.ready() == 0 && self.dirty.counts().flying == 0
    }

    fn is_converged(&self) -> bool {
        let counts = self.dirty.counts();
        counts.differing == 0 && counts.flying == 0
    }

    fn digest(&self) -> u16 {
        self.acked_digest.value()
    }
}

#[cfg(test)]
mod tests;
