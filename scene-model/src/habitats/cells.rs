//! The places of cells with their neighbours, the space in which they are compared, and the mean with those that look alike: a
//! bilateral filter (Tomasi and Manduchi 1998), as a fixed window mixes habitats at their borders.
//!
//! Neighbouring cells mostly show one habitat, so their differences are noise, and a measure counts for little where it differs much
//! between them: a discriminant without classes, as in maximum autocorrelation factors (Switzer and Green 1984).
//!
//! A fixed window mixes habitats at their borders; weights that fall with the difference in appearance do not.

use super::measures::{MEASURES, MeasuredValues};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

/// Cells sorted by (y, x), numbered in this order.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CellMap {
    places: Vec<(i32, i32)>,
    /// The first cell of each row, by y.
    rows: Vec<(i32, usize)>,
}

impl CellMap {
    /// `places` are (y, x), sorted.
    pub(crate) fn new(places: &[(i32, i32)]) -> Self {
        let mut rows: Vec<(i32, usize)> = Vec::new();
        for (cell, &(y, _)) in places.iter().enumerate() {
            if rows.last().is_none_or(|&(last, _)| last != y) {
                rows.push((y, cell));
            }
        }
        Self { places: places.to_vec(), rows }
    }

    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Pairs of cells that share an edge, each once.
    pub(crate) fn pairs(&self) -> impl Iterator<Item = (usize, usize)> {
        self.offset(0, 1).chain(self.offset(1, 0))
    }

    /// Pairs of each cell with the one `dy` rows and `dx` columns further, where both exist.
    pub(crate) fn offset(&self, dy: i32, dx: i32) -> impl Iterator<Item = (usize, usize)> {
        self.rows.iter().enumerate().flat_map(move |(row, &(y, first))| {
            let end = |row: usize| self.rows.get(row + 1).map_or(self.places.len(), |&(_, cell)| cell);
            let there = self.rows.binary_search_by_key(&y.saturating_add(dy), |&(y, _)| y).ok();
            let mut others = there.map_or(0..0, |row| self.rows[row].1..end(row)).peekable();
            (first..end(row)).filter_map(move |cell| {
                let x = self.places[cell].1.saturating_add(dx);
                while others.next_if(|&other| self.places[other].1 < x).is_some() {}
                others.next_if(|&other| self.places[other].1 == x).map(|other| (cell, other))
            })
        })
    }
}

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

/// Standard deviation of the guide, which decides what looks alike, cells.
const GUIDE_CELLS: f32 = 1.5;
/// Standard deviation of the mean, cells.
const REACH_CELLS: f32 = 3.0;
const RADIUS_CELLS: i32 = 6;
/// Root mean square difference over the axes, in units of the noise between neighbours, at which two cells look different.
const ALIKE: f32 = 0.5;

/// Coordinates of all cells, `axes` of each.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coordinates {
    pub(crate) axes: usize,
    pub(crate) values: Vec<f32>,
}

impl Coordinates {
    pub(crate) fn of(&self, cell: usize) -> &[f32] {
        &self.values[cell * self.axes..][..self.axes]
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len() / self.axes.max(1)
    }
}

pub(crate) fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

/// The coordinates of each cell as the mean over cells around it that look alike; `varying` is the number of measures that are not the
/// same everywhere.
pub(crate) fn smoothed(map: &CellMap, own: &Coordinates, varying: usize) -> Coordinates {
    let guide = weighted_mean(map, own, GUIDE_CELLS, |_, _| 0.0);
    let scale = 1.0 / (2.0 * ALIKE * ALIKE * varying as f32);
    weighted_mean(map, own, REACH_CELLS, |a, b| scale * squared_distance(guide.of(a), guide.of(b)))
}

/// Means with weights exp(-d^2 / 2 sigma^2 - penalty), over distances d up to six cells.
fn weighted_mean(map: &CellMap, own: &Coordinates, sigma: f32, penalty: impl Fn(usize, usize) -> f32) -> Coordinates {
    let (mut sums, mut weights) = (own.values.clone(), vec![1.0f32; map.len()]);
    let radius = RADIUS_CELLS;
    // Each pair of cells once: weights are the same in both directions.
    for (dy, dx) in (0..=radius).flat_map(|dy| (-radius..=radius).map(move |dx| (dy, dx))) {
        let square = dy * dy + dx * dx;
        if square > radius * radius || (dy, dx) <= (0, 0) {
            continue;
        }
        let far = square as f32 / (2.0 * sigma * sigma);
        for (a, b) in map.offset(dy, dx) {
            let weight = (-far - penalty(a, b)).exp();
            for (to, from) in [(a, b), (b, a)] {
                let sum = &mut sums[to * own.axes..][..own.axes];
                sum.iter_mut().zip(own.of(from)).for_each(|(sum, value)| *sum += weight * value);
                weights[to] += weight;
            }
        }
    }
    for (sum, weight) in sums.chunks_exact_mut(own.axes.max(1)).zip(&weights) {
        sum.iter_mut().for_each(|sum| *sum /= weight);
    }
    Coordinates { axes: own.axes, values: sums }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_found_across_gaps() {
        // Rows 0 and 1, of which (0, 2) is missing; row 5 apart.
        let map = CellMap::new(&[(0, 0), (0, 1), (0, 3), (1, 0), (1, 1), (1, 2), (5, 1)]);
        assert_eq!(map.pairs().collect::<Vec<_>>(), [(0, 1), (3, 4), (4, 5), (0, 3), (1, 4)]);
        assert_eq!(map.offset(-1, 1).collect::<Vec<_>>(), [(3, 1), (5, 2)]);
        assert_eq!(map.len(), 7);
    }

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

    #[test]
    fn noise_is_smoothed_and_a_border_stays() {
        let places: Vec<(i32, i32)> = (0..900).map(|i| (i / 30, i % 30)).collect();
        let map = CellMap::new(&places);
        let truth = |cell: usize| if cell % 30 < 15 { 0.0 } else { 6.0 };
        let noise = |cell: usize| (crate::random::mix(cell as u64) % 1000) as f32 / 500.0 - 1.0;
        let own = Coordinates { axes: 1, values: (0..900).map(|cell| truth(cell) + noise(cell)).collect() };
        let even = smoothed(&map, &own, 1);
        let error = |from: &Coordinates, columns: std::ops::Range<usize>| {
            let cells = || (0..900).filter(|cell| columns.contains(&(cell % 30)));
            (cells().map(|c| (from.of(c)[0] - truth(c)).powi(2)).sum::<f32>() / cells().count() as f32).sqrt()
        };
        assert!(error(&even, 0..10) < 0.4 * error(&own, 0..10), "{}", error(&even, 0..10));
        assert!(error(&even, 14..16) < 1.5, "{}", error(&even, 14..16));
    }
}
