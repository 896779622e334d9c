//! The space in which cells are compared: measures in units of the differences between neighbouring cells.
//!
//! Neighbouring cells mostly show one habitat, so their differences are noise, and a measure counts for little where it differs much
//! between them: a discriminant without classes, as in maximum autocorrelation factors (Switzer and Green 1984).

use super::cells::CellMap;
use super::measures::{MEASURES, MeasuredValues};
use super::smooth::Coordinates;
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

type Covariance = SMatrix<f64, MEASURES, MEASURES>;

/// The largest differences that may count as none, in the unit of each measure: of brightness, of the colour ratios, of the deviations and
/// of the energies. What counts as none is as much as neighbours differ, at most this and at least a quarter of it: in turbid water all
/// differences are small.
const TOLERANCE: MeasuredValues = [0.12, 0.04, 0.03, 0.15, 0.15, 0.15, 0.35, 0.35, 0.35, 0.35, 0.35, 0.35, 0.35];

/// Axes in which the differences of neighbours have the covariance of a unit sphere.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Space {
    mean: SVector<f64, MEASURES>,
    /// The Cholesky factor of that covariance.
    root: Covariance,
}

impl Space {
    /// Learns the space of a map; `None` if a measure is not finite.
    pub(crate) fn learn(map: &CellMap, values: &[MeasuredValues]) -> Option<Self> {
        let (mut sums, mut pairs) = (Covariance::zeros(), 0);
        for (a, b) in map.pairs() {
            let difference = SVector::from(values[a]) - SVector::from(values[b]);
            sums += difference * difference.transpose();
            pairs += 1;
        }
        // The variance of a difference is that of both cells.
        let mut noise = sums / f64::from(2 * pairs.max(1));
        for (k, tolerance) in TOLERANCE.into_iter().enumerate() {
            let most = tolerance * tolerance;
            noise[(k, k)] += noise[(k, k)].clamp(most / 16.0, most);
        }
        let sum: SVector<f64, MEASURES> = values.iter().map(|value| SVector::from(*value)).sum();
        Some(Self { mean: sum / values.len().max(1) as f64, root: noise.cholesky()?.l() })
    }

    pub(crate) fn place(&self, values: &MeasuredValues) -> Vec<f32> {
        let mut place = SVector::from(*values) - self.mean;
        self.root.solve_lower_triangular_mut(&mut place);
        place.iter().map(|&coordinate| coordinate as f32).collect()
    }

    pub(crate) fn places(&self, values: &[MeasuredValues]) -> Coordinates {
        Coordinates { axes: MEASURES, values: values.iter().flat_map(|values| self.place(values)).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::smooth::squared_distance;
    use super::*;

    #[test]
    fn habitats_are_far_apart_and_noise_is_not() {
        let places: Vec<(i32, i32)> = (0..400).map(|i| (i / 20, i % 20)).collect();
        let map = CellMap::new(&places);
        let noise = |i: usize, key: u64| (crate::random::mix(i as u64 | key << 32) % 1000) as f64 / 1000.0 - 0.5;
        let values: Vec<MeasuredValues> = (0..400)
            .map(|i| {
                let mut values = [0.0; MEASURES];
                values[2] = f64::from(u8::from(i % 20 >= 10)) + 0.2 * noise(i, 1);
                values[5] = 10.0 * noise(i, 2);
                values
            })
            .collect();
        let found = Space::learn(&map, &values).unwrap().places(&values);
        let apart = |a, b| squared_distance(found.of(a), found.of(b));
        assert!(apart(42, 55) > 2.0 * apart(42, 43), "{} {}", apart(42, 55), apart(42, 43));
        assert!(Space::learn(&CellMap::new(&[]), &[]).is_some());
    }
}
