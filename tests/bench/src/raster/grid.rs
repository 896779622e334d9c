//! A procedural grid of 8-bit values of which a part changes every second.

use scenecast_protocol::map::{Cell, LabelGrid};
use sim_channel::RandomStream;

/// Where the changed cells of a second lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Anywhere, each cell by itself.
    Scattered,
    /// In discs with a radius of 12 cells.
    Patches,
}

/// The number of values of a cell, the lowest of which is 1.
const VALUES: f64 = 200.0;
/// Radius of a disc, cells.
const RADIUS: i32 = 12;

pub(super) struct ChangingGrid {
    side: i32,
    values: LabelGrid,
    rng: RandomStream,
}

impl ChangingGrid {
    /// Smooth hills of 200 values.
    pub(super) fn new(side: u32, seed: u64) -> Self {
        let mut rng = RandomStream::new(seed, &[7]);
        let mut phase = || rng.uniform() * std::f64::consts::TAU;
        let phases = [phase(), phase(), phase(), phase()];
        let side = side as i32;
        let mut values = LabelGrid::default();
        for y in 0..side {
            for x in 0..side {
                let (u, v) = (f64::from(x) / 40.0, f64::from(y) / 40.0);
                let height = (u + phases[0]).sin()
                    + (v + phases[1]).sin()
                    + (0.7 * (u + v) + phases[2]).sin()
                    + 0.5 * (2.3 * (u - v) + phases[3]).sin();
                values.set(Cell::new(x, y), 1 + ((height + 3.5) / 7.0 * (VALUES - 1.0)) as u8);
            }
        }
        Self { side, values, rng }
    }

    pub(super) fn values(&self) -> LabelGrid {
        self.values.clone()
    }

    pub(super) fn all(&self) -> Vec<(Cell, u8)> {
        self.values.iter().collect()
    }

    /// Changes this share of the cells; returns them with their new values.
    pub(super) fn step(&mut self, pattern: Pattern, share: f64) -> Vec<(Cell, u8)> {
        let count = (f64::from(self.side * self.side) * share).round() as usize;
        let mut changed = std::collections::BTreeMap::new();
        while changed.len() < count {
            let (x, y) = (self.draw(self.side), self.draw(self.side));
            match pattern {
                Pattern::Scattered => {
                    let by = 1 + self.draw(8) as u8;
                    changed.insert(Cell::new(x, y), by);
                }
                Pattern::Patches => {
                    let by = 1 + self.draw(40) as u8;
                    let disc = (-RADIUS..=RADIUS).flat_map(|dy| (-RADIUS..=RADIUS).map(move |dx| (dx, dy)));
                    let inside = disc.filter(|(dx, dy)| dx * dx + dy * dy <= RADIUS * RADIUS);
                    let cells = inside.map(|(dx, dy)| Cell::new(x + dx, y + dy));
                    let cells = cells.filter(|c| (0..self.side).contains(&c.x) && (0..self.side).contains(&c.y));
                    let room = count - changed.len();
                    changed.extend(cells.take(room).map(|cell| (cell, by)));
                }
            }
        }
        let values = &mut self.values;
        let change = |(cell, by): (Cell, u8)| {
            let value = 1 + (values.get(cell) - 1 + by) % VALUES as u8;
            values.set(cell, value);
            (cell, value)
        };
        changed.into_iter().map(change).collect()
    }

    fn draw(&mut self, below: i32) -> i32 {
        ((self.rng.uniform() * f64::from(below)) as i32).min(below - 1)
    }
}
