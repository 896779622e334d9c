//! The labels to expect in unseen cells, given those of the seen cells.

/// Labels of a rectangle of cells, row by row from the south-west. 0: not seen.
#[derive(Debug, Clone, Copy)]
pub struct SeenLabels<'a> {
    pub labels: &'a [u8],
    pub width: usize,
}

/// The spatial Chinese Restaurant Process, continued beyond the Von Neumann neighbourhood of a cell: the influence of a
/// seen label fades with the distance.
///
/// In an unseen cell, label k has the weight `n q_k + alpha p_k`. `n` is the sum over the seen cells of `fade` to the
/// power of the steps to them (east-west plus north-south). `q_k` is the share of the label among them under a
/// steeper fade, so that the nearest of many seen cells decide between labels. `p_k` is the label's share of the
/// whole map. A new label has the weight `gamma`. Next to seen cells their labels dominate; far from all of them the
/// shares of the map do.
#[derive(Debug, Clone)]
pub struct Expectation<'a> {
    seen: SeenLabels<'a>,
    /// The steeper fade, which decides between near labels.
    steep: f32,
    alpha: f32,
    gamma: f32,
    /// For each cell, the sum of the faded counts of all seen cells.
    near: Vec<f32>,
    /// The same sum under the steeper fade.
    next: Vec<f32>,
}

/// Reach of the influence of a label, in lengths over which labels of the map are alike.
const REACH: f32 = 0.5;
/// Reach of the steeper fade, in the same lengths.
const NEXT: f32 = 0.1;
/// The count of an unseen cell under the steeper fade, with the shares of the map. It prevents a division by 0
/// far from all seen cells.
const UNSEEN: f32 = 1e-12;
/// Weight of the map's overall shares, in counts of a straight edge of seen cells at the distance of one reach.
const MIX: f32 = 0.05;
/// Weight of a new label, as a share of [`MIX`].
const NEW: f32 = 0.05;

impl<'a> Expectation<'a> {
    pub fn new(seen: SeenLabels<'a>) -> Self {
        Self::with(seen, REACH, MIX)
    }

    fn with(seen: SeenLabels<'a>, reach: f32, mix: f32) -> Self {
        let length = likeness_length(seen);
        let fade = (-1.0 / (reach * length).clamp(0.5, 40.0)).exp();
        let steep = (-1.0 / (NEXT * length).clamp(0.7, 40.0)).exp();
        // The count that a half plane of seen cells gives the cell next to it.
        let edge = fade / (1.0 - fade) * (1.0 + fade) / (1.0 - fade);
        let alpha = mix * edge;
        let counts = |unseen: f32| seen.labels.iter().map(|&l| if l == 0 { unseen } else { 1.0 }).collect();
        let near = fading(counts(0.0), seen.width, fade);
        let next = fading(counts(UNSEEN), seen.width, steep);
        Self { seen, steep, alpha, gamma: NEW * alpha, near, next }
    }

    /// The expectation in each cell of a value that depends on the label. A new label has the value `of_new`.
    pub fn of(&self, value: impl Fn(u8) -> f32, of_new: f32) -> Vec<f32> {
        let known = || self.seen.labels.iter().filter(|&&l| l != 0);
        let cells = known().count();
        let mean = if cells == 0 { of_new } else { known().map(|&l| value(l)).sum::<f32>() / cells as f32 };
        let values = self.seen.labels.iter().map(|&l| if l == 0 { UNSEEN * mean } else { value(l) }).collect();
        let mut expected = fading(values, self.seen.width, self.steep);
        for ((e, next), near) in expected.iter_mut().zip(&self.next).zip(&self.near) {
            *e = (*e / next * near + self.alpha * mean + self.gamma * of_new) / (near + self.alpha + self.gamma);
        }
        expected
    }

    /// The probability of a label in each cell.
    pub fn share_of(&self, label: u8) -> Vec<f32> {
        self.of(|l| f32::from(u8::from(l == label)), 0.0)
    }

    /// The probability in each cell of a label that the map does not have yet.
    pub fn share_of_new(&self) -> Vec<f32> {
        self.near.iter().map(|near| self.gamma / (near + self.alpha + self.gamma)).collect()
    }
}

/// The number of cells over which labels are alike: the length of the exponential through the agreement of pairs that
/// are two and eight cells apart.
fn likeness_length(seen: SeenLabels<'_>) -> f32 {
    let mut counts = [0f32; 256];
    seen.labels.iter().for_each(|&l| counts[usize::from(l)] += 1.0);
    let cells: f32 = counts[1..].iter().sum();
    let by_chance: f32 = counts[1..].iter().map(|n| (n / cells.max(1.0)).powi(2)).sum();
    let alike = |lag: usize| {
        let (mut pairs, mut same) = (0f32, 0f32);
        let mut count = |a: u8, b: u8| {
            if a != 0 && b != 0 {
                pairs += 1.0;
                same += f32::from(u8::from(a == b));
            }
        };
        for row in seen.labels.chunks(seen.width.max(1)) {
            row.iter().zip(row.iter().skip(lag)).for_each(|(&a, &b)| count(a, b));
        }
        let up = seen.labels.iter().zip(seen.labels.iter().skip(lag * seen.width));
        up.for_each(|(&a, &b)| count(a, b));
        ((same / pairs.max(1.0)) - by_chance).max(1e-3) / (1.0 - by_chance).max(1e-3)
    };
    let (near, far) = (alike(2), alike(8));
    let length = 6.0 / (near / far).ln();
    if length.is_finite() && length > 0.0 { length.clamp(1.0, 80.0) } else { 80.0 }
}

/// For each cell, the sum over all cells of their value times `fade` to the power of the steps to them.
fn fading(mut values: Vec<f32>, width: usize, fade: f32) -> Vec<f32> {
    let width = width.max(1);
    let mut sum = vec![0.0; values.len()];
    for (row, out) in values.chunks(width).zip(sum.chunks_mut(width)) {
        let mut carry = 0.0;
        for (v, o) in row.iter().zip(out.iter_mut()) {
            carry = carry * fade + v;
            *o = carry;
        }
        carry = 0.0;
        for (v, o) in row.iter().zip(out.iter_mut()).rev() {
            *o += carry * fade;
            carry = carry * fade + v;
        }
    }
    let mut carry = vec![0.0; width];
    for (out, row) in values.chunks_mut(width).zip(sum.chunks(width)) {
        for ((c, v), o) in carry.iter_mut().zip(row).zip(out) {
            *c = *c * fade + v;
            *o = *c;
        }
    }
    carry.fill(0.0);
    for (out, row) in values.chunks_mut(width).zip(sum.chunks(width)).rev() {
        for ((c, v), o) in carry.iter_mut().zip(row).zip(out) {
            *o += *c * fade;
            *c = *c * fade + v;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::random::{CounterRng, derive};

    /// Mean log-likelihood of the hidden cells, by the expectation and by the shares of the seen map.
    fn likelihoods(truth: &[u8], width: usize, seed: u64) -> (f64, f64) {
        let mut seen = vec![0u8; truth.len()];
        let mut chance = CounterRng::new(derive(seed, 7));
        let height = truth.len() / width;
        for _ in 0..40 {
            let (x, y) = (chance.below(width - 8), chance.below(height - 8));
            for row in y..y + 8 {
                let cells = row * width + x..row * width + x + 8;
                seen[cells.clone()].copy_from_slice(&truth[cells]);
            }
        }
        let expectation = Expectation::new(SeenLabels { labels: &seen, width });
        let labels: std::collections::BTreeSet<u8> = seen.iter().copied().filter(|&l| l != 0).collect();
        let shares: Vec<(u8, Vec<f32>)> = labels.iter().map(|&l| (l, expectation.share_of(l))).collect();
        let cells = seen.iter().filter(|&&l| l != 0).count() as f64;
        let (mut by_place, mut by_mix, mut hidden) = (0.0, 0.0, 0.0);
        for (i, &label) in truth.iter().enumerate().filter(|(i, l)| seen[*i] == 0 && labels.contains(l)) {
            let share = shares.iter().find(|(l, _)| *l == label).map_or(0.0, |(_, s)| f64::from(s[i]));
            by_place += share.ln();
            by_mix += (seen.iter().filter(|&&l| l == label).count() as f64 / cells).ln();
            hidden += 1.0;
        }
        (by_place / hidden, by_mix / hidden)
    }

    #[test]
    fn hidden_cells_are_predicted_better_than_by_overall_shares() {
        for seed in 1..=6 {
            let world = scenecast_worlds::patches(seed, 120, 90, 8, 8);
            let truth: Vec<u8> = world.truth.iter().map(|c| c + 1).collect();
            let (by_place, by_mix) = likelihoods(&truth, 120, seed);
            assert!(by_place > by_mix + 0.05, "seed {seed}: {by_place} against {by_mix}");
        }
    }

    #[test]
    fn near_cells_decide_and_far_away_the_shares_of_the_map() {
        let mut labels = vec![0u8; 200 * 100];
        for y in 0..100 {
            for x in 0..20 {
                labels[y * 200 + x] = if y < 50 { 1 } else { 2 };
            }
        }
        let expectation = Expectation::new(SeenLabels { labels: &labels, width: 200 });
        let (one, new) = (expectation.share_of(1), expectation.share_of_new());
        assert!(one[10 * 200 + 21] > 0.7 && one[90 * 200 + 21] < 0.3, "{} {}", one[10 * 200 + 21], one[90 * 200 + 21]);
        assert!((one[10 * 200 + 199] - 0.5).abs() < 0.25, "{}", one[10 * 200 + 199]);
        assert!(new[10 * 200 + 199] > 2.0 * new[10 * 200 + 21]);
        let total = one[4321] + expectation.share_of(2)[4321] + new[4321];
        assert!((total - 1.0).abs() < 1e-3, "{total}");
    }

    #[test]
    fn without_seen_cells_only_new_labels_are_expected() {
        let labels = [0u8; 12];
        let expectation = Expectation::new(SeenLabels { labels: &labels, width: 4 });
        assert!(expectation.of(|_| 1.0, 0.25).iter().all(|&e| (e - 0.25).abs() < 1e-6));
        assert!(Expectation::new(SeenLabels { labels: &[], width: 0 }).of(|_| 1.0, 0.0).is_empty());
    }
}
