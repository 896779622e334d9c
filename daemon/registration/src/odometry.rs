//! The systematic errors of odometry, learnt from displacements that the images measured.

use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

/// Frames that the estimate of the noise remembers.
const MEMORY_FRAMES: f64 = 60.0;
const FIRST_FRAMES: f64 = 6.0;
/// The noise is never taken for smaller than this share of the expected drift.
const MIN_SHARE: f64 = 0.2;
/// The expected drift is never taken for smaller than this: no log is better.
const MIN_DRIFT: f64 = 0.002;
/// The share of the variance that comes back with each metre, as errors of sensors change.
const FORGETTING: f64 = 0.002;

/// A Kalman filter of the scale error and of the misalignment of the odometry.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OdometryFilter {
    /// Expected error in metres for each metre of path.
    drift: f64,
    /// Scale error and misalignment, and their variances.
    errors: [f64; 2],
    variances: [f64; 2],
    /// Mean square error of a corrected displacement for each metre of path, and the frames in it.
    noise: f64,
    frames: f64,
}

impl OdometryFilter {
    pub(crate) fn new(drift: f64) -> Self {
        let drift = drift.clamp(MIN_DRIFT, 0.5);
        Self { drift, errors: [0.0; 2], variances: [drift * drift; 2], noise: drift * drift, frames: FIRST_FRAMES }
    }

    /// A measured displacement without its systematic error, and its standard deviation in each direction, metres.
    pub(crate) fn corrected(&self, by: Vector2<f64>) -> (Vector2<f64>, f64) {
        let [scale, turn] = self.errors;
        let matrix = Matrix2::new(1.0 + scale, -turn, turn, 1.0 + scale);
        let path = by.norm();
        let systematic = (self.variances[0] + self.variances[1]) / 2.0;
        (matrix * by, (systematic * path * path + self.noise * path).sqrt())
    }

    /// The images measured `seen` where the odometry measured `by`, with a covariance in square metres.
    pub(crate) fn learn(&mut self, by: Vector2<f64>, seen: Vector2<f64>, covariance: &Matrix2<f64>) {
        let path = by.norm();
        if path < 0.05 {
            return;
        }
        let off = seen - self.corrected(by).0;
        let ahead = by / path;
        // Across the path, the direction of a positive misalignment.
        let directions = [ahead, Vector2::new(-ahead.y, ahead.x)];
        for (i, direction) in directions.into_iter().enumerate() {
            let (off, seen2) = (direction.dot(&off), direction.dot(&(covariance * direction)));
            self.learn_noise((off * off - seen2 - self.variances[i] * path * path) / path, seen2 / path);
            let prior = (self.variances[i] * (1.0 + FORGETTING * path)).min(self.drift * self.drift);
            let gain = prior * path / (prior * path * path + seen2 + self.noise * path);
            let bound = 4.0 * self.drift;
            self.errors[i] = (self.errors[i] + gain * off).clamp(-bound, bound);
            self.variances[i] = prior * (1.0 - gain * path);
        }
    }

    /// A mean square error for each metre of path that was measured with a variance.
    fn learn_noise(&mut self, square: f64, seen2: f64) {
        let most = 4.0 * self.drift * self.drift;
        // Images that are less exact than the odometry say little about its noise.
        let weight = self.noise / (self.noise + seen2);
        self.frames = (self.frames + weight / 2.0).min(MEMORY_FRAMES);
        self.noise += weight / 2.0 * (square.clamp(-most, most) - self.noise) / self.frames;
        self.noise = self.noise.max((MIN_SHARE * self.drift).powi(2));
    }

    /// Whether the numbers can be those of a filter.
    pub(crate) fn is_sound(&self) -> bool {
        let [scale, turn] = self.errors;
        let [first, second] = self.variances;
        let small = [scale, turn, self.drift, first, second, self.noise].into_iter().all(|value| value.abs() <= 10.0);
        small && self.drift >= MIN_DRIFT && first >= 0.0 && second >= 0.0 && self.noise > 0.0 && self.frames >= 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scale_error_and_a_misalignment_are_learnt() {
        let mut odometry = OdometryFilter::new(0.03);
        let truth = Matrix2::new(1.02, 0.015, -0.015, 1.02);
        for i in 0..100 {
            let by = [Vector2::new(1.0, 0.0), Vector2::new(0.0, 1.0), Vector2::new(-1.0, 0.0)][i % 3];
            odometry.learn(by, truth * by, &(Matrix2::identity() * 1.6e-5));
        }
        let (corrected, sigma) = odometry.corrected(Vector2::new(0.6, 0.8));
        assert!((corrected - truth * Vector2::new(0.6, 0.8)).norm() < 0.002, "{odometry:?}");
        assert!(sigma < 0.01 && odometry.is_sound());
    }

    #[test]
    fn odometry_that_was_never_seen_has_the_expected_drift() {
        let (by, sigma) = OdometryFilter::new(0.01).corrected(Vector2::new(3.0, 4.0));
        assert!(by == Vector2::new(3.0, 4.0) && (0.05..0.06).contains(&sigma), "{sigma}");
    }
}
