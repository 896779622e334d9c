//! The labels that cells had before their present ones.

use super::cells::{pack, unpack};
use super::event::StoredCells;
use scenecast_protocol::map::{Cell, Replica};
use scenecast_protocol::time::Instant;
use std::collections::VecDeque;

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
