//! The scale of frames from their overlap and from a noisy altimeter.

use serde::{Deserialize, Serialize};

/// Standard deviation of the altimeter's log scale before its noise is known, and the frames for which this counts.
const FIRST_NOISE: f64 = 0.01;
const FIRST_FRAMES: f64 = 6.0;
/// An altimeter is never taken for better than this.
const MIN_NOISE: f64 = 0.002;
const MEMORY_FRAMES: f64 = 60.0;
/// Standard deviation of a change of scale that no image shows.
const UNSEEN_CHANGE: f64 = 0.1;

/// A Kalman filter of the log scale of the newest frame, against the size of a pixel by the altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct ScaleFilter {
    log_scale: f64,
    variance: f64,
    /// Mean square of the change of log scale by the images, and the frames in it.
    difference: f64,
    frames: f64,
}

impl ScaleFilter {
    /// A first frame, with the scale of its altitude.
    pub(crate) fn new() -> Self {
        Self {
            log_scale: 0.0,
            variance: FIRST_NOISE.powi(2),
            difference: 2.0 * FIRST_NOISE.powi(2),
            frames: FIRST_FRAMES,
        }
    }

    pub(crate) fn log_scale(&self) -> f64 {
        self.log_scale
    }

    /// A new frame. `changed` is the change of log scale since the frame before by the images, with its standard
    /// deviation.
    pub(crate) fn advance(&mut self, changed: Option<(f64, f64)>) {
        match changed {
            Some((change, sigma)) => {
                // An exact altimeter and exact images would find no change.
                let off = change.clamp(-0.1, 0.1);
                self.frames = (self.frames + 1.0).min(MEMORY_FRAMES);
                self.difference += (off * off - sigma * sigma - self.difference) / self.frames;
                self.log_scale += change;
                self.variance += sigma * sigma;
            }
            None => {
                self.log_scale = 0.0;
                self.variance += UNSEEN_CHANGE * UNSEEN_CHANGE;
            }
        }
    }

    /// The log scale of the newest frame by its overlap with an earlier frame.
    pub(crate) fn measure(&mut self, log_scale: f64, sigma: f64) {
        let gain = self.variance / (self.variance + sigma * sigma).max(1e-15);
        self.log_scale += gain * (log_scale - self.log_scale);
        self.variance *= 1.0 - gain;
    }

    /// Corrects the log scale by the altitude, which says 0.
    pub(crate) fn measure_altitude(&mut self) {
        let noise = (self.difference.max(0.0) / 2.0).sqrt().max(MIN_NOISE);
        self.measure(0.0, noise);
    }

    /// Whether the numbers can be those of a filter.
    pub(crate) fn is_sound(&self) -> bool {
        let small = [self.log_scale, self.variance, self.difference].into_iter().all(|value| value.abs() < 10.0);
        small && self.variance >= 0.0 && self.frames >= 1.0 && self.frames <= MEMORY_FRAMES
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest error after ten frames of a floor at a constant altitude, by an altimeter with errors in turn.
    fn worst(noise: f64) -> f64 {
        let error = |i: i32| noise * [0.3, -1.2, 0.8, 1.4, -0.9, -0.4][i as usize % 6];
        let mut filter = ScaleFilter::new();
        let mut worst = 0.0f64;
        for i in 1..60 {
            // A pixel that is believed too large has a negative log scale.
            filter.advance(Some((error(i - 1) - error(i), 0.0005)));
            filter.measure_altitude();
            if i > 10 {
                worst = worst.max((filter.log_scale() + error(i)).abs());
            }
        }
        worst
    }

    #[test]
    fn the_noise_of_an_altimeter_is_averaged() {
        assert!(worst(0.02) < 0.012, "{}", worst(0.02));
        assert!(worst(0.0) < 1e-9);
    }

    #[test]
    fn without_images_the_altitude_gives_the_scale() {
        let mut filter = ScaleFilter::new();
        filter.advance(Some((0.03, 0.001)));
        filter.advance(None);
        assert_eq!(filter.log_scale(), 0.0);
        assert!(filter.is_sound());
    }
}
