//! Clusters of cells that look alike: k-means (Lloyd 1982) that grows by splits, from a start that is drawn by no random number.

use super::smooth::{Coordinates, squared_distance};
use nalgebra::{DMatrix, SymmetricEigen};

/// A cluster is split only if its variance along its main direction exceeds this, in units of the noise between neighbours.
const MIN_VARIANCE: f64 = 1.5;
/// Least squared distance of the centres of two halves.
const MIN_GAP: f32 = 5.0;
/// Fewest cells of a half: this many, and this share of all.
const MIN_CELLS: usize = 24;
const MIN_SHARE: f64 = 0.01;
/// Passes over the cells: within a split, after it, and at the end.
const PASSES: [usize; 3] = [10, 5, 20];
/// Bound of the search for eigenvectors, which needs about three rotations an axis.
const MAX_ROTATIONS: usize = 1000;

/// Centres of the clusters, and the cluster of each cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clusters {
    pub(crate) centres: Vec<Vec<f32>>,
    pub(crate) of_cells: Vec<usize>,
}

impl Clusters {
    /// As many clusters as the cells call for, at most `most`.
    pub(crate) fn grow(cells: &Coordinates, most: usize) -> Self {
        let all: Vec<usize> = (0..cells.len()).collect();
        let mut found = Self { centres: vec![mean(cells, &all)], of_cells: vec![0; cells.len()] };
        while found.centres.len() < most {
            let Some(centres) = found.with_a_split(cells) else { break };
            found = Self::refined(cells, centres, PASSES[1]);
        }
        Self::refined(cells, found.centres, PASSES[2])
    }

    /// Moves centres to the means of their cells, for at most `passes`. A centre without cells stays.
    pub(crate) fn refined(cells: &Coordinates, mut centres: Vec<Vec<f32>>, passes: usize) -> Self {
        let mut of_cells = nearest(cells, 0..cells.len(), &centres);
        for _ in 0..passes {
            move_to_means(cells, 0..cells.len(), &of_cells, &mut centres);
            let next = nearest(cells, 0..cells.len(), &centres);
            if next == of_cells {
                break;
            }
            of_cells = next;
        }
        Self { centres, of_cells }
    }

    /// The centres with those of two halves in place of the first cluster that can be split, the one with most scatter first.
    fn with_a_split(&self, cells: &Coordinates) -> Option<Vec<Vec<f32>>> {
        let fewest = MIN_CELLS.max((MIN_SHARE * cells.len() as f64).ceil() as usize);
        let mut members = vec![Vec::new(); self.centres.len()];
        self.of_cells.iter().enumerate().for_each(|(cell, &cluster)| members[cluster].push(cell));
        let large = members.iter().enumerate().filter(|(_, members)| members.len() >= 2 * fewest);
        let mut wide: Vec<_> =
            large.map(|(cluster, members)| (cluster, members, Scatter::of(cells, members))).collect();
        wide.retain(|(_, _, scatter)| scatter.variance > MIN_VARIANCE);
        let spread = |(_, members, scatter): &(usize, &Vec<usize>, Scatter)| members.len() as f64 * scatter.variance;
        wide.sort_by(|a, b| spread(b).total_cmp(&spread(a)));
        wide.into_iter().find_map(|(cluster, members, scatter)| {
            let halves = scatter.halves(cells, members, fewest)?;
            let mut centres = self.centres.clone();
            centres.remove(cluster);
            centres.extend(halves);
            Some(centres)
        })
    }
}

/// The cluster of each of some cells whose centre is nearest, the first of equally near ones.
fn nearest(cells: &Coordinates, some: impl Iterator<Item = usize>, centres: &[Vec<f32>]) -> Vec<usize> {
    let of = |cell: usize| {
        let distances = centres.iter().map(|centre| squared_distance(cells.of(cell), centre)).enumerate();
        distances.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(cluster, _)| cluster)
    };
    some.map(of).collect()
}

fn move_to_means(cells: &Coordinates, some: impl Iterator<Item = usize>, clusters: &[usize], centres: &mut [Vec<f32>]) {
    let (mut sums, mut counts) = (vec![vec![0.0f64; cells.axes]; centres.len()], vec![0u32; centres.len()]);
    for (cell, &cluster) in some.zip(clusters) {
        counts[cluster] += 1;
        sums[cluster].iter_mut().zip(cells.of(cell)).for_each(|(sum, &value)| *sum += f64::from(value));
    }
    for ((centre, sum), &count) in centres.iter_mut().zip(&sums).zip(&counts).filter(|(_, count)| **count > 0) {
        centre.iter_mut().zip(sum).for_each(|(value, sum)| *value = (sum / f64::from(count)) as f32);
    }
}

pub(crate) fn mean(cells: &Coordinates, some: &[usize]) -> Vec<f32> {
    let mut centre = [vec![0.0; cells.axes]];
    move_to_means(cells, some.iter().copied(), &vec![0; some.len()], &mut centre);
    let [centre] = centre;
    centre
}

/// The mean of some cells, and the direction in which they vary most.
struct Scatter {
    mean: Vec<f32>,
    /// Largest eigenvalue of the covariance.
    variance: f64,
    direction: Vec<f64>,
}

impl Scatter {
    fn of(cells: &Coordinates, some: &[usize]) -> Self {
        let (axes, mean) = (cells.axes, mean(cells, some));
        let mut sums = DMatrix::<f64>::zeros(axes, axes);
        for &cell in some {
            let centred: Vec<f64> = cells.of(cell).iter().zip(&mean).map(|(a, b)| f64::from(a - b)).collect();
            for i in 0..axes {
                for j in 0..=i {
                    sums[(i, j)] += centred[i] * centred[j];
                }
            }
        }
        let covariance =
            DMatrix::from_fn(axes, axes, |i, j| sums[(i.max(j), i.min(j))] / (some.len().max(2) - 1) as f64);
        let Some(eigen) = SymmetricEigen::try_new(covariance, f64::EPSILON, MAX_ROTATIONS) else {
            return Self { mean, variance: 0.0, direction: vec![0.0; axes] };
        };
        let (first, variance) = eigen.eigenvalues.argmax();
        let mut direction: Vec<f64> = eigen.eigenvectors.column(first).iter().copied().collect();
        // An eigenvector has no sign of its own.
        let largest = direction.iter().copied().fold(0.0, |most: f64, v| if v.abs() > most.abs() { v } else { most });
        direction.iter_mut().for_each(|value| *value *= largest.signum());
        Self { mean, variance, direction }
    }

    /// The centres of two halves with enough cells and far enough apart.
    fn halves(&self, cells: &Coordinates, some: &[usize], fewest: usize) -> Option<[Vec<f32>; 2]> {
        let reach = self.variance.sqrt();
        let beside = |sign: f64| -> Vec<f32> {
            self.mean.iter().zip(&self.direction).map(|(&m, d)| m + (sign * reach * d) as f32).collect()
        };
        let mut centres = [beside(1.0), beside(-1.0)];
        for _ in 0..PASSES[0] {
            let halves = nearest(cells, some.iter().copied(), &centres);
            move_to_means(cells, some.iter().copied(), &halves, &mut centres);
        }
        let first = nearest(cells, some.iter().copied(), &centres).iter().filter(|&&half| half == 0).count();
        let is_apart = squared_distance(&centres[0], &centres[1]) >= MIN_GAP;
        (is_apart && first.min(some.len() - first) >= fewest).then_some(centres)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn groups(apart: f32) -> Coordinates {
        let at = [[0.0f32, 0.0], [apart, 1.0], [0.0, 2.0 * apart]];
        let noise = |i: usize, key: u64| (crate::random::mix(i as u64 | key << 32) % 1000) as f32 / 1000.0 - 0.5;
        let values = (0..300).flat_map(|i| [at[i % 3][0] + noise(i, 1), at[i % 3][1] + noise(i, 2)]);
        Coordinates { axes: 2, values: values.collect() }
    }

    #[test]
    fn groups_are_found_and_not_split_further() {
        let found = Clusters::grow(&groups(9.0), 16);
        assert_eq!(found.centres.len(), 3);
        assert!((0..300).all(|i| found.of_cells[i] == found.of_cells[i % 3]));
        assert_eq!(Clusters::grow(&groups(9.0), 2).centres.len(), 2);
    }

    #[test]
    fn noise_is_one_cluster() {
        assert_eq!(Clusters::grow(&groups(0.0), 16).centres.len(), 1);
        assert_eq!(Clusters::grow(&Coordinates { axes: 2, values: Vec::new() }, 16).of_cells, []);
    }

    #[test]
    fn centres_without_cells_stay() {
        let kept = Clusters::refined(&groups(9.0), vec![vec![0.0, 0.0], vec![900.0, 0.0]], 5);
        assert_eq!(kept.centres[1], [900.0, 0.0]);
        assert!(kept.of_cells.iter().all(|&cluster| cluster == 0));
    }
}
