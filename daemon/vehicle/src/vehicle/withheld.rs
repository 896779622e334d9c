//! Cells whose labels are not sent before they are on the disk.

use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;

/// Cells that are remembered one by one; beyond them the whole map is given to the link again.
const MAX_CELLS: usize = 1 << 16;

/// The cells of another program's map that wait for the disk.
#[derive(Debug, Default)]
pub(super) struct Withheld {
    /// The highest label on the disk; `None` before another program's labels came.
    stored: Option<u8>,
    cells: Vec<Cell>,
    is_overflown: bool,
    /// When the last of them came.
    at: Instant,
}

impl Withheld {
    /// Labels up to `stored` are on the disk.
    pub(super) fn begin(&mut self, stored: u8) {
        self.stored = Some(stored);
    }

    pub(super) fn add(&mut self, cells: &[(Cell, u8)], now: Instant) {
        if cells.is_empty() {
            return;
        }
        self.at = now;
        match self.cells.len() + cells.len() <= MAX_CELLS && !self.is_overflown {
            true => self.cells.extend(cells.iter().map(|&(cell, _)| cell)),
            false => (self.cells, self.is_overflown) = (Vec::new(), true),
        }
    }

    pub(super) fn is_waiting(&self) -> bool {
        self.is_overflown || !self.cells.is_empty()
    }

    /// When the last cell came.
    pub(super) fn at(&self) -> Instant {
        self.at
    }

    /// Whether a label may be sent.
    pub(super) fn allows(&self, label: u8) -> bool {
        self.stored.is_none_or(|stored| label <= stored)
    }

    /// The cells that waited for labels up to `stored`; `None` if they are too many to be known.
    pub(super) fn release(&mut self, stored: u8) -> Option<Vec<Cell>> {
        self.stored = Some(stored);
        let cells = std::mem::take(&mut self.cells);
        (!std::mem::take(&mut self.is_overflown)).then_some(cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn too_many_cells_become_the_whole_map() {
        let mut withheld = Withheld::default();
        assert!(withheld.allows(9) && !withheld.is_waiting());
        withheld.begin(4);
        assert!(withheld.allows(4) && !withheld.allows(5));
        withheld.add(&[(Cell::new(1, 2), 5)], Instant::ZERO);
        assert_eq!(withheld.release(5), Some(vec![Cell::new(1, 2)]));
        assert!(withheld.allows(5) && !withheld.is_waiting());
        let many: Vec<(Cell, u8)> = (0..40_000).map(|x| (Cell::new(x, 0), 6)).collect();
        withheld.add(&many, Instant::ZERO);
        withheld.add(&many, Instant::ZERO);
        assert!(withheld.is_waiting() && withheld.cells.is_empty());
        assert_eq!((withheld.release(6), withheld.is_waiting()), (None, false));
    }
}
