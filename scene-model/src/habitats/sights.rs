//! What the cells look like over all their sights.

use super::measures::{MEASURES, MeasuredValues};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Glances within this time are one sight, seconds: ten frames of one moment do not outvote one of another.
const MOMENT_S: f64 = 10.0;

/// The sights of all cells, by (y, x).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sights {
    cells: BTreeMap<(i32, i32), CellSights>,
}

/// The sights of a cell: sums over the moments that have ended, and over the points of the latest one.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct CellSights {
    sum: MeasuredValues,
    moments: u32,
    latest: i64,
    latest_sum: MeasuredValues,
    points: u32,
}

impl Sights {
    /// Adds a point of a cell that was seen at `t_s` seconds.
    pub(crate) fn add(&mut self, (x, y): (i32, i32), t_s: f64, values: &MeasuredValues) {
        self.cells.entry((y, x)).or_default().add((t_s / MOMENT_S).floor() as i64, values);
    }

    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// The mean of each cell over its moments, sorted by (y, x).
    pub(crate) fn means(&self) -> impl Iterator<Item = ((i32, i32), MeasuredValues)> {
        self.cells.iter().map(|(&place, cell)| (place, cell.mean()))
    }
}

impl CellSights {
    fn add(&mut self, moment: i64, values: &MeasuredValues) {
        if self.points > 0 && moment != self.latest {
            self.sum = self.mean_of_latest(|k, latest| self.sum[k] + latest);
            self.moments += 1;
            (self.latest_sum, self.points) = ([0.0; MEASURES], 0);
        }
        self.latest = moment;
        self.points += 1;
        self.latest_sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
    }

    fn mean_of_latest(&self, with: impl Fn(usize, f64) -> f64) -> MeasuredValues {
        std::array::from_fn(|k| with(k, self.latest_sum[k] / f64::from(self.points.max(1))))
    }

    fn mean(&self) -> MeasuredValues {
        let moments = f64::from(self.moments + 1);
        self.mean_of_latest(|k, latest| (self.sum[k] + latest) / moments)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_glances_of_a_moment_count_as_one_of_another() {
        let mut sights = Sights::default();
        (0..50).for_each(|i| sights.add((3, -4), 100.0 + f64::from(i) * 0.1, &[1.0; MEASURES]));
        sights.add((3, -4), 300.0, &[5.0; MEASURES]);
        assert_eq!(sights.means().collect::<Vec<_>>(), [((-4, 3), [3.0; MEASURES])]);
    }

    #[test]
    fn the_order_of_moments_does_not_matter() {
        let seen = |times: &[f64]| {
            let mut sights = Sights::default();
            times.iter().for_each(|&t_s| sights.add((0, 0), t_s, &[t_s; MEASURES]));
            sights.means().next().unwrap().1[0]
        };
        assert_eq!(seen(&[5.0, 20.0, 64.0]), seen(&[64.0, 20.0, 5.0]));
    }
}
