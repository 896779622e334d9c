//! What the cells look like over all their samples, the lamp as seen from places that were seen often, and when a map rests.

use super::measures::{MEASURES, MeasuredValues};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Terms of the lamp: a quadratic in both directions of the frame.
const TERMS: usize = 5;
/// Weight of a lamp that is even.
const EVEN: f64 = 500.0;

/// The measures of a cell in one frame: means over its points.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CellSample {
    points: f64,
    values: SVector<f64, MEASURES>,
    /// Place in the frame, each direction from -1 to 1.
    place: [f64; 2],
}

impl CellSample {
    pub(crate) fn add(&mut self, place: [f64; 2], values: &MeasuredValues) {
        self.points += 1.0;
        self.values += (SVector::from(*values) - self.values) / self.points;
        for (mean, at) in self.place.iter_mut().zip(place) {
            *mean += (at - *mean) / self.points;
        }
    }

    pub(crate) fn points(&self) -> f64 {
        self.points
    }

    fn terms(&self) -> SVector<f64, TERMS> {
        let [x, y] = self.place;
        SVector::from([x, y, x * y, x * x - 1.0 / 3.0, y * y - 1.0 / 3.0])
    }
}

/// The samples of all cells, by (y, x). All are sums: their order does not matter.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CellSamples {
    cells: BTreeMap<(i32, i32), CellMeans>,
    /// Products of the terms of the lamp with themselves and with the measures, within cells.
    terms: SMatrix<f64, TERMS, TERMS>,
    products: SMatrix<f64, TERMS, MEASURES>,
}

/// Means over the points of a cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct CellMeans {
    points: f64,
    values: SVector<f64, MEASURES>,
    terms: SVector<f64, TERMS>,
}

impl CellSamples {
    /// Adds a sample of the cell at (y, x).
    pub(crate) fn add(&mut self, place: (i32, i32), sample: &CellSample) {
        let cell = self.cells.entry(place).or_default();
        let (values, terms) = (sample.values - cell.values, sample.terms() - cell.terms);
        let both = cell.points + sample.points;
        if cell.points > 0.0 {
            let weight = sample.points * cell.points / both;
            self.terms += terms * terms.transpose() * weight;
            self.products += terms * values.transpose() * weight;
        }
        let share = sample.points / both;
        (cell.values, cell.terms, cell.points) = (cell.values + values * share, cell.terms + terms * share, both);
    }

    pub(crate) fn len(&self) -> usize {
        self.cells.len()
    }

    /// The mean of each cell as an even light would show it, sorted by (y, x).
    pub(crate) fn means(&self) -> Vec<((i32, i32), MeasuredValues)> {
        let lamp = self.lamp();
        self.cells.iter().map(|(&place, cell)| (place, cell.mean(&lamp))).collect()
    }

    /// As [`CellSamples::means`], of some cells.
    pub(crate) fn means_of(&self, places: &[(i32, i32)]) -> Vec<((i32, i32), MeasuredValues)> {
        let lamp = self.lamp();
        places.iter().filter_map(|&place| Some((place, self.cells.get(&place)?.mean(&lamp)))).collect()
    }

    /// The share of each term in each measure: a regression within cells, which the sea floor does not enter.
    fn lamp(&self) -> SMatrix<f64, TERMS, MEASURES> {
        let terms = self.terms + SMatrix::identity() * EVEN;
        terms.cholesky().map_or_else(SMatrix::zeros, |root| root.solve(&self.products))
    }
}

impl CellMeans {
    fn mean(&self, lamp: &SMatrix<f64, TERMS, MEASURES>) -> MeasuredValues {
        (self.values - lamp.transpose() * self.terms).into()
    }
}

/// A map rests when so many frames in a row have shown fewer new cells than their number.
pub(crate) const REST_FRAMES: u32 = 60;
/// It is corrected if it has grown by more than this share since the last correction.
const GROWN: f64 = 0.05;

/// The growth of a map: cells at the last correction, cells where the count of frames began, and these frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Rest {
    corrected: usize,
    began: usize,
    frames: u32,
}

impl Rest {
    /// Counts a frame after which the map has so many cells, and tells whether the map is to be corrected now.
    pub(crate) fn is_due(&mut self, cells: usize) -> bool {
        self.frames += 1;
        if self.frames < REST_FRAMES {
            return false;
        }
        let is_resting = cells - self.began < REST_FRAMES as usize;
        (self.began, self.frames) = (cells, 0);
        let is_due = is_resting && (cells - self.corrected) as f64 > GROWN * cells as f64;
        if is_due {
            self.corrected = cells;
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(place: [f64; 2], value: f64, points: usize) -> CellSample {
        let mut sample = CellSample::default();
        (0..points).for_each(|_| sample.add(place, &[value; MEASURES]));
        sample
    }

    #[test]
    fn the_order_of_sights_does_not_matter() {
        let seen = |order: &[usize]| {
            let mut samples = CellSamples::default();
            for &i in order {
                samples.add((0, 0), &sample([0.1 * i as f64, 0.0], i as f64, 4 + i));
            }
            samples.means()[0].1[0]
        };
        assert!((seen(&[1, 2, 3, 4]) - seen(&[4, 2, 3, 1])).abs() < 1e-9);
    }

    #[test]
    fn a_lamp_is_removed_where_places_were_seen_twice() {
        let floor = |cell: i32| f64::from(cell % 3);
        let mut samples = CellSamples::default();
        // Each cell first at the left, then at the right of the frame, where the lamp is one unit brighter.
        for cell in 0..400 {
            for right in [-0.8, 0.8] {
                samples.add((0, cell), &sample([right, 0.0], floor(cell) + right / 1.6, 9));
            }
        }
        samples.add((1, 0), &sample([0.8, 0.0], 0.5, 9));
        let means = samples.means();
        assert!((means[400].1[0] - means[0].1[0]).abs() < 0.05, "seen at the right alone: {}", means[400].1[0]);
        assert!((means[2].1[0] - means[0].1[0] - 2.0).abs() < 0.05);
    }

    #[test]
    fn a_map_is_corrected_once_after_it_has_grown() {
        let mut rest = Rest::default();
        let mut corrections = |cells: &dyn Fn(usize) -> usize| (0..300).filter(|&i| rest.is_due(cells(i))).count();
        assert_eq!(corrections(&|frame| 10 * frame), 0);
        assert_eq!(corrections(&|_| 3000), 1);
        assert_eq!(corrections(&|frame| 3000 + frame / 3), 0);
        assert_eq!(corrections(&|_| 3200), 1);
    }
}
