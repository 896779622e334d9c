//! Chunks and their content: base and outcome of a patch; why bytes are no chunk.

use super::lattice::Lattice;
use crate::grid::{Cell, MAX_LABEL, Rect};

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
