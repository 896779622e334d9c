//! Copies of maps: what the surface has received, cell by cell, with its time, and the labels that cells had before.

use super::event::{StoredCells, StoredContact};
use crate::label_book::LabelBook;
use scenecast_protocol::map::{Cell, LabelTree, LayerDescriptor, LayerId, LayerReplica, Replica, SharedTiles};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Placement;
use std::collections::{BTreeMap, VecDeque};
use std::fmt;

/// Cells in one event; a larger change takes several.
const MAX_CELLS: usize = 1 << 16;

/// A copy of a map with its layers.
#[derive(Default)]
pub struct MapCopy {
    labels: Replica,
    layers: BTreeMap<LayerId, LayerReplica>,
}

/// Without the cells, of which there may be a million.
impl fmt::Debug for MapCopy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("MapCopy").field("explored", &self.explored()).finish_non_exhaustive()
    }
}

/// A map that the surface has received before the current one, and that stays in view.
#[derive(Debug)]
pub struct EarlierMap {
    /// Counts the runs of the vehicle that this surface has met.
    pub run: u32,
    /// The epoch of its labels.
    pub epoch: u8,
    /// The operator's names of its labels.
    pub names: LabelBook,
    /// The last tree of its labels.
    pub tree: Option<LabelTree>,
    pub map: MapCopy,
    /// The last report of its run.
    pub(crate) contact: StoredContact,
}

impl EarlierMap {
    /// The placement of the map in its run; `None` while no fix had moved it.
    pub fn placement(&self) -> Option<Placement> {
        self.contact.status()?.0.placement
    }
}

impl MapCopy {
    /// The labels, with the time of each cell.
    pub fn labels(&self) -> &Replica {
        &self.labels
    }

    pub fn layers(&self) -> impl Iterator<Item = (LayerId, &LayerReplica)> {
        self.layers.iter().map(|(&id, layer)| (id, layer))
    }

    /// The number of cells with a label.
    pub fn explored(&self) -> usize {
        self.labels.counts().map(|(_, cells)| cells as usize).sum()
    }

    /// Applies stored cells. Cells of a layer whose descriptor is unreadable are left out.
    pub(crate) fn apply(&mut self, stored: &StoredCells) {
        let Some((index, descriptor)) = &stored.layer else {
            unpack(&stored.cells).for_each(|(cell, label, at)| self.labels.restore(cell, label, at));
            return;
        };
        let id = LayerId::new(usize::from(*index));
        let (Some(id), Some(descriptor)) = (id, LayerDescriptor::from_bytes(descriptor)) else { return };
        let layer = self.layers.entry(id).or_insert_with(|| LayerReplica::new(descriptor.clone()));
        if *layer.descriptor() != descriptor {
            *layer = LayerReplica::new(descriptor);
        }
        unpack(&stored.cells).for_each(|(cell, level, at)| layer.restore(cell, level, at));
    }

    /// The events that change this copy of the labels into `live`.
    pub(crate) fn label_changes(&self, live: impl Iterator<Item = (Cell, u8, Instant)>) -> Vec<StoredCells> {
        pack(None, changed(&self.labels, live))
    }

    /// The events that change this copy of a layer into `live`. It is equal to `live` in the tiles of `compared`.
    pub(crate) fn layer_changes(&self, id: LayerId, live: &LayerReplica, compared: &SharedTiles) -> Vec<StoredCells> {
        let head = Some((id.index() as u8, live.descriptor().to_bytes()));
        match self.layers.get(&id).filter(|kept| kept.descriptor() == live.descriptor()) {
            Some(kept) => pack(head, changed(kept.levels(), live.levels().cells_apart_from(compared))),
            None => pack(head, live.levels().cells().collect()),
        }
    }

    /// The events that make this copy from nothing.
    pub(crate) fn to_events(&self) -> Vec<StoredCells> {
        let mut all = pack(None, self.labels.cells().collect());
        for (id, layer) in &self.layers {
            let head = Some((id.index() as u8, layer.descriptor().to_bytes()));
            all.extend(pack(head, layer.levels().cells().collect()));
        }
        all
    }
}

fn changed(kept: &Replica, live: impl Iterator<Item = (Cell, u8, Instant)>) -> Vec<(Cell, u8, Instant)> {
    let is_new = |&(cell, value, at): &(Cell, u8, Instant)| {
        kept.received_at(cell) != Some(at) || kept.shown().get(cell) != value
    };
    live.filter(is_new).collect()
}

pub(super) fn pack(layer: Option<(u8, Vec<u8>)>, cells: Vec<(Cell, u8, Instant)>) -> Vec<StoredCells> {
    let mut events = Vec::new();
    for part in cells.chunks(MAX_CELLS) {
        let mut before = (0, 0, 0);
        let packed = part.iter().map(|&(cell, value, at)| {
            let now = (i64::from(cell.x), i64::from(cell.y), at.as_micros() as i64);
            let last = std::mem::replace(&mut before, now);
            (now.0 - last.0, now.1 - last.1, value, now.2.wrapping_sub(last.2))
        });
        events.push(StoredCells { layer: layer.clone(), cells: packed.collect() });
    }
    events
}

pub(super) fn unpack(cells: &[(i64, i64, u8, i64)]) -> impl Iterator<Item = (Cell, u8, Instant)> + '_ {
    let mut at = (0i64, 0i64, 0i64);
    cells.iter().filter_map(move |&(x, y, value, time)| {
        at = (at.0.wrapping_add(x), at.1.wrapping_add(y), at.2.wrapping_add(time));
        let cell = Cell::new(i32::try_from(at.0).ok()?, i32::try_from(at.1).ok()?);
        Some((cell, value, Instant::from_micros(at.2 as u64)))
    })
}

/// Changes of labels on a map, the newest last: cell, former label, and when another one replaced it.
#[derive(Debug, Clone, Default)]
pub(crate) struct FormerLabels {
    changes: VecDeque<(Cell, u8, Instant)>,
}

impl FormerLabels {
    /// The most changes that are kept, of all cells.
    const MAX: usize = 1 << 17;

    /// Follows cells that are about to be applied to the labels `before`.
    pub(crate) fn handle_cells(&mut self, before: &Replica, cells: &StoredCells) {
        if cells.layer.is_some() {
            return;
        }
        for (cell, label, at) in unpack(&cells.cells) {
            let former = before.shown().get(cell);
            if former != 0 && former != label {
                self.push((cell, former, at));
            }
        }
    }

    /// Adds the changes that the store has kept.
    pub(crate) fn restore(&mut self, stored: &StoredCells) {
        unpack(&stored.cells).for_each(|change| self.push(change));
    }

    fn push(&mut self, change: (Cell, u8, Instant)) {
        if self.changes.len() == Self::MAX {
            self.changes.pop_front();
        }
        self.changes.push_back(change);
    }

    /// The former labels of a cell with the times of their replacement, the newest first.
    pub(crate) fn of(&self, cell: Cell) -> impl Iterator<Item = (u8, Instant)> + '_ {
        self.changes.iter().rev().filter(move |(at, ..)| *at == cell).map(|&(_, label, until)| (label, until))
    }

    /// The changes, the oldest first.
    pub(crate) fn to_events(&self) -> Vec<StoredCells> {
        pack(None, self.changes.iter().copied().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn changes_make_the_copy_equal_to_the_live_map(
            first in proptest::collection::btree_map((any::<i32>(), -40i32..40), (0u8..5, any::<u64>()), 0..80),
            second in proptest::collection::btree_map((any::<i32>(), -40i32..40), (0u8..5, any::<u64>()), 0..80),
        ) {
            let mut copy = MapCopy::default();
            let mut live = Replica::default();
            for cells in [first, second] {
                for ((x, y), (label, at)) in cells {
                    live.restore(Cell::new(x, y), label, Instant::from_micros(at));
                }
                copy.label_changes(live.cells()).iter().for_each(|event| copy.apply(event));
                prop_assert!(copy.labels().cells().eq(live.cells()));
                prop_assert_eq!(copy.explored(), live.shown().explored());
                prop_assert!(copy.label_changes(live.cells()).is_empty());
            }
            let mut again = MapCopy::default();
            copy.to_events().iter().for_each(|event| again.apply(event));
            prop_assert!(again.labels().cells().eq(live.cells()));
        }
    }

    fn stored(cells: &[(i32, u8, u64)]) -> StoredCells {
        let cells = cells.iter().map(|&(x, label, s)| (Cell::new(x, -3), label, Instant::from_micros(s * 1_000_000)));
        pack(None, cells.collect()).remove(0)
    }

    fn of(former: &FormerLabels, x: i32) -> Vec<(u8, f64)> {
        former.of(Cell::new(x, -3)).map(|(label, until)| (label, until.as_secs_f64())).collect()
    }

    #[test]
    fn a_cell_keeps_each_label_that_another_one_replaced() {
        let (mut former, mut labels) = (FormerLabels::default(), Replica::default());
        for cells in [&[(0, 4, 10), (1, 4, 10)][..], &[(0, 4, 20)], &[(0, 7, 30)], &[(0, 0, 40)], &[(0, 5, 50)]] {
            let cells = stored(cells);
            former.handle_cells(&labels, &cells);
            unpack(&cells.cells).for_each(|(cell, label, at)| labels.restore(cell, label, at));
        }
        assert_eq!(of(&former, 0), [(7, 40.0), (4, 30.0)]);
        assert_eq!(of(&former, 1), []);
        let mut again = FormerLabels::default();
        former.to_events().iter().for_each(|event| again.restore(event));
        assert_eq!(of(&again, 0), of(&former, 0));
    }

    #[test]
    fn the_oldest_changes_give_way_to_new_ones() {
        let mut former = FormerLabels::default();
        let change = |x, s| stored(&[(x, 9, s)]);
        former.restore(&change(-1, 1));
        (0..FormerLabels::MAX as i32).for_each(|x| former.restore(&change(x, 2)));
        assert_eq!((former.changes.len(), of(&former, -1).len(), of(&former, 0).len()), (FormerLabels::MAX, 0, 1));
    }
}
