//! Running mean and variance.

use serde::{Deserialize, Serialize};

/// The sums behind the mean and the variance of one measured quantity.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    pub(super) fn add(&mut self, value: f32) {
        self.count += 1.0;
        self.sum += f64::from(value);
        self.squares += f64::from(value).powi(2);
    }

    /// Adds the points of a sample, each component to its own moments.
    pub(super) fn learn<const N: usize>(moments: &mut [Self; N], sample: &[[f32; N]]) {
        for point in sample {
            moments.iter_mut().zip(point).for_each(|(moments, &value)| moments.add(value));
        }
    }

    /// The mean, and 1 / standard deviation (0 if the variance is 0).
    pub(super) fn scale(&self) -> (f32, f32) {
        let count = self.count.max(1.0);
        let mean = self.sum / count;
        let variance = (self.squares / count - mean * mean).max(0.0);
        let inverse = if variance > 1e-12 { 1.0 / variance.sqrt() } else { 0.0 };
        (mean as f32, inverse as f32)
    }
}

/// The z-scores of values, given the mean and 1 / standard deviation of each.
pub(super) fn standardised<const N: usize>(values: &[f32; N], scales: &[(f32, f32); N]) -> [f32; N] {
    std::array::from_fn(|i| (values[i] - scales[i].0) * scales[i].1)
}
