//! A grid, and the part of it that the vehicle has been given: only cells that differ are given.

use scenecast_protocol::map::{Cell, LabelGrid, TILE};
use std::collections::BTreeSet;

/// Row and column of a square of [`TILE`] x [`TILE`] cells.
type Square = (i32, i32);

/// A grid of labels or levels whose changes are given away in slices.
#[derive(Debug, Clone, Default)]
pub(super) struct ChangingGrid {
    grid: LabelGrid,
    /// The cells as they were last given away.
    given: LabelGrid,
    /// Squares in which cells may differ from `given`.
    changed: BTreeSet<Square>,
    /// The square after the last one that was looked at, so that none waits for those before it.
    next: Square,
}

/// Two are equal if their cells are, whatever was given away.
impl PartialEq for ChangingGrid {
    fn eq(&self, other: &Self) -> bool {
        self.grid == other.grid
    }
}

impl ChangingGrid {
    /// A grid of which nothing was given away.
    pub(super) fn new(grid: LabelGrid) -> Self {
        let changed = grid.iter().map(|(cell, _)| square(cell)).collect();
        Self { grid, changed, ..Self::default() }
    }

    pub(super) fn grid(&self) -> &LabelGrid {
        &self.grid
    }

    /// Sets a cell; returns its value until now.
    pub(super) fn set(&mut self, cell: Cell, value: u8) -> u8 {
        let before = self.grid.set(cell, value);
        if before != value {
            self.changed.insert(square(cell));
        }
        before
    }

    /// Whether cells may have changed since they were given away.
    pub(super) fn has_changes(&self) -> bool {
        !self.changed.is_empty()
    }

    /// Gives away changed cells with their values, at least `most` of them if there are so many, and less than a square more.
    pub(super) fn take(&mut self, most: usize) -> Vec<(Cell, u8)> {
        let mut cells = Vec::new();
        while cells.len() < most {
            let found = self.changed.range(self.next..).next().or_else(|| self.changed.first());
            let Some(&(row, column)) = found else { break };
            self.changed.remove(&(row, column));
            self.next = (row, column.saturating_add(1));
            let (x, y, edge) = (i64::from(column) * i64::from(TILE), i64::from(row) * i64::from(TILE), TILE as usize);
            let (now, before) = (self.grid.copy_area(x, y, edge, edge), self.given.copy_area(x, y, edge, edge));
            for (at, (&value, _)) in now.iter().zip(&before).enumerate().filter(|(_, (now, before))| now != before) {
                let cell = Cell::new(x as i32 + at as i32 % TILE, y as i32 + at as i32 / TILE);
                self.given.set(cell, value);
                cells.push((cell, value));
            }
        }
        cells
    }
}

fn square(cell: Cell) -> Square {
    (cell.y.div_euclid(TILE), cell.x.div_euclid(TILE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_of_changes_add_up_to_the_grid() {
        let mut grid = ChangingGrid::default();
        let cell = |i: i32| Cell::new(i * 37 % 101 - 50, i * 53 % 89 - 40);
        for i in 0..3000 {
            grid.set(cell(i), (i % 250) as u8);
        }
        let mut given = LabelGrid::default();
        let mut slices = 0;
        while grid.has_changes() {
            let slice = grid.take(500);
            assert!(slice.len() < 500 + 256);
            given.extend(slice);
            slices += 1;
        }
        assert!(slices > 3 && given == *grid.grid());
        grid.set(cell(7), 99);
        grid.set(cell(8), 98);
        grid.set(cell(8), 8);
        assert_eq!(grid.take(10), [(cell(7), 99)], "a cell that is as it was is not given again");
        assert!(grid.take(10).is_empty());
        let restored = ChangingGrid::new(grid.grid().clone());
        assert!(restored == grid && restored.has_changes());
    }

    #[test]
    fn squares_that_change_all_the_time_leave_room_to_others() {
        let mut grid = ChangingGrid::default();
        for i in 0..10 {
            grid.set(Cell::new(i * TILE, 0), 1);
        }
        let mut seen = BTreeSet::new();
        for value in 2..12 {
            grid.set(Cell::new(0, 0), value);
            seen.extend(grid.take(1).into_iter().map(|(cell, _)| cell.x / TILE));
        }
        assert_eq!(seen.len(), 10);
    }
}
