//! Mutual information of two labellings of the same cells (Cover and Thomas, Elements of Information Theory), the V-measure
//! (Rosenberg and Hirschberg, EMNLP-CoNLL 2007), and the score of a map with its spatial null model.
//!
//! On a small scene, mutual information alone is misleading: any map made of patches has some mutual information with
//! any annotation made of patches. The null model is the mean over the same map flipped in 3 ways and shifted on a
//! torus by 12 large distances. The excess over it is due to the scene.

use super::annotations::{Annotations, LabelGrid};
use std::collections::BTreeMap;

/// The agreement of two labellings, whatever their numbering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MutualInformation {
    /// Mutual information in nats, 0 or above.
    pub nats: f64,
    /// `nats` over the geometric mean of both entropies, 0 to 1; 0 if an entropy is 0.
    pub normalised: f64,
    /// The entropies of the first and the second labelling, nats.
    pub entropies: [f64; 2],
    /// The number of labelled pairs.
    pub n: u64,
}

/// Returns the mutual information of two labellings, given as pairs: the measure by which the paper chooses
/// hyperparameters.
///
/// ```
/// use scenecast_worlds::scoring::mutual_information_nats;
///
/// // Four labels under other names: the entropy of four equal shares.
/// let score = mutual_information_nats((0..100).map(|cell| (cell % 4, 9 - cell % 4)));
/// assert!((score.nats - 4f64.ln()).abs() < 1e-9 && (score.normalised - 1.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn mutual_information_nats(pairs: impl Iterator<Item = (u32, u32)>) -> MutualInformation {
    let mut joint: BTreeMap<(u32, u32), u64> = BTreeMap::new();
    let (mut left, mut right): (BTreeMap<u32, u64>, BTreeMap<u32, u64>) = Default::default();
    let mut n = 0;
    for (a, b) in pairs {
        *joint.entry((a, b)).or_default() += 1;
        *left.entry(a).or_default() += 1;
        *right.entry(b).or_default() += 1;
        n += 1;
    }
    MutualInformation::of_counts(left.into_values(), right.into_values(), joint.into_values(), n)
}

impl MutualInformation {
    /// Returns the mutual information of a table of joint counts with `columns` columns, row by row.
    pub(crate) fn of_table(joint: &[u64], columns: usize) -> Self {
        let columns = columns.max(1);
        let mut right = vec![0; columns];
        for row in joint.chunks(columns) {
            right.iter_mut().zip(row).for_each(|(sum, count)| *sum += count);
        }
        let left = joint.chunks(columns).map(|row| row.iter().sum());
        Self::of_counts(left, right.iter().copied(), joint.iter().copied(), right.iter().sum())
    }

    fn of_counts(
        left: impl Iterator<Item = u64>,
        right: impl Iterator<Item = u64>,
        joint: impl Iterator<Item = u64>,
        n: u64,
    ) -> Self {
        if n == 0 {
            return Self::default();
        }
        let (own, other) = (entropy(left, n), entropy(right, n));
        let nats = (own + other - entropy(joint, n)).max(0.0);
        let scale = (own * other).sqrt();
        Self { nats, normalised: if scale > 1e-12 { nats / scale } else { 0.0 }, entropies: [own, other], n }
    }

    /// How far no label of the first labelling mixes classes of the second, 0 to 1; 1 if there is one class.
    #[must_use]
    pub fn homogeneity(&self) -> f64 {
        share(self.nats, self.entropies[1])
    }

    /// How far no class of the second labelling is split among labels of the first, 0 to 1; 1 if there is one label.
    #[must_use]
    pub fn completeness(&self) -> f64 {
        share(self.nats, self.entropies[0])
    }

    /// The harmonic mean of homogeneity and completeness, 0 to 1. Mutual information alone does not punish a habitat with several
    /// labels.
    ///
    /// ```
    /// use scenecast_worlds::scoring::mutual_information_nats;
    ///
    /// // Two labels for each class: every label is pure, every class is split.
    /// let score = mutual_information_nats((0..80).map(|cell| (cell % 8, cell % 4)));
    /// assert!((score.homogeneity() - 1.0).abs() < 1e-9 && (score.completeness() - 2.0 / 3.0).abs() < 1e-9);
    /// assert!((score.v_measure() - 0.8).abs() < 1e-9);
    /// ```
    #[must_use]
    pub fn v_measure(&self) -> f64 {
        let sum = self.homogeneity() + self.completeness();
        if sum > 0.0 { 2.0 * self.homogeneity() * self.completeness() / sum } else { 0.0 }
    }

    /// `nats` over the arithmetic mean of both entropies, 0 to 1: how far two maps of the same cells are one under other names.
    #[must_use]
    pub fn agreement(&self) -> f64 {
        share(2.0 * self.nats, self.entropies[0] + self.entropies[1])
    }
}

/// A part of an entropy; the whole of one that is 0.
fn share(nats: f64, entropy: f64) -> f64 {
    if entropy > 1e-12 { nats / entropy } else { 1.0 }
}

fn entropy(counts: impl Iterator<Item = u64>, n: u64) -> f64 {
    counts.filter(|&count| count > 0).map(|count| count as f64 / n as f64).map(|share| -share * share.ln()).sum()
}

/// The agreement of a label map with annotations.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct SceneScore {
    /// Mutual information of map labels and annotated classes, cell by cell.
    pub mutual_information: MutualInformation,
    /// The mean mutual information of the flipped and shifted maps, nats.
    pub null_nats: f64,
    /// Mutual information minus `null_nats`, nats.
    pub excess_nats: f64,
    /// The number of different labels in the map.
    pub labels: usize,
}

/// Scores a map against annotations on the same cells. Cells without a label or without an annotation are ignored.
#[must_use]
pub fn score(map: &LabelGrid, annotations: &Annotations) -> SceneScore {
    let dense = Dense::new(map, annotations);
    let mutual_information = dense.score(|x, y| (x, y));
    let (columns, rows) = (annotations.columns, annotations.rows);
    let flips = [(true, false), (false, true), (true, true)];
    let flip = |on: bool, i: usize, length: usize| if on { length - 1 - i } else { i };
    let of_flips =
        flips.map(|(h, v)| dense.score(|x, y| (flip(h, x, columns), flip(v, y, rows))).nats).into_iter().sum::<f64>();
    let mut of_shifts = 0.0;
    for (right, down) in (0..4).flat_map(|i| (0..3).map(move |j| (3 + 2 * i, 3 + 3 * j))) {
        let shift = |i: usize, twelfths: usize, length: usize| (i + twelfths * length / 12) % length;
        of_shifts += dense.score(|x, y| (shift(x, right, columns), shift(y, down, rows))).nats;
    }
    let null_nats = (of_flips + of_shifts) / 15.0;
    let excess_nats = mutual_information.nats - null_nats;
    SceneScore { mutual_information, null_nats, excess_nats, labels: dense.labels }
}

/// A map whose labels are numbered from 0, and the annotations.
struct Dense<'a> {
    annotations: &'a Annotations,
    map: Vec<Option<usize>>,
    labels: usize,
}

impl<'a> Dense<'a> {
    fn new(map: &LabelGrid, annotations: &'a Annotations) -> Self {
        let mut names: Vec<u32> = map.labels.iter().copied().flatten().collect();
        names.sort_unstable();
        names.dedup();
        let (columns, rows) = (annotations.columns, annotations.rows);
        let label = |cell: usize| {
            let (x, y) = (cell % columns, cell / columns);
            let label = (x < map.columns && y < map.rows).then(|| map.labels[y * map.columns + x])??;
            names.binary_search(&label).ok()
        };
        Self { annotations, map: (0..columns * rows).map(label).collect(), labels: names.len() }
    }

    /// The mutual information of the annotations at (x, y) with the map at `from(x, y)`.
    fn score(&self, from: impl Fn(usize, usize) -> (usize, usize)) -> MutualInformation {
        let (columns, classes) = (self.annotations.columns, self.annotations.classes);
        let mut joint = vec![0u64; self.labels * classes];
        for cell in 0..self.map.len() {
            let (x, y) = from(cell % columns, cell / columns);
            if let (Some(label), Some(class)) = (self.map[y * columns + x], self.annotations.of_cells[cell]) {
                joint[label * classes + usize::from(class)] += 1;
            }
        }
        MutualInformation::of_table(&joint, classes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn renamed_labelling_has_all_the_information() {
        let score = mutual_information_nats((0..800).map(|i| (i % 8, 100 - i % 8)));
        assert!((score.nats - 8f64.ln()).abs() < 1e-9);
        assert!((score.normalised - 1.0).abs() < 1e-9);
        assert_eq!(score.n, 800);
    }

    #[test]
    fn v_is_zero_for_chance_and_one_for_one_class_under_one_label() {
        assert!(mutual_information_nats((0..1600).map(|i| (i % 4, i / 4 % 4))).v_measure() < 1e-9);
        assert_eq!(mutual_information_nats((0..9).map(|_| (3, 5))).v_measure(), 1.0);
        let one_label = mutual_information_nats((0..80).map(|i| (1, i % 4)));
        assert_eq!((one_label.homogeneity(), one_label.completeness(), one_label.v_measure()), (0.0, 1.0, 0.0));
        let split = mutual_information_nats((0..80).map(|i| (i % 8, i % 4)));
        assert!((split.agreement() - 0.8).abs() < 1e-9);
    }

    #[test]
    fn independent_labellings_share_no_information() {
        let score = mutual_information_nats((0..1600).map(|i| (i % 4, i / 4 % 4)));
        assert!(score.nats.abs() < 1e-9);
        assert_eq!(mutual_information_nats(std::iter::empty()), MutualInformation::default());
        assert_eq!(mutual_information_nats([(1, 1), (1, 2)].into_iter()).normalised, 0.0);
    }
}
