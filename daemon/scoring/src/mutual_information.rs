//! Mutual information of two labellings of the same cells (Cover and Thomas, Elements of Information Theory).

use std::collections::BTreeMap;

/// The agreement of two labellings, whatever their numbering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MutualInformation {
    /// Mutual information in nats, 0 or above.
    pub nats: f64,
    /// `nats` over the geometric mean of both entropies, 0 to 1; 0 if an entropy is 0.
    pub normalised: f64,
    /// The number of labelled pairs.
    pub n: u64,
}

/// Returns the mutual information of two labellings, given as pairs: the measure by which the paper chooses
/// hyperparameters.
///
/// ```
/// use scenecast_scoring::mutual_information_nats;
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
        Self { nats, normalised: if scale > 1e-12 { nats / scale } else { 0.0 }, n }
    }
}

fn entropy(counts: impl Iterator<Item = u64>, n: u64) -> f64 {
    counts.filter(|&count| count > 0).map(|count| count as f64 / n as f64).map(|share| -share * share.ln()).sum()
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
    fn independent_labellings_share_no_information() {
        let score = mutual_information_nats((0..1600).map(|i| (i % 4, i / 4 % 4)));
        assert!(score.nats.abs() < 1e-9);
        assert_eq!(mutual_information_nats(std::iter::empty()), MutualInformation::default());
        assert_eq!(mutual_information_nats([(1, 1), (1, 2)].into_iter()).normalised, 0.0);
    }
}
