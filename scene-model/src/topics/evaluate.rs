//! What a cell shows on the map: mode of the MAP labels of its words, confidence, perplexity.

use super::cells::Cells;
use super::labels::{LANES, Labels, Lanes, TopicId, UNLABELLED, label_of, word_of};

/// The map's view of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellView {
    pub(crate) topic: TopicId,
    /// Words whose MAP label is the cell's.
    pub(crate) votes: u32,
    pub(crate) words: u32,
    /// Sum over words of -ln p(w), nats.
    pub(crate) surprise: f64,
}

/// Evaluates cells one after another with the same working memory.
pub(crate) struct Evaluator<'a> {
    labels: &'a Labels,
    near: Vec<Lanes>,
    share: Vec<Lanes>,
    votes: Vec<u32>,
    active: f64,
}

impl<'a> Evaluator<'a> {
    pub(crate) fn new(labels: &'a Labels) -> Self {
        let zero = vec![Lanes([0.0; LANES]); labels.blocks];
        let votes = vec![0; labels.blocks * LANES];
        Self { labels, near: zero.clone(), share: zero, votes, active: labels.active() as f64 }
    }

    /// MAP label per word is the arg max over labels in use with the word's own label taken out; ties to the lowest
    /// slot there and to the oldest topic in the mode.
    pub(crate) fn view(&mut self, cells: &Cells, cell: u32) -> CellView {
        cells.gather(cell, &mut self.near);
        self.prepare();
        self.votes.fill(0);
        let words = cells.words(cell);
        let mut likelihood = LogProduct::default();
        let vote = match self.labels.blocks {
            1 => vote::<1>,
            2 => vote::<2>,
            _ => vote::<0>,
        };
        for &packed in words {
            let (slot, p) = vote(self.labels, &self.near, &self.share, packed);
            self.votes[slot] += 1;
            likelihood.multiply(f64::from(p));
        }
        let near: f64 = self.near.iter().flat_map(|lanes| lanes.0).map(f64::from).sum();
        let mass = near + self.active * f64::from(self.labels.alpha());
        let (topic, votes) = self.mode();
        let words = words.len() as u32;
        CellView { topic, votes, words, surprise: f64::from(words) * mass.ln() - likelihood.ln() }
    }

    /// (n_k + alpha) / (n_k. + V beta) of labels in use, 0 of others.
    fn prepare(&mut self) {
        let labels = self.labels;
        let birth = labels.birth_slot().unwrap_or(UNLABELLED) as usize;
        for block in 0..labels.blocks {
            for lane in 0..LANES {
                let here = self.near[block].0[lane] + labels.prior[block].0[lane];
                self.share[block].0[lane] = here * labels.rate[block].0[lane];
            }
        }
        if let Some(lanes) = self.share.get_mut(birth / LANES) {
            lanes.0[birth % LANES] = 0.0;
        }
    }

    fn mode(&self) -> (TopicId, u32) {
        let mut winner = (TopicId(u32::MAX), 0);
        for (slot, &votes) in self.votes.iter().enumerate().filter(|entry| *entry.1 > 0) {
            let topic = self.labels.topic(slot as u32).unwrap_or(TopicId(u32::MAX));
            if votes > winner.1 || (votes == winner.1 && topic < winner.0) {
                winner = (topic, votes);
            }
        }
        winner
    }
}

/// MAP slot of a word, and its unnormalised probability; `BLOCKS` as in the kernel.
#[inline(always)]
fn vote<const BLOCKS: usize>(labels: &Labels, near: &[Lanes], share: &[Lanes], packed: u32) -> (usize, f32) {
    let blocks = if BLOCKS == 0 { labels.blocks } else { BLOCKS };
    let own_slot = label_of(packed) as usize;
    let row = &labels.rows[word_of(packed) as usize * blocks..][..blocks];
    let (near, share) = (&near[..blocks], &share[..blocks]);
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
    // The word's own label, without the word, takes part on its own.
    let (block, lane) = (own_slot / LANES, own_slot % LANES);
    let rate = labels.rate[block].0[lane] + labels.rate_gain[block].0[lane];
    let here = near[block].0[lane] - 1.0 + labels.prior[block].0[lane];
    let own_weight = here * ((row[block].0[lane] - 1) as f32 + labels.beta) * rate;
    let top = fold(best, |a, b| if a > b { a } else { b });
    let slot = fold(std::array::from_fn(|i| if best[i] == top { slots[i] } else { i32::MAX }), i32::min) as usize;
    let is_own = own_weight > top || (own_weight == top && own_slot < slot);
    (if is_own { own_slot } else { slot }, fold(sums, |a, b| a + b))
}

/// Folds 16 lanes by halves.
#[inline(always)]
fn fold<T: Copy>(lanes: [T; LANES], with: impl Fn(T, T) -> T) -> T {
    let eight: [T; 8] = std::array::from_fn(|i| with(lanes[i], lanes[i + 8]));
    let four: [T; 4] = std::array::from_fn(|i| with(eight[i], eight[i + 4]));
    with(with(four[0], four[2]), with(four[1], four[3]))
}

/// Logarithm of a long product: the mantissa in a float, the exponent apart.
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
    fn the_logarithm_of_a_product_is_the_sum_of_logarithms() {
        let factors: Vec<f64> = (1..400).map(|i| 1e-4 * f64::from(i)).collect();
        let mut product = LogProduct::default();
        factors.iter().for_each(|&factor| product.multiply(factor));
        let sum: f64 = factors.iter().map(|factor| factor.ln()).sum();
        assert!((product.ln() - sum).abs() < 1e-9 * sum.abs());
    }
}
