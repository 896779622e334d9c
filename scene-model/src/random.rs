//! Counter-based random numbers: a value is a function of a key and a counter.
//!
//! The order in which values are computed does not matter, nor does the thread. The numbers are a part of the crate's
//! contract: labels, checkpoints and procedural worlds depend on them bit for bit. They are not fit for cryptography.
//!
//! ```
//! use scene_model::random::{CounterRng, derive};
//!
//! let mission_seed = 7;
//! let mut camera_noise = CounterRng::new(derive(mission_seed, 1));
//! let mut drift = CounterRng::new(derive(mission_seed, 2));
//!
//! // Draws from one stream leave the other unchanged.
//! let (noise, step) = (camera_noise.unit(), drift.normal());
//! assert_eq!(CounterRng::new(derive(mission_seed, 2)).normal(), step);
//! assert!((0.0..1.0).contains(&noise) && camera_noise.below(6) < 6);
//! ```

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection that spreads every input bit over the output.
#[inline(always)]
#[must_use]
pub fn mix(value: u64) -> u64 {
    let mut x = value;
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Returns the key of the independent stream number `stream` under `key`.
#[inline(always)]
#[must_use]
pub fn derive(key: u64, stream: u64) -> u64 {
    mix(key ^ mix(stream.wrapping_add(GOLDEN)))
}

/// The `counter`-th value of the stream `key`, uniform on [0, 1) in steps of 2^-24.
#[inline(always)]
pub(crate) fn unit_f32(key: u64, counter: u64) -> f32 {
    let bits = mix(key.wrapping_add(counter.wrapping_mul(GOLDEN))) >> 40;
    bits as u32 as i32 as f32 * (1.0 / 16_777_216.0)
}

/// A sequence of random values: the stream of a key, and a counter.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub struct CounterRng {
    key: u64,
    counter: u64,
}

impl CounterRng {
    /// Returns the stream of `key`, at its beginning. Equal keys give equal values.
    #[must_use]
    pub fn new(key: u64) -> Self {
        Self { key: mix(key.wrapping_add(GOLDEN)), counter: 0 }
    }

    /// Returns the next 64 random bits.
    pub fn next_u64(&mut self) -> u64 {
        self.counter += 1;
        mix(self.key.wrapping_add(self.counter.wrapping_mul(GOLDEN)))
    }

    /// Returns a value that is uniform on [0, 1), in steps of 2^-53.
    pub fn unit(&mut self) -> f64 {
        (self.next_u64() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0)
    }

    /// Returns a value that is uniform on `0..bound`, or 0 if the bound is 0.
    pub fn below(&mut self, bound: usize) -> usize {
        ((u128::from(self.next_u64()) * bound as u128) >> 64) as usize
    }

    /// Returns a standard normal value, by the method of Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.unit()).cos()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_uniform_and_below_one() {
        let mut sum = 0.0;
        for i in 0..100_000 {
            let value = unit_f32(7, i);
            assert!((0.0..1.0).contains(&value));
            sum += f64::from(value);
        }
        assert!((sum / 100_000.0 - 0.5).abs() < 0.005);
    }

    #[test]
    fn normal_values_have_unit_variance() {
        let mut stream = CounterRng::new(3);
        let squares: f64 = (0..50_000).map(|_| stream.normal().powi(2)).sum();
        assert!((squares / 50_000.0 - 1.0).abs() < 0.03);
    }
}
