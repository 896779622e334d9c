//! Compact patches: growth around a cell in nested rectangles.

use super::patch::{Lattice, Patch};
use super::{MAX_PATCH_CELLS, MAX_PATCH_SIDE};
use crate::grid::{Cell, MAX_LABEL, Rect};

/// Nested areas around the centre of `window`, smallest first; each holds more changes than the one before.
#[derive(Debug)]
pub(super) struct Growth {
    pub(super) window: GrowthWindow,
    pub(super) areas: Vec<Area>,
    /// The changes in each area.
    pub(super) changes: Vec<usize>,
}

/// The least cost of an isolated change in bits.
const LONELY_BITS: usize = 4;
/// The least cost of a change beside another one in bits, unless it continues all its neighbours.
const EDGE_BITS: usize = 1;
/// The first window reaches this many cells from the seed.
const FIRST_REACH: usize = 48;
/// The last window reaches this many cells from the seed.
const LAST_REACH: usize = 384;

impl Growth {
    /// The cell at the centre.
    pub(super) fn seed(&self) -> Cell {
        let middle = (self.window.side / 2) as i64;
        Cell::new((self.window.x + middle) as i32, (self.window.y + middle) as i32)
    }

    /// Grows around `seed` until the changes certainly need more than `room` bytes; `None` if `seed` is not to be sent.
    pub(super) fn around(
        base: Lattice<'_>,
        target: Lattice<'_>,
        seed: Cell,
        room: usize,
        wanted: &dyn Fn(Cell) -> bool,
    ) -> Option<Self> {
        let mut reach = FIRST_REACH;
        loop {
            let window = GrowthWindow::around(base, target, seed, reach, wanted);
            if !window.is_wanted(reach, reach) {
                return None;
            }
            let (areas, changes, enough) = grow(&window, room * 8);
            if enough || reach >= LAST_REACH {
                return Some(Self { window, areas, changes });
            }
            reach *= 2;
        }
    }
}

/// The bounds of the changes in ever larger squares with their numbers, and whether they exceed the room or the largest
/// patch.
fn grow(window: &GrowthWindow, room_bits: usize) -> (Vec<Area>, Vec<usize>, bool) {
    let middle = window.side / 2;
    let mut area = Area { left: middle, right: middle + 1, bottom: middle, top: middle + 1 };
    let (mut areas, mut changes) = (vec![area], vec![1]);
    let (mut radius, mut bits, mut count) = (0, 0, 1);
    while radius + 1 < middle {
        let next = (radius + 1 + radius / 16).min(middle - 1);
        let mut larger = area;
        for (column, row) in ring(middle, radius, next).filter(|&(column, row)| window.is_wanted(column, row)) {
            larger.include(column, row);
            count += 1;
            bits += least_bits(window, column, row);
        }
        if larger.cells() > MAX_PATCH_CELLS || larger.width().max(larger.height()) > MAX_PATCH_SIDE {
            return (areas, changes, true);
        }
        if larger != area {
            area = larger;
            areas.push(area);
            changes.push(count);
        }
        if bits > room_bits {
            return (areas, changes, true);
        }
        radius = next;
    }
    (areas, changes, false)
}

/// Cells farther than `inner` and at most `outer` from the centre, as (column, row).
fn ring(middle: usize, inner: usize, outer: usize) -> impl Iterator<Item = (usize, usize)> {
    (middle - outer..=middle + outer).flat_map(move |row| {
        let whole = row.abs_diff(middle) > inner;
        let west = middle - outer..if whole { middle + outer + 1 } else { middle - inner };
        let east = if whole { 0..0 } else { middle + inner + 1..middle + outer + 1 };
        west.chain(east).map(move |column| (column, row))
    })
}

fn least_bits(window: &GrowthWindow, column: usize, row: usize) -> usize {
    let label = window.outcome(column, row);
    let same = |c: usize, r: usize| window.is_wanted(c, r) && window.outcome(c, r) == label;
    match (same(column - 1, row), same(column, row - 1)) {
        (true, true) => 0,
        (false, false) => LONELY_BITS,
        _ => EDGE_BITS,
    }
}

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
