//! Dense copies of a part of base and target.

use crate::grid::{Cell, MAX_LABEL, Rect};
use crate::map_codec::lattice::Lattice;

/// The base and the wanted changes in a square of cells.
#[derive(Debug)]
pub(super) struct GrowthWindow {
    /// South-west corner; it may lie off the 32-bit grid, where no cell is wanted.
    pub(super) x: i64,
    pub(super) y: i64,
    pub(super) side: usize,
    base: Vec<u8>,
    target: Vec<u8>,
    /// Cells to be sent, row by row.
    wanted: Vec<bool>,
}

impl GrowthWindow {
    /// The `2 * reach` square around `seed`.
    pub(super) fn around(
        base: Lattice<'_>,
        target: Lattice<'_>,
        seed: Cell,
        reach: usize,
        wanted: &dyn Fn(Cell) -> bool,
    ) -> Self {
        let side = 2 * reach;
        let (x, y) = (i64::from(seed.x) - reach as i64, i64::from(seed.y) - reach as i64);
        let base = base.copy_area(x, y, side, side);
        let target = target.copy_area(x, y, side, side);
        let wanted = (0..side * side)
            .map(|i| {
                let (old, new) = (base[i], target[i]);
                old != new && new <= MAX_LABEL && {
                    // A cell that holds a label lies on the grid.
                    wanted(Cell::new((x + (i % side) as i64) as i32, (y + (i / side) as i64) as i32))
                }
            })
            .collect();
        Self { x, y, side, base, target, wanted }
    }

    /// Whether the cell in `column` of `row` is to be sent.
    pub(super) fn is_wanted(&self, column: usize, row: usize) -> bool {
        self.wanted[row * self.side + column]
    }

    /// The new label of the cell, or its label in the base if the cell is not wanted.
    pub(super) fn outcome(&self, column: usize, row: usize) -> u8 {
        let i = row * self.side + column;
        if self.wanted[i] { self.target[i] } else { self.base[i] }
    }

    /// The part of the window in `area` as base and outcome.
    pub(super) fn patch(&self, area: Area) -> Patch {
        let rect = Rect {
            x: (self.x + area.left as i64) as i32,
            y: (self.y + area.bottom as i64) as i32,
            width: area.width() as u32,
            height: area.height() as u32,
        };
        let mut patch = Patch { rect, base: Vec::new(), outcome: Vec::new() };
        for row in area.bottom..area.top {
            for column in area.left..area.right {
                patch.base.push(self.base[row * self.side + column]);
                patch.outcome.push(self.outcome(column, row));
            }
        }
        patch
    }
}

/// A rectangle inside a window: columns `left..right`, rows `bottom..top`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Area {
    pub(super) left: usize,
    pub(super) right: usize,
    pub(super) bottom: usize,
    pub(super) top: usize,
}

impl Area {
    pub(super) fn width(&self) -> usize {
        self.right - self.left
    }

    pub(super) fn height(&self) -> usize {
        self.top - self.bottom
    }

    /// Grows to include the cell.
    pub(super) fn include(&mut self, column: usize, row: usize) {
        (self.left, self.right) = (self.left.min(column), self.right.max(column + 1));
        (self.bottom, self.top) = (self.bottom.min(row), self.top.max(row + 1));
    }

    pub(super) fn cells(&self) -> usize {
        self.width() * self.height()
    }
}

/// The content of a chunk: base and outcome of its patch, row by row; equal cells stay untouched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Patch {
    pub(super) rect: Rect,
    pub(super) base: Vec<u8>,
    pub(super) outcome: Vec<u8>,
}

impl Patch {
    pub(super) fn between(base: Lattice<'_>, target: Lattice<'_>, rect: Rect) -> Self {
        let (width, height) = (rect.width as usize, rect.height as usize);
        let copy = |grid: Lattice<'_>| grid.copy_area(i64::from(rect.x), i64::from(rect.y), width, height);
        let (base, mut outcome) = (copy(base), copy(target));
        // 255 is not a label: such a cell stays as it is.
        outcome.iter_mut().zip(&base).filter(|(new, _)| **new > MAX_LABEL).for_each(|(new, &old)| *new = old);
        Self { rect, base, outcome }
    }

    /// The smallest patch with just these changes.
    pub(super) fn of(base: Lattice<'_>, changes: &[(Cell, u8)]) -> Option<Self> {
        let rect = Rect::around(changes.iter().map(|&(cell, _)| cell))?;
        let mut patch = Self::between(base, base, rect);
        for &(cell, label) in changes {
            let row = cell.y.abs_diff(rect.y) as usize;
            patch.outcome[row * rect.width as usize + cell.x.abs_diff(rect.x) as usize] = label;
        }
        Some(patch)
    }

    /// The rows that hold the first `count` cells, with later cells unchanged.
    pub(super) fn first_cells(&self, count: usize) -> Self {
        let width = self.rect.width as usize;
        let height = count.div_ceil(width);
        let base = self.base[..height * width].to_vec();
        let mut outcome = self.outcome[..count].to_vec();
        outcome.extend(&base[count..]);
        Self { rect: Rect { height: height as u32, ..self.rect }, base, outcome }
    }

    /// Changed cells with their new labels, row by row.
    pub(super) fn changes(&self) -> Vec<(Cell, u8)> {
        let pairs = self.base.iter().zip(&self.outcome);
        self.rect.cells().zip(pairs).filter(|(_, (old, new))| old != new).map(|(cell, (_, &new))| (cell, new)).collect()
    }

    /// The patch with the changes inside `inner` and only the first `count` of the others.
    pub(super) fn first_changes_beyond(&self, inner: &Rect, count: usize) -> Self {
        let mut left = count;
        let pairs = self.base.iter().zip(&self.outcome);
        let outcome = self.rect.cells().zip(pairs).map(|(cell, (&old, &new))| {
            if old == new || inner.contains(cell) {
                return new;
            }
            if left == 0 {
                return old;
            }
            left -= 1;
            new
        });
        Self { rect: self.rect, base: self.base.clone(), outcome: outcome.collect() }
    }

    /// The patch cut down to its changes; `None` if it has none.
    pub(super) fn trimmed(&self) -> Option<Self> {
        let rect = Rect::around(self.changes().into_iter().map(|(cell, _)| cell))?;
        let pick = |cells: &[u8]| {
            self.rect.cells().zip(cells).filter(|(cell, _)| rect.contains(*cell)).map(|(_, &label)| label).collect()
        };
        Some(Self { rect, base: pick(&self.base), outcome: pick(&self.outcome) })
    }
}
