//! The maximum a posteriori (MAP) labels and the likelihood of the words of one cell.
#![allow(clippy::needless_range_loop, reason = "the compiler vectorises lane loops over several arrays")]

use crate::topics::labels::{LANES, Labels, Lanes, label_of, word_of};

/// The label counts of one cell and its neighbours, and the global counts: all that the MAP labels
/// of its words depend on.
pub(crate) struct LabelVotes<'a> {
    pub(crate) labels: &'a Labels,
    /// Label counts of the cell and its neighbours, these weighted by appearance affinity.
    pub(crate) near: &'a [Lanes],
    /// (n_k + alpha) / (n_k. + V beta) for each label in use, 0 for other slots.
    pub(crate) share: &'a [Lanes],
}

/// Counts the MAP slots of `words` into `tally`, one number a slot. Returns the logarithm of the product
/// of the words' unnormalised likelihoods.
#[inline(always)]
pub(super) fn map_labels<const BLOCKS: usize>(votes: &LabelVotes<'_>, words: &[u32], tally: &mut [u32]) -> f64 {
    let mut likelihood = LogProduct::default();
    for &packed in words {
        let (slot, p) = map_label::<BLOCKS>(votes, packed);
        tally[slot] += 1;
        likelihood.multiply(f64::from(p));
    }
    likelihood.ln()
}

/// The MAP slot of a word, and the word's unnormalised probability. `BLOCKS` is as in the Gibbs step.
#[inline(always)]
fn map_label<const BLOCKS: usize>(votes: &LabelVotes<'_>, packed: u32) -> (usize, f32) {
    let labels = votes.labels;
    let blocks = if BLOCKS == 0 { labels.blocks } else { BLOCKS };
    let own_slot = label_of(packed) as usize;
    let row = &labels.rows[word_of(packed) as usize * blocks..][..blocks];
    let (near, share) = (&votes.near[..blocks], &votes.share[..blocks]);
    let mut best = [-1.0f32; LANES];
    let mut slots = [0i32; LANES];
    let mut sums = [0.0f32; LANES];
    for block in 0..blocks {
        let own = own_slot.wrapping_sub(block * LANES) as i32;
        let weights: [f32; LANES] =
            std::array::from_fn(|lane| share[block].0[lane] * (row[block].0[lane] as f32 + labels.beta));
        for lane in 0..LANES {
            sums[lane] += weights[lane];
            let weight = if own == lane as i32 { -1.0 } else { weights[lane] };
            let better = weight > best[lane];
            best[lane] = if better { weight } else { best[lane] };
            slots[lane] = if better { (block * LANES + lane) as i32 } else { slots[lane] };
        }
    }
    // The weight of the word's own label has to leave out the word itself, so it is computed apart from the others.
    let (block, lane) = (own_slot / LANES, own_slot % LANES);
    let rate = labels.rate[block].0[lane] + labels.rate_gain[block].0[lane];
    let here = near[block].0[lane] - 1.0 + labels.prior[block].0[lane];
    let own_weight = here * ((row[block].0[lane] - 1) as f32 + labels.beta) * rate;
    let top = fold(best, |a, b| if a > b { a } else { b });
    let slot = fold(std::array::from_fn(|i| if best[i] == top { slots[i] } else { i32::MAX }), i32::min) as usize;
    let is_own = own_weight > top || (own_weight == top && own_slot < slot);
    (if is_own { own_slot } else { slot }, fold(sums, |a, b| a + b))
}

/// Folds 16 lanes by halves, in an order that does not depend on the vector width.
#[inline(always)]
fn fold<T: Copy>(lanes: [T; LANES], with: impl Fn(T, T) -> T) -> T {
    let eight: [T; 8] = std::array::from_fn(|i| with(lanes[i], lanes[i + 8]));
    let four: [T; 4] = std::array::from_fn(|i| with(eight[i], eight[i + 4]));
    with(with(four[0], four[2]), with(four[1], four[3]))
}

/// The logarithm of a long product. Mantissa and exponent are kept apart, so that the product cannot underflow.
struct LogProduct {
    mantissa: f64,
    exponent: i64,
}

impl Default for LogProduct {
    fn default() -> Self {
        Self { mantissa: 1.0, exponent: 0 }
    }
}

impl LogProduct {
    #[inline(always)]
    fn multiply(&mut self, factor: f64) {
        let bits = (self.mantissa * factor).max(f64::MIN_POSITIVE).to_bits();
        self.exponent += (bits >> 52) as i64 - 1023;
        self.mantissa = f64::from_bits(bits & 0x000f_ffff_ffff_ffff | 1023 << 52);
    }

    fn ln(&self) -> f64 {
        self.mantissa.ln() + self.exponent as f64 * std::f64::consts::LN_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithm_of_a_product_is_the_sum_of_logarithms() {
        let factors: Vec<f64> = (1..400).map(|i| 1e-4 * f64::from(i)).collect();
        let mut product = LogProduct::default();
        factors.iter().for_each(|&factor| product.multiply(factor));
        let sum: f64 = factors.iter().map(|factor| factor.ln()).sum();
        assert!((product.ln() - sum).abs() < 1e-9 * sum.abs());
    }
}
