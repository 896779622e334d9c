//! The synthetic workload of the speed and quality benches: 100 patches of 8 true labels (entropy about 2.0
//! nats) with sparse word distributions.

use scene_model::project::Observation;

/// Words at cell centres, and the true label of each cell.
pub struct Workload {
    pub side: i32,
    pub vocabulary: u32,
    pub observations: Vec<Observation>,
    /// True label of cell (x, y) at y * side + x.
    pub truth: Vec<u32>,
}

const LABELS: usize = 8;
const PATCHES: usize = 100;

/// Returns `side` x `side` cells of 1 m with about `words_per_cell` words each, from a vocabulary of `vocabulary` words.
pub fn workload(seed: u64, side: i32, words_per_cell: u32, vocabulary: u32) -> Workload {
    let mut rng = XorShiftRng(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let centres: Vec<[f64; 2]> =
        (0..PATCHES).map(|_| [rng.unit() * f64::from(side), rng.unit() * f64::from(side)]).collect();
    let labels: Vec<usize> = (0..PATCHES).map(|_| (rng.unit() * LABELS as f64) as usize).collect();
    let tables: Vec<Vec<f64>> = (0..LABELS).map(|_| word_table(vocabulary, &mut rng)).collect();
    let (mut observations, mut truth) = (Vec::new(), Vec::new());
    for y in 0..side {
        for x in 0..side {
            let (px, py) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let distance = |c: &[f64; 2]| (c[0] - px).hypot(c[1] - py);
            let nearest = (0..PATCHES).min_by(|&a, &b| distance(&centres[a]).total_cmp(&distance(&centres[b])));
            let label = labels[nearest.unwrap_or(0)];
            truth.push(label as u32);
            let spread = (f64::from(words_per_cell) * 0.2) as u32;
            let count = words_per_cell - spread + (rng.unit() * f64::from(2 * spread + 1)) as u32;
            for _ in 0..count {
                let aim = rng.unit();
                let word = tables[label].partition_point(|&sum| sum <= aim) as u32;
                observations.push(Observation { word: word.min(vocabulary - 1), x: px, y: py, z: 0.0 });
            }
        }
    }
    Workload { side, vocabulary, observations, truth }
}

/// The cumulative word probabilities of one label: a tenth of the vocabulary has most
/// of the mass, exponentially distributed.
fn word_table(vocabulary: u32, rng: &mut XorShiftRng) -> Vec<f64> {
    let weight = |rng: &mut XorShiftRng| {
        let mass = -(1.0 - rng.unit()).ln();
        if rng.unit() < 0.1 { mass } else { 0.02 * mass }
    };
    let weights: Vec<f64> = (0..vocabulary).map(|_| weight(rng)).collect();
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    weights
        .iter()
        .map(|weight| {
            sum += weight / total;
            sum
        })
        .collect()
}

/// Xorshift64*, so that the workload does not depend on the crate under test.
pub struct XorShiftRng(pub u64);

impl XorShiftRng {
    pub fn unit(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / 9_007_199_254_740_992.0
    }
}
