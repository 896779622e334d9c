//! Chunks and their content: base and outcome of a patch of a map or of one of its sublattices; why bytes are no chunk.

use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect};

/// An encoded change of the map.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MapChunk {
    /// The bytes that [`decode`](super::decode) needs besides the base.
    pub bytes: Vec<u8>,
    /// The changed cells with their new labels (0 makes a cell unexplored), exactly as [`decode`](super::decode) returns them.
    pub changes: Vec<(Cell, u8)>,
}

/// Why a chunk is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end inside the header.
    #[error("map chunk ends early")]
    Truncated,
    /// The patch is larger than allowed or leaves the 32-bit grid.
    #[error("map chunk has an impossible patch")]
    BadGeometry,
    /// The chunk was coded against another base, or has a byte too many or too few.
    #[error("map chunk was coded against another base")]
    BaseMismatch,
    /// The encoder never writes such a body.
    #[error("map chunk is corrupt")]
    Corrupt,
    /// The body needs an unknown coder.
    #[error("map chunk uses an unknown codec")]
    UnknownCodec,
}

impl MapChunk {
    /// The chunk with the content `patch` and these bytes.
    pub(super) fn of(patch: &Patch, bytes: Vec<u8>) -> Self {
        Self { bytes, changes: patch.changes() }
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
