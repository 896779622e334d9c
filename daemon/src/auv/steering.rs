//! Where to go next.

use scenecast_protocol::directive::Utility;
use scenecast_protocol::map::LabelGrid;
use std::collections::{BTreeMap, BTreeSet};

/// Limits of the survey, metres from the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Area {
    /// West limit.
    pub west: f64,
    /// South limit.
    pub south: f64,
    /// East limit.
    pub east: f64,
    /// North limit.
    pub north: f64,
}

impl Area {
    /// The area without a border of `margin` metres, at least its middle.
    pub fn shrunk(&self, margin: f64) -> Self {
        let (cx, cy) = ((self.west + self.east) / 2.0, (self.south + self.north) / 2.0);
        Self {
            west: (self.west + margin).min(cx),
            south: (self.south + margin).min(cy),
            east: (self.east - margin).max(cx),
            north: (self.north - margin).max(cy),
        }
    }
}

/// What the camera sees, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Across the heading.
    pub across: f64,
    /// Along the heading.
    pub along: f64,
}

/// Chooses waypoints: a lawnmower until the operator has said what matters, then greedily by utility.
#[derive(Debug)]
pub struct Steering {
    area: Area,
    footprint: Footprint,
    cell_m: f64,
    legs: Vec<(f64, f64)>,
    next_leg: usize,
    /// How often the camera saw each block of cells.
    visits: BTreeMap<(i32, i32), u32>,
}

/// Cells a side of a block, the grain of planning.
const BLOCK: i32 = 4;

impl Steering {
    /// Steers within `area`; cells have edges of `cell_m` metres.
    pub fn new(area: Area, footprint: Footprint, cell_m: f64) -> Self {
        let legs = lawnmower(&area.shrunk(footprint.across.min(footprint.along) / 2.0), footprint.across * 0.8);
        Self { area, footprint, cell_m, legs, next_leg: 0, visits: BTreeMap::new() }
    }

    /// Where the survey begins, metres.
    pub fn start(&self) -> (f64, f64) {
        self.legs.first().copied().unwrap_or_default()
    }

    /// The camera saw the sea floor around `at`.
    pub fn handle_view(&mut self, at: (f64, f64)) {
        for block in self.blocks_around(at) {
            *self.visits.entry(block).or_default() += 1;
        }
    }

    /// The next waypoint from `from`.
    pub fn next_waypoint(&mut self, from: (f64, f64), map: &LabelGrid, utility: Option<&Utility>) -> (f64, f64) {
        match utility {
            Some(utility) => self.greedy(from, map, utility),
            None => self.next_of_lawnmower(),
        }
    }

    fn next_of_lawnmower(&mut self) -> (f64, f64) {
        if self.next_leg >= self.legs.len() {
            self.legs.reverse();
            self.next_leg = 1;
        }
        let waypoint = self.legs.get(self.next_leg).copied().unwrap_or_default();
        self.next_leg += 1;
        waypoint
    }

    /// The candidate with the greatest gain of utility a metre of way, what is seen on the way included.
    fn greedy(&self, from: (f64, f64), map: &LabelGrid, utility: &Utility) -> (f64, f64) {
        let worth = self.worth_of_blocks(map, utility);
        let inner = self.area.shrunk(self.footprint.across.min(self.footprint.along) / 2.0);
        let step = self.footprint.across.min(self.footprint.along) / 2.0;
        let mut best = (f64::MIN, self.start());
        let columns = ((inner.east - inner.west) / step) as i32;
        let rows = ((inner.north - inner.south) / step) as i32;
        for row in 0..=rows {
            for column in 0..=columns {
                let at = (inner.west + f64::from(column) * step, inner.south + f64::from(row) * step);
                let distance = (at.0 - from.0).hypot(at.1 - from.1);
                if distance < step / 2.0 {
                    continue;
                }
                let gain: f64 = self.blocks_on_way(from, at, step).iter().filter_map(|b| worth.get(b)).sum();
                // The way to turn and settle counts as half a footprint.
                let rate = gain / (distance + step);
                if rate > best.0 {
                    best = (rate, at);
                }
            }
        }
        best.1
    }

    /// Utility of seeing each block once more: what is there, or what the seen blocks around let expect, less with each view.
    fn worth_of_blocks(&self, map: &LabelGrid, utility: &Utility) -> BTreeMap<(i32, i32), f64> {
        let mut seen: BTreeMap<(i32, i32), (f64, f64)> = BTreeMap::new();
        for (cell, label) in map.iter() {
            let entry = seen.entry((cell.x.div_euclid(BLOCK), cell.y.div_euclid(BLOCK))).or_default();
            entry.0 += utility.weight(label);
            entry.1 += 1.0;
        }
        let exploration = f64::from(utility.exploration) / 100.0;
        let block = |metres: f64| block_of(metres, self.cell_m);
        let mut worth = BTreeMap::new();
        for by in block(self.area.south)..=block(self.area.north) {
            for bx in block(self.area.west)..=block(self.area.east) {
                let views = self.visits.get(&(bx, by)).copied().unwrap_or(0);
                let value = match seen.get(&(bx, by)) {
                    Some((sum, n)) => sum / n,
                    None => exploration + expected(&seen, bx, by),
                };
                worth.insert((bx, by), value * 0.5f64.powi(views as i32));
            }
        }
        worth
    }

    /// Blocks that the camera sees on the straight way from one place to another, looking every `step` metres.
    fn blocks_on_way(&self, from: (f64, f64), to: (f64, f64), step: f64) -> BTreeSet<(i32, i32)> {
        let looks = ((to.0 - from.0).hypot(to.1 - from.1) / step).ceil().max(1.0);
        let at = |i: u32| {
            let share = f64::from(i) / looks;
            (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share)
        };
        (1..=looks as u32).flat_map(|i| self.blocks_around(at(i))).collect()
    }

    /// Blocks within half a footprint of a place, in metres.
    fn blocks_around(&self, at: (f64, f64)) -> impl Iterator<Item = (i32, i32)> + use<> {
        let reach = self.footprint.across.min(self.footprint.along) / 2.0;
        let block = |metres: f64| block_of(metres, self.cell_m);
        let (x0, x1, y0, y1) = (block(at.0 - reach), block(at.0 + reach), block(at.1 - reach), block(at.1 + reach));
        (y0..=y1).flat_map(move |y| (x0..=x1).map(move |x| (x, y)))
    }
}

fn block_of(metres: f64, cell_m: f64) -> i32 {
    ((metres / cell_m).floor() as i32).div_euclid(BLOCK)
}

/// Mean worth of the seen blocks within two blocks.
fn expected(seen: &BTreeMap<(i32, i32), (f64, f64)>, bx: i32, by: i32) -> f64 {
    let near = (-2..=2).flat_map(|dy| (-2..=2).filter_map(move |dx| seen.get(&(bx + dx, by + dy))));
    let (sum, n) = near.fold((0.0, 0.0), |(s, n), (sum, cells)| (s + sum / cells, n + 1.0));
    if n > 0.0 { sum / n } else { 0.0 }
}

/// East-west legs from the south-west corner, `spacing` metres apart.
fn lawnmower(area: &Area, spacing: f64) -> Vec<(f64, f64)> {
    let lines = ((area.north - area.south) / spacing.max(1e-3)).ceil().clamp(0.0, 10_000.0) as u32;
    (0..=lines)
        .flat_map(|line| {
            let y = if lines == 0 {
                area.south
            } else {
                area.south + (area.north - area.south) * f64::from(line) / f64::from(lines)
            };
            let (first, last) = if line % 2 == 0 { (area.west, area.east) } else { (area.east, area.west) };
            [(first, y), (last, y)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::map::Cell;

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 12.0 };
    const FOOTPRINT: Footprint = Footprint { across: 4.0, along: 3.0 };

    #[test]
    fn the_lawnmower_covers_the_area_and_stays_inside_it() {
        let mut steering = Steering::new(AREA, FOOTPRINT, 0.25);
        let legs: Vec<_> = (0..20).map(|_| steering.next_waypoint((0.0, 0.0), &LabelGrid::default(), None)).collect();
        assert!(legs.iter().all(|&(x, y)| (0.0..=20.0).contains(&x) && (0.0..=12.0).contains(&y)));
        assert!(legs.iter().any(|l| l.1 > 10.0) && legs.iter().any(|l| l.1 < 2.0));
    }

    #[test]
    fn a_favoured_label_draws_the_vehicle_to_it() {
        let mut map = LabelGrid::default();
        for y in 0..48 {
            for x in 0..80 {
                map.set(Cell::new(x, y), if x > 60 && y > 30 { 2 } else { 1 });
            }
        }
        let weights = [(2, 100), (1, -50)].into_iter().collect();
        let utility = Utility { weights, ..Utility::default() };
        let mut steering = Steering::new(AREA, FOOTPRINT, 0.25);
        let to = steering.next_waypoint((1.0, 1.0), &map, Some(&utility));
        assert!(to.0 > 14.0 && to.1 > 7.0, "{to:?}");
    }
}
