//! The systematic errors of odometry, learnt from displacements that the images measured.

use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
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
/// A shorter displacement says nothing about errors that grow with the path.
const MIN_PATH_M: f64 = 0.05;

/// Standard deviation of the mean height that images show, as a multiple of the variance of the heights: high ground
/// covers more of a frame, and steep ground matches less often.
const MEAN_HEIGHT: f64 = 6.0;

/// No floor is believed to be higher or lower than this, in multiples of the altitude.
const MAX_HEIGHT: f64 = 1.0;

/// A displacement that images measured, metres.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Seen {
    pub(crate) by: Vector2<f64>,
    /// Covariance of its errors that differ from frame to frame.
    pub(crate) covariance_m2: Matrix2<f64>,
    /// Variance of the heights of the floor, in squares of the altitude, and the share of it by which their mean over
    /// the overlap varies.
    pub(crate) relief: f64,
    pub(crate) alike: f64,
    /// Frames that are nearer than this show the same floor, metres.
    pub(crate) reach_m: f64,
}

/// A Kalman filter of the scale error and of the misalignment of the odometry.
///
/// A floor that is higher than believed lengthens the displacement that images show, in the same way from frame to frame
/// as long as they show the same floor. So this height is a part of the state: many frames over one bump say as little
/// about the odometry as one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct OdometryFilter {
    /// Expected error in metres for each metre of path.
    drift: f64,
    /// Scale error, height of the floor around the frame, and the mean that images show of the height; heights as shares
    /// of the altitude.
    along: Vector3<f64>,
    along_covariance: Matrix3<f64>,
    /// Largest variances of both heights so far.
    allowed: [f64; 2],
    misalignment: f64,
    misalignment_variance: f64,
    /// Mean square error of a corrected displacement for each metre of path, and the frames in it.
    noise: f64,
    frames: f64,
}

impl OdometryFilter {
    pub(crate) fn new(drift: f64) -> Self {
        let drift = drift.clamp(MIN_DRIFT, 0.5);
        Self {
            drift,
            along: Vector3::zeros(),
            along_covariance: Matrix3::from_diagonal(&Vector3::new(drift * drift, 0.0, 0.0)),
            allowed: [0.0; 2],
            misalignment: 0.0,
            misalignment_variance: drift * drift,
            noise: drift * drift,
            frames: FIRST_FRAMES,
        }
    }

    /// A measured displacement without its systematic error, and its standard deviation in each direction, metres.
    pub(crate) fn corrected(&self, by: Vector2<f64>) -> (Vector2<f64>, f64) {
        let (scale, turn) = (self.along[0], self.misalignment);
        let matrix = Matrix2::new(1.0 + scale, -turn, turn, 1.0 + scale);
        (matrix * by, (self.systematic_m2(by).trace() / 2.0 + self.noise * by.norm()).sqrt())
    }

    /// Covariance of a corrected displacement by errors that last, square metres.
    pub(crate) fn systematic_m2(&self, by: Vector2<f64>) -> Matrix2<f64> {
        let across = Vector2::new(-by.y, by.x);
        by * by.transpose() * self.along_covariance[(0, 0)] + across * across.transpose() * self.misalignment_variance
    }

    /// Learns from a displacement that both odometry and images measured. Returns it by both, and the covariance of its
    /// errors that differ from frame to frame.
    pub(crate) fn fuse(&mut self, by: Vector2<f64>, seen: &Seen) -> (Vector2<f64>, Matrix2<f64>) {
        let path = by.norm();
        let ahead = by.try_normalize(1e-9).unwrap_or(Vector2::new(1.0, 0.0));
        // Across the path, the direction of a positive misalignment.
        let across = Vector2::new(-ahead.y, ahead.x);
        let variance = |direction: Vector2<f64>| direction.dot(&(seen.covariance_m2 * direction));
        self.expect_height(path, seen);
        let (along_m, along_m2) = self.fuse_along(path, ahead.dot(&seen.by), variance(ahead));
        let (across_m, across_m2) = self.fuse_across(path, across.dot(&seen.by), variance(across));
        let covariance = ahead * ahead.transpose() * along_m2 + across * across.transpose() * across_m2;
        (ahead * along_m + across * across_m, covariance)
    }

    /// The height of the floor after a path: a first-order Gauss-Markov process about a mean.
    fn expect_height(&mut self, path: f64, seen: &Seen) {
        let kept = (-path / seen.reach_m.max(1e-3)).exp();
        let step = Matrix3::from_diagonal(&Vector3::new(1.0, kept, 1.0));
        self.along = step * self.along;
        self.along_covariance = step * self.along_covariance * step;
        let allowed = [seen.relief * seen.alike, (MEAN_HEIGHT * seen.relief).powi(2)];
        self.along_covariance[(1, 1)] += (1.0 - kept * kept) * self.allowed[0].min(allowed[0]);
        // Where the floor turns out to be rougher, its height was less certain than believed.
        for (i, variance) in allowed.into_iter().enumerate() {
            self.along_covariance[(i + 1, i + 1)] += (variance - self.allowed[i]).max(0.0);
            self.allowed[i] = self.allowed[i].max(variance);
        }
        let scale2 = self.along_covariance[(0, 0)];
        self.along_covariance[(0, 0)] = self.aged(scale2, path);
    }

    /// Takes the length of a displacement, and returns the one by both with the variance of its random error.
    fn fuse_along(&mut self, path: f64, seen: f64, variance: f64) -> (f64, f64) {
        let row = Vector3::repeat(path);
        let off = seen - path - row.dot(&self.along);
        let shared = self.along_covariance * row;
        let measured = variance + row.dot(&shared);
        let random = self.noise * path;
        let total = (measured + random).max(1e-12);
        if path >= MIN_PATH_M {
            self.learn_noise((off * off - measured) / path, measured / path);
            self.along += shared * (off / total);
            self.along[0] = self.bounded(self.along[0]);
            self.along[1] = self.along[1].clamp(-MAX_HEIGHT, MAX_HEIGHT);
            self.along[2] = self.along[2].clamp(-MAX_HEIGHT, MAX_HEIGHT);
            self.along_covariance -= shared * shared.transpose() / total;
        }
        (path * (1.0 + self.along[0]) + random / total * off, random * (1.0 - random / total))
    }

    /// Takes the displacement across the one by odometry, as [`Self::fuse_along`].
    fn fuse_across(&mut self, path: f64, seen: f64, variance: f64) -> (f64, f64) {
        self.misalignment_variance = self.aged(self.misalignment_variance, path);
        let off = seen - path * self.misalignment;
        let measured = variance + path * path * self.misalignment_variance;
        let random = self.noise * path;
        let total = (measured + random).max(1e-12);
        if path >= MIN_PATH_M {
            let gain = self.misalignment_variance * path / total;
            self.learn_noise((off * off - measured) / path, measured / path);
            self.misalignment = self.bounded(self.misalignment + gain * off);
            self.misalignment_variance *= 1.0 - gain * path;
        }
        (path * self.misalignment + random / total * off, random * (1.0 - random / total))
    }

    /// A variance after a path.
    fn aged(&self, variance: f64, path: f64) -> f64 {
        (variance * (1.0 + FORGETTING * path)).min(self.drift * self.drift)
    }

    fn bounded(&self, error: f64) -> f64 {
        error.clamp(-4.0 * self.drift, 4.0 * self.drift)
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
        let others =
            [self.misalignment, self.misalignment_variance, self.allowed[0], self.allowed[1], self.drift, self.noise];
        let mut all = self.along.iter().chain(&self.along_covariance).copied().chain(others);
        all.all(|value| value.abs() <= 10.0)
            && self.drift >= MIN_DRIFT
            && self.along_covariance.diagonal().min() >= -1e-12
            && self.misalignment_variance >= 0.0
            && self.noise > 0.0
            && self.frames >= 1.0
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
            let seen = Seen {
                by: truth * by,
                covariance_m2: Matrix2::identity() * 1.6e-5,
                relief: 0.0,
                alike: 1.0,
                reach_m: 5.0,
            };
            odometry.fuse(by, &seen);
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

    /// The scale error that is learnt from exact odometry over a floor whose height lengthens what images show.
    fn learnt(frames: usize, longer: f64, relief: f64) -> f64 {
        let mut odometry = OdometryFilter::new(0.01);
        let by = Vector2::new(1.0, 0.0);
        for _ in 0..frames {
            let covariance_m2 = Matrix2::identity() * 1.6e-5;
            odometry.fuse(by, &Seen { by: by * (1.0 + longer), covariance_m2, relief, alike: 0.2, reach_m: 2.8 });
        }
        assert!(odometry.is_sound());
        odometry.along[0]
    }

    #[test]
    fn frames_over_one_bump_teach_no_scale_error() {
        assert!(learnt(12, 0.06, 0.0225).abs() < 0.002, "{}", learnt(12, 0.06, 0.0225));
        assert!(learnt(12, 0.01, 0.0) > 0.008, "over a flat floor the images are right");
    }

    #[test]
    fn the_mean_height_of_a_rough_floor_is_no_scale_error() {
        assert!(learnt(300, 0.04, 0.03).abs() < 0.003, "{}", learnt(300, 0.04, 0.03));
    }

    #[test]
    fn over_a_rough_floor_a_displacement_is_that_of_the_odometry() {
        let mut odometry = OdometryFilter::new(0.01);
        let covariance_m2 = Matrix2::identity() * 1.6e-5;
        let seen = Seen { by: Vector2::new(1.08, 0.03), covariance_m2, relief: 0.03, alike: 0.2, reach_m: 2.8 };
        let (by, _) = odometry.fuse(Vector2::new(1.0, 0.0), &seen);
        assert!((by.x - 1.0).abs() < 0.005, "the parallax lies ahead: {by}");
        assert!((by.y - 0.03).abs() < 0.005, "images are exact across it: {by}");
    }
}
