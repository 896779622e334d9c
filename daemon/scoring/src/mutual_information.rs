//! How much a label map tells about annotations.

use std::collections::BTreeMap;

/// Agreement of two labellings, whatever their numbering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MutualInformation {
    /// Mutual information, nats.
    pub nats: f64,
    /// Divided by the geometric mean of both entropies; 0 where one of them is 0.
    pub normalised: f64,
    /// Number of pairs.
    pub n: u64,
}

/// Mutual information of two labellings, given as pairs (the paper's measure for tuning).
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
    /// From a joint table of `columns` columns, row by row.
    pub fn of_table(joint: &[u64], columns: usize) -> Self {
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
    fn a_renamed_labelling_tells_everything() {
        let score = mutual_information_nats((0..800).map(|i| (i % 8, 100 - i % 8)));
        assert!((score.nats - 8f64.ln()).abs() < 1e-9);
        assert!((score.normalised - 1.0).abs() < 1e-9);
        assert_eq!(score.n, 800);
    }

    #[test]
    fn independent_labellings_tell_nothing() {
        let score = mutual_information_nats((0..1600).map(|i| (i % 4, i / 4 % 4)));
        assert!(score.nats.abs() < 1e-9);
        assert_eq!(mutual_information_nats(std::iter::empty()), MutualInformation::default());
        assert_eq!(mutual_information_nats([(1, 1), (1, 2)].into_iter()).normalised, 0.0);
    }
}
