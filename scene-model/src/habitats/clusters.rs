//! Clusters of cells that look alike, found without random numbers by splits across the main direction, then k-means (Lloyd
//! 1982). The tree over their labels tells which two become one at each coarser cut (Ward 1963).

use super::cells::{Coordinates, squared_distance};
use nalgebra::{DMatrix, SymmetricEigen};
use serde::{Deserialize, Serialize};

/// Passes of k-means: over a map that nothing is known of, over one that has grown, after a merge or a birth, and within a split.
const WHOLE_PASSES: usize = 30;
const GROWN_PASSES: usize = 1;
const CHANGE_PASSES: usize = 4;
const SPLIT_PASSES: usize = 10;
/// Bound of the search for eigenvectors, which needs about three rotations an axis.
const MAX_ROTATIONS: usize = 1000;

/// When a cluster is split, and when two become one. Lengths are in units of the noise between neighbours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Rule {
    /// The largest number of clusters.
    pub(crate) most: usize,
    /// Least variance of a cluster in its main direction.
    pub(crate) variance: f64,
    /// Fewest cells of either half: a number, and a share of all.
    pub(crate) cells: usize,
    pub(crate) share: f64,
    /// Least squared distance of two centres.
    pub(crate) gap: f32,
}

impl Rule {
    fn fewest(&self, cells: &Coordinates) -> usize {
        self.cells.max((self.share * cells.len() as f64).ceil() as usize)
    }
}

/// Centres of the clusters, and the cluster of each cell.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Clusters {
    pub(crate) centres: Vec<Vec<f32>>,
    pub(crate) of_cells: Vec<usize>,
}

impl Clusters {
    /// The clusters of a map that nothing is known of.
    pub(crate) fn grow(cells: &Coordinates, rule: &Rule) -> Self {
        let fewest = rule.fewest(cells);
        let mut parts = vec![Part::new(cells, (0..cells.len()).collect())];
        while parts.len() < rule.most {
            let can = |part: &Part| part.is_open && part.variance > rule.variance && part.cells.len() >= 2 * fewest;
            let open = (0..parts.len()).filter(|&part| can(&parts[part]));
            let Some(widest) = open.min_by(|&a, &b| parts[b].scatter().total_cmp(&parts[a].scatter())) else { break };
            let (high, low): (Vec<usize>, Vec<usize>) = parts[widest].halves(cells);
            if high.len().min(low.len()) < fewest {
                parts[widest].is_open = false;
                continue;
            }
            parts[widest] = Part::new(cells, low);
            parts.push(Part::new(cells, high));
        }
        let mut found = Self::refined(cells, parts.into_iter().map(|part| part.mean).collect(), WHOLE_PASSES);
        found.merge(cells, rule.gap, rule.most);
        found
    }

    /// The clusters of a map that has grown since `centres` were found: those that still hold cells, with merges and births.
    pub(crate) fn continued(cells: &Coordinates, centres: Vec<Vec<f32>>, rule: &Rule) -> Self {
        let mut found = Self::refined(cells, centres, GROWN_PASSES);
        found.merge(cells, MERGED_GAP * rule.gap, rule.most);
        while found.centres.len() < rule.most {
            let Some(centres) = found.with_a_birth(cells, rule) else { break };
            found = Self::refined(cells, centres, CHANGE_PASSES);
        }
        found
    }

    /// Moves centres to the means of their cells, for at most `passes`. A centre without cells stays.
    fn refined(cells: &Coordinates, mut centres: Vec<Vec<f32>>, passes: usize) -> Self {
        let all = 0..cells.len();
        let mut of_cells = nearest(cells, all.clone(), &centres);
        for _ in 0..passes {
            move_to_means(cells, all.clone(), &of_cells, &mut centres);
            let next = nearest(cells, all.clone(), &centres);
            if next == of_cells {
                break;
            }
            of_cells = next;
        }
        Self { centres, of_cells }
    }

    /// Merges centres while the nearest two are within a squared distance, or while there are more than `most`.
    fn merge(&mut self, cells: &Coordinates, gap: f32, most: usize) {
        loop {
            let pairs = (0..self.centres.len()).flat_map(|i| (0..i).map(move |j| (j, i)));
            let apart = |&(i, j): &(usize, usize)| squared_distance(&self.centres[i], &self.centres[j]);
            let nearest = pairs.min_by(|a, b| apart(a).total_cmp(&apart(b)));
            let Some((into, joins)) = nearest.filter(|pair| apart(pair) < gap || self.centres.len() > most) else {
                return;
            };
            self.of_cells.iter_mut().filter(|cluster| **cluster == joins).for_each(|cluster| *cluster = into);
            let members: Vec<usize> = (0..cells.len()).filter(|&cell| self.of_cells[cell] == into).collect();
            self.centres[into] = mean(cells, &members);
            self.centres.remove(joins);
            *self = Self::refined(cells, std::mem::take(&mut self.centres), CHANGE_PASSES);
        }
    }

    /// The centres with those of two halves in place of the first cluster that can be split, the one with most scatter first.
    fn with_a_birth(&self, cells: &Coordinates, rule: &Rule) -> Option<Vec<Vec<f32>>> {
        let fewest = rule.fewest(cells);
        let mut members = vec![Vec::new(); self.centres.len()];
        self.of_cells.iter().enumerate().for_each(|(cell, &cluster)| members[cluster].push(cell));
        let large = members.into_iter().enumerate().filter(|(_, members)| members.len() >= 2 * fewest);
        let mut wide: Vec<(usize, Part)> =
            large.map(|(cluster, members)| (cluster, Part::new(cells, members))).collect();
        wide.retain(|(_, part)| part.variance > BIRTH * rule.variance);
        wide.sort_by(|a, b| b.1.scatter().total_cmp(&a.1.scatter()));
        wide.into_iter().find_map(|(cluster, part)| {
            let halves = part.apart(cells, fewest, rule.gap)?;
            let mut centres = self.centres.clone();
            centres.remove(cluster);
            centres.extend(halves);
            Some(centres)
        })
    }
}

/// While a map grows, labels are born and merged less readily than in a map that nothing is known of.
const BIRTH: f64 = 3.0;
const MERGED_GAP: f32 = 0.6;

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

/// The variance of all cells in the direction in which they vary most.
pub(crate) fn main_variance(cells: &Coordinates) -> f64 {
    Part::new(cells, (0..cells.len()).collect()).variance
}

/// Some cells with their mean, and the direction in which they vary most.
struct Part {
    cells: Vec<usize>,
    mean: Vec<f32>,
    /// Largest eigenvalue of the covariance, and its direction.
    variance: f64,
    direction: Vec<f64>,
    /// Whether a split can be tried.
    is_open: bool,
}

impl Part {
    fn new(all: &Coordinates, cells: Vec<usize>) -> Self {
        let (axes, mean) = (all.axes, mean(all, &cells));
        let mut sums = DMatrix::<f64>::zeros(axes, axes);
        for &cell in &cells {
            let centred: Vec<f64> = all.of(cell).iter().zip(&mean).map(|(a, b)| f64::from(a - b)).collect();
            for i in 0..axes {
                for j in 0..=i {
                    sums[(i, j)] += centred[i] * centred[j];
                }
            }
        }
        let freedom = (cells.len().max(2) - 1) as f64;
        let covariance = DMatrix::from_fn(axes, axes, |i, j| sums[(i.max(j), i.min(j))] / freedom);
        let Some(eigen) = SymmetricEigen::try_new(covariance, f64::EPSILON, MAX_ROTATIONS) else {
            return Self { cells, mean, variance: 0.0, direction: vec![0.0; axes], is_open: false };
        };
        let (first, variance) = eigen.eigenvalues.argmax();
        let mut direction: Vec<f64> = eigen.eigenvectors.column(first).iter().copied().collect();
        // An eigenvector has no sign of its own.
        let largest = direction.iter().copied().fold(0.0, |most: f64, v| if v.abs() > most.abs() { v } else { most });
        direction.iter_mut().for_each(|value| *value *= largest.signum());
        Self { cells, mean, variance, direction, is_open: true }
    }

    /// The sum of squares in the main direction.
    fn scatter(&self) -> f64 {
        self.variance * self.cells.len() as f64
    }

    /// The cells beyond the mean in the main direction, and the others.
    fn halves(&self, all: &Coordinates) -> (Vec<usize>, Vec<usize>) {
        let along = |cell: usize| -> f64 {
            let centred = all.of(cell).iter().zip(&self.mean).map(|(a, b)| f64::from(a - b));
            centred.zip(&self.direction).map(|(value, direction)| value * direction).sum()
        };
        self.cells.iter().partition(|&&cell| along(cell) > 0.0)
    }

    /// The centres of two halves with enough cells and far enough apart.
    fn apart(&self, all: &Coordinates, fewest: usize, gap: f32) -> Option<[Vec<f32>; 2]> {
        let reach = self.variance.sqrt();
        let beside = |sign: f64| -> Vec<f32> {
            self.mean.iter().zip(&self.direction).map(|(&mean, d)| mean + (sign * reach * d) as f32).collect()
        };
        let mut centres = [beside(1.0), beside(-1.0)];
        let mut halves = Vec::new();
        for _ in 0..SPLIT_PASSES {
            halves = nearest(all, self.cells.iter().copied(), &centres);
            move_to_means(all, self.cells.iter().copied(), &halves, &mut centres);
        }
        let second: usize = halves.iter().sum();
        let is_apart = squared_distance(&centres[0], &centres[1]) >= gap;
        (is_apart && second.min(halves.len() - second) >= fewest).then_some(centres)
    }
}

/// A merge of the last tree is kept unless another one adds less variance than this share of it.
const KEPT: f32 = 0.8;

/// Merges of labels, the closest first: the second of each pair joins the first, whose number is lower.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LabelTree {
    merges: Vec<(u32, u32)>,
    clearest: Option<usize>,
}

impl LabelTree {
    /// Merges centres, each with its label and its number of cells, so that the variance within labels grows least. Merges of `earlier`
    /// are preferred, so that groups last while a map grows.
    pub(crate) fn of(mut centres: Vec<(u32, f32, Vec<f32>)>, earlier: &Self) -> Self {
        centres.sort_by_key(|centre| centre.0);
        let (mut merges, mut costs) = (Vec::new(), Vec::new());
        while centres.len() > 1 {
            let pairs = (0..centres.len()).flat_map(|i| (i + 1..centres.len()).map(move |j| (i, j)));
            let added = |&(i, j): &(usize, usize)| {
                let (a, b) = (&centres[i], &centres[j]);
                a.1 * b.1 / (a.1 + b.1).max(1e-9) * squared_distance(&a.2, &b.2)
            };
            let cost = |pair: &(usize, usize)| {
                let is_known = earlier.merges.contains(&(centres[pair.0].0, centres[pair.1].0));
                added(pair) * if is_known { KEPT } else { 1.0 }
            };
            let Some((i, j)) = pairs.min_by(|a, b| cost(a).total_cmp(&cost(b))) else { break };
            costs.push(added(&(i, j)));
            let (joins, cells, place) = centres.remove(j);
            let (into, held, centre) = &mut centres[i];
            let share = cells / (*held + cells).max(1e-9);
            centre.iter_mut().zip(&place).for_each(|(to, from)| *to += share * (from - *to));
            *held += cells;
            merges.push((*into, joins));
        }
        Self { clearest: clearest(&costs), merges }
    }

    /// The merges, the closest first: the second label of each pair joins the first.
    #[must_use]
    pub fn merges(&self) -> &[(u32, u32)] {
        &self.merges
    }

    /// The number of labels at which they differ most clearly: one merge more would join labels that are much farther apart than any that
    /// have joined. `None` below three labels.
    #[must_use]
    pub fn clearest(&self) -> Option<usize> {
        self.clearest
    }

    /// The label that stands for `label` when `count` labels are left, at least one.
    #[must_use]
    pub fn at(&self, label: u32, count: usize) -> u32 {
        let merged = (self.merges.len() + 1).saturating_sub(count.max(1));
        self.merges.iter().take(merged).fold(label, |label, &(into, joins)| if label == joins { into } else { label })
    }
}

/// The number of labels before the merge that adds most variance in relation to the one before it, but for the last one, since any two
/// halves are far apart.
fn clearest(costs: &[f32]) -> Option<usize> {
    let steps =
        costs.windows(2).map(|pair| pair[1] / pair[0].max(1e-9)).enumerate().take(costs.len().saturating_sub(2));
    // Before the merge number k (from 0) there are as many labels as merges left, and one.
    steps.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(step, _)| costs.len() - step)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: Rule = Rule { most: 16, variance: 1.0, cells: 24, share: 0.0, gap: 5.0 };

    fn groups(apart: f32) -> Coordinates {
        let at = [[0.0f32, 0.0], [apart, 1.0], [0.0, 2.0 * apart]];
        let noise = |i: usize, key: u64| (crate::random::mix(i as u64 | key << 32) % 1000) as f32 / 1000.0 - 0.5;
        let values = (0..300).flat_map(|i| [at[i % 3][0] + noise(i, 1), at[i % 3][1] + noise(i, 2)]);
        Coordinates { axes: 2, values: values.collect() }
    }

    #[test]
    fn groups_are_found_and_not_split_further() {
        let found = Clusters::grow(&groups(9.0), &RULE);
        assert_eq!(found.centres.len(), 3);
        assert!((0..300).all(|i| found.of_cells[i] == found.of_cells[i % 3]));
        assert_eq!(Clusters::grow(&groups(9.0), &Rule { most: 2, ..RULE }).centres.len(), 2);
    }

    #[test]
    fn noise_is_one_cluster() {
        assert_eq!(Clusters::grow(&groups(0.0), &RULE).centres.len(), 1);
        assert!(Clusters::grow(&Coordinates { axes: 2, values: Vec::new() }, &RULE).of_cells.is_empty());
    }

    #[test]
    fn a_map_that_has_grown_keeps_its_centres_and_gets_new_ones() {
        let centres = vec![vec![0.2, 0.1], vec![9.0, 1.0]];
        let found = Clusters::continued(&groups(9.0), centres, &RULE);
        assert_eq!(found.centres.len(), 3);
        let doubled = vec![vec![0.0, 0.3], vec![0.0, -0.3], vec![9.0, 1.0], vec![0.0, 18.0]];
        assert_eq!(Clusters::continued(&groups(9.0), doubled.clone(), &RULE).centres.len(), 3);
        assert_eq!(Clusters::continued(&groups(9.0), doubled, &Rule { most: 2, ..RULE }).centres.len(), 2);
    }

    #[test]
    fn the_closest_labels_merge_first() {
        let centre = |label, at: f32| (label, 10.0, vec![at]);
        let tree =
            LabelTree::of(vec![centre(0, 0.0), centre(1, 9.0), centre(2, 1.0), centre(3, 5.0)], &LabelTree::default());
        assert_eq!(tree.clearest(), Some(3));
        assert_eq!(tree.merges()[0], (0, 2));
        let cut = |count| (0..4).map(|label| tree.at(label, count)).collect::<Vec<_>>();
        assert_eq!((cut(4), cut(3)), (vec![0, 1, 2, 3], vec![0, 1, 0, 3]));
        assert_eq!((cut(2), cut(1), cut(0)), (vec![0, 1, 0, 1], vec![0; 4], vec![0; 4]));
    }
    #[test]
    fn a_merge_lasts_while_it_is_nearly_the_closest() {
        let centre = |label, at: f32| (label, 10.0, vec![at]);
        let grown = |third: f32, earlier: &LabelTree| {
            LabelTree::of(vec![centre(2, third), centre(0, 0.0), centre(1, 10.0)], earlier)
        };
        let first = grown(4.9, &LabelTree::default());
        assert_eq!(first.merges()[0], (0, 2));
        assert_eq!(grown(5.1, &LabelTree::default()).merges()[0], (1, 2));
        assert_eq!(grown(5.1, &first).merges()[0], (0, 2));
        assert_eq!(grown(6.0, &first).merges()[0], (1, 2));
    }
}
