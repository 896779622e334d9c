//! Sublattices of a map.

use crate::grid::{Cell, LabelGrid};

/// Every n-th cell of a map, n = 1 or 4, numbered without gaps: cell (x, y) of the lattice is cell (n x,
/// n y) of the map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice<'a> {
    grid: &'a LabelGrid,
    stride: Stride,
}

/// The distance between the cells of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Stride {
    /// A lattice of all cells.
    #[default]
    One,
    /// A lattice of every fourth cell in both directions.
    Four,
}

impl Stride {
    /// The distance in cells of the map.
    pub const fn cells(self) -> i32 {
        match self {
            Self::One => 1,
            Self::Four => 4,
        }
    }

    /// The cell of the map at a cell of the lattice.
    pub(super) fn on_map(self, cell: Cell) -> Cell {
        Cell::new(cell.x.wrapping_mul(self.cells()), cell.y.wrapping_mul(self.cells()))
    }

    /// The cell of the lattice at a cell of the map, if it is on the lattice.
    pub fn on_lattice(self, cell: Cell) -> Option<Cell> {
        let n = self.cells();
        (cell.x % n == 0 && cell.y % n == 0).then(|| Cell::new(cell.x / n, cell.y / n))
    }
}

impl<'a> Lattice<'a> {
    pub(super) fn new(grid: &'a LabelGrid, stride: Stride) -> Self {
        Self { grid, stride }
    }

    pub(super) fn whole(grid: &'a LabelGrid) -> Self {
        Self::new(grid, Stride::One)
    }

    pub(super) fn stride(&self) -> Stride {
        self.stride
    }

    /// As [`LabelGrid::copy_area`], in cells of the lattice.
    pub(super) fn copy_area(&self, x: i64, y: i64, width: usize, height: usize) -> Vec<u8> {
        let step = self.stride.cells() as usize;
        if step == 1 {
            return self.grid.copy_area(x, y, width, height);
        }
        let n = step as i64;
        let across = (width.max(1) - 1) * step + 1;
        let row = |row: i64| self.grid.copy_area(x * n, row * n, across, 1);
        (y..y + height as i64).flat_map(|at| row(at).into_iter().step_by(step)).collect()
    }
}
