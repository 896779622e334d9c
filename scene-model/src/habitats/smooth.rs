//! The mean of a cell with the cells around it that look alike (bilateral filter, Tomasi and Manduchi 1998).
//!
//! A fixed window mixes habitats at their borders; weights that fall with the difference in appearance do not.

use super::cells::CellMap;

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
