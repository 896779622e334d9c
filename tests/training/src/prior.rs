//! Training of the prior on procedural maps.

use crate::{Lesson, lessons};
use scenecast_protocol::map_codec::training::{BitEstimate, STAGES, TrainablePrior, TrainingCoder, VisitCounts};

/// Procedural scenes that the shipped prior is trained on, with seed 1.
pub const PRIOR_SCENES: u64 = 1500;

/// The table of a prior, trained on the lessons of `scenes` procedural scenes. The same seed gives the same table.
///
/// `progress` is called with the progress in thousandths. Floating point is used for sums and quotients here,
/// and nowhere in the coder.
pub fn train_prior(seed: u64, scenes: u64, progress: &mut dyn FnMut(u64)) -> Vec<u8> {
    let mut prior = TrainablePrior::blank();
    let mut pass = 0;
    let mut each = |prior: &TrainablePrior, lesson: &mut dyn FnMut(&mut TrainingCoder, &Lesson)| {
        // The coder borrows its prior for the length of the program: a handful of small tables.
        let prior: &'static TrainablePrior = Box::leak(Box::new(prior.clone()));
        let mut carried: Option<TrainingCoder> = None;
        for scene in 0..scenes {
            for one in lessons(seed.wrapping_mul(1_000_003).wrapping_add(scene)) {
                let mut coder = TrainingCoder::new(prior);
                if let Some(before) = &carried {
                    coder.carry_weights(before);
                }
                lesson(&mut coder, &one);
                carried = Some(coder);
            }
            progress((pass * scenes + scene) * 1000 / (PASSES * scenes));
        }
        pass += 1;
        carried.unwrap_or_else(|| TrainingCoder::new(prior))
    };
    for is_refined in [false, true] {
        let mut sums = Sums::of(&prior, is_refined);
        each(&prior, &mut |coder, lesson| {
            coder.count_visits();
            code(coder, lesson);
            sums.add(&coder.take_counts());
        });
        prior.set_estimates(sums.estimates());
    }
    for rate in [6, 2] {
        let mut last = each(&prior, &mut |coder, lesson| {
            coder.set_weight_rate(rate);
            code(coder, lesson);
        });
        prior.take_weights(&mut last);
    }
    prior.to_bytes()
}

const PASSES: u64 = 4;

fn code(coder: &mut TrainingCoder, lesson: &Lesson) {
    coder.code(&lesson.base.to_grid(), &lesson.target, lesson.rect);
}

/// The decisions in one context over all lessons.
#[derive(Debug, Clone, Copy, Default)]
struct ContextSums {
    /// Weight of a visit beyond the first of the same chunk: 1 if all chunks are alike, 0 if every chunk is different.
    alike: f64,
    visits: f64,
    ones: f64,
    ones_squared: f64,
    ones_visits: f64,
    visits_squared: f64,
    weight: f64,
    share: f64,
}

impl ContextSums {
    fn add(&mut self, visits: u32, ones: u32) {
        if visits == 0 {
            return;
        }
        let (n, k) = (f64::from(visits), f64::from(ones));
        self.visits += n;
        self.ones += k;
        self.ones_squared += k * k;
        self.ones_visits += k * n;
        self.visits_squared += n * n;
        let weight = n / (1.0 + (n - 1.0) * (1.0 - self.alike));
        self.weight += weight;
        self.share += weight * k / n;
    }

    /// The beta-binomial distribution by moments: its mean, and the number of visits that it is worth in a new chunk.
    fn estimate(&self) -> BitEstimate {
        if self.visits == 0.0 {
            return BitEstimate::BLANK;
        }
        let p = (self.share + 0.02) / (self.weight + 0.04);
        let spread = self.ones_squared - 2.0 * p * self.ones_visits + p * p * self.visits_squared;
        let pairs = self.visits_squared - self.visits;
        let unlike = if pairs > 0.0 { (spread / (p * (1.0 - p)) - self.visits) / pairs } else { 1.0 };
        let max_visits = f64::from(BitEstimate::MAX_VISITS);
        let visits = (1.0 / unlike.clamp(0.0005, 1.0) - 1.0).min(self.visits / 2.0).clamp(0.0, max_visits);
        BitEstimate { p: (p * 4_294_967_295.0) as u32, visits: visits as u16 }
    }
}

struct Sums([Vec<ContextSums>; STAGES]);

impl Sums {
    /// If `is_refined`, chunks are weighted by how alike they are according to `prior`.
    fn of(prior: &TrainablePrior, is_refined: bool) -> Self {
        let alike = |e: &BitEstimate| if is_refined { 1.0 - 1.0 / (f64::from(e.visits) + 1.0) } else { 1.0 };
        let sums = |estimates: &[BitEstimate]| {
            estimates.iter().map(|e| ContextSums { alike: alike(e), ..ContextSums::default() }).collect()
        };
        Self(prior.estimates().map(sums))
    }

    fn add(&mut self, counts: &[VisitCounts; STAGES]) {
        for (sums, counts) in self.0.iter_mut().zip(counts) {
            counts.iter().for_each(|(context, visits, ones)| sums[context].add(visits, ones));
        }
    }

    fn estimates(&self) -> [Vec<BitEstimate>; STAGES] {
        self.0.each_ref().map(|sums| sums.iter().map(ContextSums::estimate).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHIPPED: &[u8] = include_bytes!("../../../protocol/src/map_codec/context/prior.bin");

    #[test]
    #[ignore = "takes minutes: cargo test --release -p scenecast-training -- --ignored"]
    fn the_documented_seed_gives_the_shipped_table() {
        assert!(train_prior(1, PRIOR_SCENES, &mut |_| ()) == SHIPPED);
    }

    #[test]
    fn training_is_reproducible_and_keeps_the_layout() {
        let table = |seed| train_prior(seed, 2, &mut |_| ());
        assert!(table(1) == table(1));
        assert!(table(1) != table(2));
        assert_eq!(table(1).len(), SHIPPED.len());
    }
}
