//! Compact patches: growth around a cell in nested rectangles, and sublattices of a map.

use super::series::{Area, GrowthWindow};
use super::{MAX_PATCH_CELLS, MAX_PATCH_SIDE};
use crate::grid::{Cell, LabelGrid};

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
