//! The values of a grid in the cells of the map, the part that the vehicle has been given, and the votes of segmented images.

use scenecast_labels::{Ground, Raster, Refusal};
use scenecast_protocol::map::{Cell, LabelGrid, TILE, UNEXPLORED};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Most cells of the map that one grid or image may cover.
pub(super) const MAX_CELLS: u64 = 1 << 22;

/// A grid on the ground, to be read in cells of the map.
pub(super) struct GroundRaster<'a, T> {
    raster: &'a Raster<T>,
    ground: Ground,
    cell_m: f64,
}

impl<'a, T: Copy> GroundRaster<'a, T> {
    /// # Errors
    /// The grid covers more than [`MAX_CELLS`] cells of `cell_m` metres.
    pub(super) fn new(raster: &'a Raster<T>, ground: Ground, cell_m: f64) -> Result<Self, Refusal> {
        let across = |pixels: u32| (f64::from(pixels) * ground.cell_m / cell_m).ceil() as u64 + 1;
        let cells = across(raster.width).saturating_mul(across(raster.height));
        match cells <= MAX_CELLS {
            true => Ok(Self { raster, ground, cell_m }),
            false => Err(Refusal::Cells(cells, MAX_CELLS)),
        }
    }

    /// Calls `each` with every cell of the map whose middle the grid covers, and with the grid's values in it: that at its
    /// middle, or, where the grid has smaller cells, those of all grid cells whose middles lie in it.
    pub(super) fn for_each(&self, mut each: impl FnMut(Cell, &[T])) {
        let Ground { west_m, south_m, cell_m: edge } = self.ground;
        let (columns, rows) = (self.range(west_m, self.raster.width), self.range(south_m, self.raster.height));
        let is_finer = edge < self.cell_m * 0.999;
        let mut values = Vec::new();
        for y in rows {
            for x in columns.clone() {
                values.clear();
                if is_finer {
                    let across = |cell: i32, origin: f64| {
                        let first = |side: f64| ((side - origin) / edge - 0.5 - 1e-9).ceil().max(0.0) as u32;
                        first(f64::from(cell) * self.cell_m)..first((f64::from(cell) + 1.0) * self.cell_m)
                    };
                    let of_row = |north: u32| across(x, west_m).filter_map(move |column| self.at(column, north));
                    values.extend(across(y, south_m).flat_map(of_row));
                } else {
                    let place =
                        |cell: i32, origin: f64| (((f64::from(cell) + 0.5) * self.cell_m - origin) / edge).floor();
                    values.extend(self.at(place(x, west_m) as u32, place(y, south_m) as u32));
                }
                if !values.is_empty() {
                    each(Cell::new(x, y), &values);
                }
            }
        }
    }

    /// The cells whose middles lie between the sides of the grid.
    fn range(&self, origin_m: f64, pixels: u32) -> std::ops::Range<i32> {
        let cell = |side_m: f64| (side_m / self.cell_m - 0.5 - 1e-9).ceil() as i32;
        cell(origin_m)..cell(origin_m + f64::from(pixels) * self.ground.cell_m)
    }

    /// The value in a column of a row that is counted from the south.
    fn at(&self, column: u32, north: u32) -> Option<T> {
        self.raster.get(column, self.raster.height.checked_sub(1 + north)?)
    }
}

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

/// Votes of a cell beyond which all are halved, so that new images keep their weight.
const MAX_VOTES: u32 = 60_000;

/// The pixels of each class in a cell, the lowest class first.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct CellVotes(Vec<(u8, u32)>);

impl CellVotes {
    pub(super) fn add(&mut self, class: u8, pixels: u32) {
        match self.0.binary_search_by_key(&class, |&(class, _)| class) {
            Ok(at) => self.0[at].1 += pixels,
            Err(at) => self.0.insert(at, (class, pixels)),
        }
    }

    fn merge(&mut self, other: &Self) {
        other.0.iter().for_each(|&(class, pixels)| self.add(class, pixels));
        while self.0.iter().map(|&(_, pixels)| pixels).sum::<u32>() > MAX_VOTES {
            self.0.iter_mut().for_each(|(_, pixels)| *pixels /= 2);
            self.0.retain(|&(_, pixels)| pixels > 0);
        }
    }

    /// The class with most votes; `held` on a tie that it is part of, else the lowest.
    pub(super) fn winner(&self, held: Option<u8>) -> Option<u8> {
        let most = self.0.iter().map(|&(_, pixels)| pixels).max()?;
        let mut winners = self.0.iter().filter(|&&(_, pixels)| pixels == most).map(|&(class, _)| class);
        let first = winners.next()?;
        held.filter(|held| *held == first || winners.any(|class| class == *held)).or(Some(first))
    }
}

/// The votes of all cells.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Votes(BTreeMap<(i32, i32), CellVotes>);

impl Votes {
    /// Adds the votes of an image for a cell, or, if `is_newest_only`, puts them in the place of those of earlier images.
    pub(super) fn vote(&mut self, cell: (i32, i32), image: &CellVotes, is_newest_only: bool) -> &CellVotes {
        let votes = self.0.entry(cell).or_default();
        if is_newest_only {
            votes.0.clear();
        }
        votes.merge(image);
        votes
    }

    /// A grid states the class of a cell, so that earlier images no longer count.
    pub(super) fn forget(&mut self, cell: (i32, i32)) {
        self.0.remove(&cell);
    }
}

/// Refuses `cells` of which so many are neither in `known` nor in `erased` that the three are more than `most`.
pub(super) fn check_room(
    known: &LabelGrid,
    erased: &LabelGrid,
    cells: impl Iterator<Item = Cell>,
    most: usize,
) -> Result<(), Refusal> {
    let is_new = |cell: &Cell| known.get(*cell) == UNEXPLORED && erased.get(*cell) == UNEXPLORED;
    let more = cells.filter(is_new).count();
    match more > 0 && more + known.explored() + erased.explored() > most {
        true => Err(Refusal::FullMap(most)),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(raster: &Raster, ground: Ground, cell_m: f64) -> Vec<(i32, i32, Vec<u8>)> {
        let mut found = Vec::new();
        GroundRaster::new(raster, ground, cell_m).unwrap().for_each(|c, v| found.push((c.x, c.y, v.to_vec())));
        found
    }

    #[test]
    fn a_grid_of_the_same_cells_is_read_one_by_one() {
        let raster = Raster { width: 3, height: 2, values: vec![1, 2, 3, 4, 5, 6] };
        for cell_m in [0.1, 0.25, 1.0 / 3.0] {
            let ground = Ground { west_m: -2.0 * cell_m, south_m: 7.0 * cell_m, cell_m };
            let cells: Vec<(i32, i32, u8)> =
                read(&raster, ground, cell_m).into_iter().map(|(x, y, v)| (x, y, v[0])).collect();
            assert_eq!(cells, [(-2, 7, 4), (-1, 7, 5), (0, 7, 6), (-2, 8, 1), (-1, 8, 2), (0, 8, 3)]);
        }
    }

    #[test]
    fn coarser_and_finer_grids_fill_every_cell() {
        let raster = Raster { width: 2, height: 2, values: vec![1, 2, 3, 4] };
        let coarse = read(&raster, Ground { west_m: 0.0, south_m: 0.0, cell_m: 2.0 }, 1.0);
        assert_eq!(coarse.len(), 16);
        assert!(
            coarse.contains(&(0, 0, vec![3])) && coarse.contains(&(3, 3, vec![2])) && coarse.contains(&(1, 2, vec![1]))
        );
        let fine = read(&raster, Ground { west_m: 1.0, south_m: 0.0, cell_m: 0.5 }, 1.0);
        assert_eq!(fine, [(1, 0, vec![3, 4, 1, 2])]);
        let huge: Raster = Raster { width: 4096, height: 4096, values: Vec::new() };
        assert!(GroundRaster::new(&huge, Ground { west_m: 0.0, south_m: 0.0, cell_m: 1e4 }, 0.1).is_err());
    }

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

    fn votes(counts: &[(u8, u32)]) -> CellVotes {
        let mut votes = CellVotes::default();
        counts.iter().for_each(|&(class, pixels)| votes.add(class, pixels));
        votes
    }

    #[test]
    fn the_most_frequent_class_of_all_images_wins() {
        let mut all = Votes::default();
        assert_eq!(all.vote((0, 0), &votes(&[(4, 9), (2, 10)]), false).winner(None), Some(2));
        assert_eq!(all.vote((0, 0), &votes(&[(4, 1)]), false).winner(Some(2)), Some(2), "a tie keeps the class");
        assert_eq!(all.vote((0, 0), &votes(&[(4, 1)]), false).winner(Some(2)), Some(4));
        assert_eq!(all.vote((0, 0), &votes(&[(7, 1)]), true).winner(Some(4)), Some(7), "the newest image alone");
        assert_eq!(votes(&[(3, 1), (9, 1)]).winner(Some(5)), Some(3));
        assert_eq!(CellVotes::default().winner(None), None);
    }

    #[test]
    fn an_old_cell_still_follows_new_images() {
        let mut all = Votes::default();
        (0..1000).for_each(|_| drop(all.vote((0, 0), &votes(&[(1, 50_000)]), false).clone()));
        let changed = (1..9).find(|_| all.vote((0, 0), &votes(&[(2, 50_000)]), false).winner(Some(1)) == Some(2));
        assert!(changed.is_some_and(|images| images <= 3));
    }
}
