//! The surface's side of the map: the picture, and the bases that the next chunks may refer to.

use super::{Cell, LabelGrid, MapDigest, StateReplica};
use crate::map_codec;
use crate::time::Instant;
use std::collections::BTreeMap;

/// What the replica knows of a cell besides its label.
#[derive(Debug, Clone, Copy)]
struct Heard {
    number: u64,
    at: Instant,
}

/// The operator's copy of a vehicle's map.
///
/// Invariant: `shown` is `base` with the changes of `log` applied in the order of frame numbers.
#[derive(Debug, Default)]
pub struct Replica {
    base: LabelGrid,
    base_digest: MapDigest,
    log: BTreeMap<u64, Vec<(Cell, u8)>>,
    shown: LabelGrid,
    heard: BTreeMap<Cell, Heard>,
    version: u64,
    updated: Option<Instant>,
}

impl Replica {
    /// The map to show.
    pub fn shown(&self) -> &LabelGrid {
        &self.shown
    }

    /// When [`Self::shown`] was last confirmed or changed by the vehicle.
    pub fn updated(&self) -> Option<Instant> {
        self.updated
    }

    /// When a cell was last heard of.
    pub fn heard(&self, cell: Cell) -> Option<Instant> {
        self.heard.get(&cell).map(|h| h.at)
    }
}

impl StateReplica for Replica {
    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool {
        let Ok(changes) = map_codec::decode(&self.base, chunk) else { return false };
        self.updated = Some(now);
        let mut changed = false;
        for &(cell, label) in &changes {
            if self.heard.get(&cell).is_none_or(|h| h.number <= number) {
                self.heard.insert(cell, Heard { number, at: now });
                changed |= self.shown.set(cell, label) != label;
            }
        }
        self.version += u64::from(changed);
        self.log.entry(number).or_default().extend(changes);
        true
    }

    fn advance_base(&mut self, horizon: u64) {
        let later = self.log.split_off(&(horizon + 1));
        for (cell, label) in std::mem::replace(&mut self.log, later).into_values().flatten() {
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

    fn clear(&mut self) {
        *self = Self { version: self.version + 1, ..Self::default() };
    }
}
