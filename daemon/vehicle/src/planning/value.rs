//! The value of the next look at each part of the sea floor, by what the operator favours.

use super::bounds::Point;
use super::expect::{Expectation, SeenLabels};
use super::lattice::{Lattice, Node};
use scenecast_protocol::coordinates::{DecimetrePoint, WorldPoint};
use scenecast_protocol::directive::{Utility, WeightedArea};
use scenecast_protocol::map::{Cell, LabelGrid};

/// The state of knowledge about the sea floor.
#[derive(Debug, Default, Clone)]
pub struct Knowledge {
    /// The number of looks of the camera at each cell, at most 255.
    looks: LabelGrid,
    /// The part of the track on which each cell was last looked at: [`PARTS_PER_STEP`] a step, from 1 to 255 and again from 1.
    parts: LabelGrid,
    /// Twenty times the natural logarithm of the perplexity of each cell, 1 to 255.
    surprise: LabelGrid,
    /// Favoured labels are looked at again.
    repeats: bool,
}

impl Knowledge {
    /// Takes a view of a cell after `track_steps` of the track, in steps of the lattice. It counts as a look if the last one
    /// lies three quarters of a step behind, so that the rate of the frames changes nothing.
    pub fn look(&mut self, cell: Cell, track_steps: f64) {
        let part = (track_steps * f64::from(PARTS_PER_STEP)).max(0.0) as u64 % 255;
        let last = self.parts.get(cell);
        let is_fresh = last == 0 || (part + 256 - u64::from(last)) % 255 >= 3;
        if is_fresh {
            self.parts.set(cell, part as u8 + 1);
            self.looks.set(cell, self.looks.get(cell).saturating_add(1));
        }
    }

    /// No further look at a cell pays, until the looks at it are forgotten.
    pub fn exhaust(&mut self, cell: Cell) {
        self.looks.set(cell, u8::MAX);
    }

    /// Forgets the looks at favoured labels and in favoured areas; returns whether there were any. `map_origin` is the origin of the
    /// map frame in the world frame, metres.
    pub fn forget_looks(
        &mut self,
        (window, map_origin): (&CellWindow, Point),
        map: &LabelGrid,
        interest: Interest<'_>,
    ) -> bool {
        let favoured = map.iter().filter(|&(cell, label)| {
            let (x, y) = window.centre_of(cell);
            interest.utility.weight(label) > 0.0 || interest.weight_of_place((x + map_origin.0, y + map_origin.1)) > 0.0
        });
        let favoured: Vec<Cell> = favoured.map(|(cell, _)| cell).collect();
        for &cell in &favoured {
            self.looks.set(cell, 0);
        }
        !favoured.is_empty()
    }

    /// Begins a round of further looks.
    pub fn begin_round(&mut self) {
        self.repeats = true;
    }

    /// Whether the survey is in a round of further looks.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Takes the scene model's perplexity of a cell, 1 or more.
    pub fn set_perplexity(&mut self, cell: Cell, perplexity: f32) {
        let level = (20.0 * perplexity.max(1.0).ln()).round().clamp(1.0, 255.0);
        self.surprise.set(cell, level as u8);
    }
}

/// Parts of a step of the lattice in which the track is counted.
const PARTS_PER_STEP: u8 = 4;

/// The value of a repeated look at a cell, divided by the value of the look before: while there is floor that was not seen,
/// and in the rounds after that, in which more looks at dense places are better than a first one at each sparse place.
const REPEATED_LOOK: f32 = 0.4;
const REPEATED_LOOK_IN_ROUNDS: f32 = 0.7;

/// The value of the next look at each block, the square between four places of a lattice. A place shows
/// the four blocks around it.
#[derive(Debug, Clone)]
pub struct BlockValues {
    /// The number of blocks in a row: one more than there are places.
    columns: usize,
    blocks: Vec<f32>,
    /// The part of each value that seen cells have: another look at them.
    seen: Vec<f32>,
}

/// The indices of the blocks that a place shows.
pub type ShownBlocks = [usize; 4];

impl BlockValues {
    /// Values by the operator's interest; one whole cell of weight 1 has the value 1. Cells outside the window have
    /// none. `map_origin` is the origin of the map frame in the world frame, metres.
    pub fn new(
        lattice: &Lattice,
        (window, map_origin): (&CellWindow, Point),
        map: &LabelGrid,
        known: &Knowledge,
        interest: Interest<'_>,
    ) -> Self {
        let (places, rows) = lattice.size();
        let columns = places + 1;
        let none = vec![0.0; columns * (rows + 1)];
        let mut values = Self { columns, blocks: none.clone(), seen: none };
        let (south_west, step) = (lattice.place(0), lattice.steps_m());
        let block = |at: f64, origin: f64, step: f64| ((at - origin) / step).floor() as i64 + 1;
        let labels = window.copy(map);
        let cells = window.cell_values(map_origin, &labels, known, interest);
        let width = window.width.max(1);
        for (row, (line, labels)) in (0..).zip(cells.chunks(width).zip(labels.chunks(width))) {
            let y = block(window.centre(row, window.y) + map_origin.1, south_west.1, step.1);
            if !(0..=rows as i64).contains(&y) {
                continue;
            }
            for (column, (value, label)) in (0..).zip(line.iter().zip(labels)) {
                let x = block(window.centre(column, window.x) + map_origin.0, south_west.0, step.0);
                if (0..columns as i64).contains(&x) {
                    let at = y as usize * columns + x as usize;
                    values.blocks[at] += value;
                    values.seen[at] += if *label == 0 { 0.0 } else { *value };
                }
            }
        }
        values
    }

    /// The blocks that a place shows.
    pub fn shown(&self, node: Node) -> ShownBlocks {
        let first = node + node / (self.columns - 1);
        [first, first + 1, first + self.columns, first + self.columns + 1]
    }

    pub fn of(&self, block: usize) -> f32 {
        self.blocks[block]
    }

    /// The part of a block's value that its seen cells have.
    pub fn of_seen(&self, block: usize) -> f32 {
        self.seen[block]
    }

    pub fn blocks(&self) -> usize {
        self.blocks.len()
    }
}

/// The cells that have a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellWindow {
    pub x: i32,
    pub y: i32,
    pub width: usize,
    pub height: usize,
    /// Edge of a cell, metres.
    pub cell_m: f64,
}

/// The maximum number of cells that are valued one by one.
const MAX_CELLS: f64 = 4e6;

impl CellWindow {
    /// The cells of an area, from the south; at most 4 million.
    pub fn new(area: scenecast_core::Area, cell_m: f64) -> Self {
        let cell = |metres: f64| (metres / cell_m + 1e-9).floor().clamp(-1e9, 1e9) as i32;
        let (x, y) = (cell(area.west), cell(area.south));
        let count =
            |from: i32, to: f64| f64::from((((to / cell_m - 1e-9).ceil().clamp(-1e9, 1e9) as i32) - from).max(1));
        let (width, height) = (count(x, area.east), count(y, area.north));
        let height = height.min((MAX_CELLS / width).max(1.0));
        Self { x, y, width: width.min(MAX_CELLS) as usize, height: height as usize, cell_m }
    }

    /// The cells whose centre lies in the square around a point, up to `reach_m` from it in either direction.
    pub fn cells_around(&self, at: Point, reach_m: f64) -> impl Iterator<Item = Cell> {
        let cell_m = self.cell_m;
        let span = move |middle: f64| {
            let edge = |metres: f64| metres / cell_m - 0.5;
            edge(middle - reach_m).ceil() as i32..=edge(middle + reach_m).floor() as i32
        };
        span(at.1).flat_map(move |y| span(at.0).map(move |x| Cell::new(x, y)))
    }

    /// The centre of a cell of the window, metres.
    fn centre(&self, index: i64, first: i32) -> f64 {
        (f64::from(first) + index as f64 + 0.5) * self.cell_m
    }

    fn copy(&self, grid: &LabelGrid) -> Vec<u8> {
        grid.copy_area(i64::from(self.x), i64::from(self.y), self.width, self.height)
    }

    fn cell_values(&self, map_origin: Point, labels: &[u8], known: &Knowledge, interest: Interest<'_>) -> Vec<f32> {
        let utility = interest.utility;
        let seen = SeenLabels { labels, width: self.width };
        let weight: Vec<f32> = (0..=255).map(|l| utility.weight(l) as f32).collect();
        let (exploration, curiosity) = (f32::from(utility.exploration) / 100.0, f32::from(utility.curiosity) / 100.0);
        let expectation = Expectation::new(seen);
        let mut values = expectation.of(|label| weight[usize::from(label)], 0.0);
        for (w, &label) in values.iter_mut().zip(labels) {
            *w = if label == 0 { *w + exploration } else { weight[usize::from(label)] };
        }
        if curiosity != 0.0 {
            let odd = oddness(&self.copy(&known.surprise));
            values.iter_mut().zip(odd).for_each(|(w, odd)| *w += curiosity * odd);
        }
        if !interest.areas.is_empty() {
            self.add_areas(&mut values, map_origin, interest);
        }
        let looks = self.copy(&known.looks);
        let repeated = if known.repeats { REPEATED_LOOK_IN_ROUNDS } else { REPEATED_LOOK };
        values.iter_mut().zip(&looks).for_each(|(w, &n)| *w *= repeated.powi(i32::from(n)));
        values
    }
}

impl CellWindow {
    /// Adds the weights of areas to the values of the cells with their centre inside.
    fn add_areas(&self, values: &mut [f32], map_origin: Point, interest: Interest<'_>) {
        for (row, line) in (0..).zip(values.chunks_mut(self.width.max(1))) {
            let north = self.centre(row, self.y) + map_origin.1;
            for (column, value) in (0..).zip(line) {
                *value += interest.weight_of_place((self.centre(column, self.x) + map_origin.0, north));
            }
        }
    }

    /// The centre of a cell in the map frame, metres.
    pub fn centre_of(&self, cell: Cell) -> Point {
        (self.centre(0, cell.x), self.centre(0, cell.y))
    }
}

/// The surprise of each cell, from 0 (the least on the map) to 1 (the most). Unseen cells get the mean.
fn oddness(surprise: &[u8]) -> Vec<f32> {
    let known = || surprise.iter().filter(|&&s| s > 0).map(|&s| f32::from(s));
    let (least, most) = known().fold((255.0f32, 0.0f32), |(l, m), s| (l.min(s), m.max(s)));
    let scale = 1.0 / (most - least).max(1.0);
    let count = known().count().max(1) as f32;
    let mean = known().map(|s| (s - least) * scale).sum::<f32>() / count;
    surprise.iter().map(|&s| if s == 0 { mean } else { (f32::from(s) - least) * scale }).collect()
}

/// The operator's utility, and the areas that are weighted whatever lies there.
#[derive(Debug, Clone, Copy)]
pub struct Interest<'a> {
    pub utility: &'a Utility,
    pub areas: &'a [WeightedArea],
}

impl<'a> Interest<'a> {
    /// The interest of an operator who has weighted no area.
    pub fn in_labels(utility: &'a Utility) -> Self {
        Self { utility, areas: &[] }
    }

    /// The largest weight, from 0 to 1.
    pub fn largest_weight(&self) -> f64 {
        let labels = self.utility.weights.values().copied();
        let areas = self.areas.iter().map(|area| area.weight);
        let others = [self.utility.exploration, self.utility.curiosity];
        f64::from(labels.chain(areas).chain(others).fold(0, i8::max)) / 100.0
    }

    /// The weight of a place of the world frame by the areas alone.
    pub fn weight_of_place(&self, place: Point) -> f32 {
        let point = DecimetrePoint::nearest(WorldPoint::new(place.0, place.1));
        let contains = |area: &&WeightedArea| point.is_some_and(|point| area.outline.contains(point));
        self.areas.iter().filter(contains).map(|area| f32::from(area.weight) / 100.0).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_of_the_frames_does_not_change_the_number_of_looks() {
        let cell = Cell::new(3, 4);
        for frames_per_step in [1u32, 4, 40] {
            let mut known = Knowledge::default();
            for frame in 0..=10 * frames_per_step {
                known.look(cell, f64::from(frame) / f64::from(frames_per_step));
            }
            let looks = known.looks.get(cell);
            assert!((10..=14).contains(&looks), "{looks} looks on 10 steps, {frames_per_step} frames a step");
        }
    }

    #[test]
    fn a_vehicle_that_stays_looks_once() {
        let mut known = Knowledge::default();
        (0..100).for_each(|_| known.look(Cell::new(0, 0), 77.3));
        assert_eq!(known.looks.get(Cell::new(0, 0)), 1);
    }
}
