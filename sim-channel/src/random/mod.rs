//! Seeded random streams, the only source of random numbers in this crate.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{RngCore, SeedableRng};
use std::f64::consts::TAU;

/// One random stream (xoshiro256++), named by a seed and a path of numbers.
///
/// ```
/// use sim_channel::RandomStream;
///
/// let (mut a, mut b) = (RandomStream::new(7, &[1, 2]), RandomStream::new(7, &[1, 2]));
/// assert_eq!(a.uniform(), b.uniform());
/// assert!((0..1000).all(|_| a.below(6) < 6));
/// ```
///
/// Streams with different paths are independent, so that a draw on one link never shifts the draws of another.
#[derive(Clone, Debug)]
pub struct RandomStream(Xoshiro256PlusPlus);

impl RandomStream {
    /// The stream of `seed` at `path`; equal arguments give equal streams.
    #[must_use]
    pub fn new(seed: u64, path: &[u64]) -> Self {
        let mixed = path.iter().fold(split_mix(seed), |state, step| split_mix(state ^ split_mix(*step)));
        Self(Xoshiro256PlusPlus::seed_from_u64(mixed))
    }

    /// Uniform in [0, 1), with 53 random bits.
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// True with the given probability; takes exactly one draw for any probability.
    pub fn bernoulli(&mut self, probability: f64) -> bool {
        self.uniform() < probability
    }

    /// Uniform in 0..`bound`; 0 if `bound` is 0.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.uniform() * bound as f64) as usize
    }

    /// Normal with mean 0 and standard deviation 1 (Box and Muller, cosine branch).
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (TAU * self.uniform()).cos()
    }

    /// Exponentially distributed with the given mean, in its unit.
    pub fn exponential(&mut self, mean: f64) -> f64 {
        -mean * (1.0 - self.uniform()).ln()
    }
}

/// One step of SplitMix64 (Steele, Lea and Flood 2014).
fn split_mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mean(draws: usize, mut draw: impl FnMut() -> f64) -> f64 {
        (0..draws).map(|_| draw()).sum::<f64>() / draws as f64
    }

    #[test]
    fn equal_paths_repeat_and_different_paths_differ() {
        let take = |path: &[u64]| {
            let mut stream = RandomStream::new(7, path);
            (0..4).map(|_| stream.uniform()).collect::<Vec<_>>()
        };
        assert_eq!(take(&[1, 2]), take(&[1, 2]));
        assert_ne!(take(&[1, 2]), take(&[2, 1]));
    }

    #[test]
    fn moments_match_the_distributions() {
        let mut stream = RandomStream::new(3, &[]);
        assert!((mean(200_000, || stream.uniform()) - 0.5).abs() < 0.003);
        assert!((mean(200_000, || stream.exponential(4.0)) - 4.0).abs() < 0.04);
        assert!(mean(200_000, || stream.normal()).abs() < 0.01);
        assert!((mean(200_000, || stream.normal().powi(2)) - 1.0).abs() < 0.02);
    }

    #[test]
    fn below_zero_is_zero() {
        assert_eq!(RandomStream::new(1, &[]).below(0), 0);
    }
}
