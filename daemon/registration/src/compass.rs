//! The heading of frames from their overlap and from a compass with a deviation that depends on the heading.

use nalgebra::{SMatrix, SVector};
use scenecast_core::wrap_rad;
use serde::{Deserialize, Serialize};

/// The heading, and the deviation as two harmonics of the compass heading.
const N: usize = 5;
type State = SVector<f64, N>;
type Covariance = SMatrix<f64, N, N>;

/// Standard deviations of the first and second harmonic before the first turn, radians.
const DEVIATION_SIGMA: [f64; 2] = [0.035, 0.012];
/// Standard deviation of the compass before its noise is known, radians, and the frames for which this counts.
const FIRST_NOISE: f64 = 0.009;
const FIRST_FRAMES: f64 = 6.0;
/// A compass is never taken for better than this, radians: its errors last from frame to frame.
const MIN_NOISE: f64 = 0.0015;
/// Frames that the estimate of the noise remembers.
const MEMORY_FRAMES: f64 = 60.0;
/// A change of heading in radians up to which the deviation is taken as constant.
const STRAIGHT: f64 = 0.1;
/// Standard deviation of a turn that no image shows, radians.
const UNSEEN_TURN: f64 = 0.1;

/// A Kalman filter of the heading of the newest frame and of the compass deviation.
///
/// The heading of the first frame is the compass's: a constant error turns the map as a whole.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct HeadingFilter {
    state: [f64; N],
    covariance: Vec<f64>,
    /// The compass heading of the first and of the last frame, radians.
    first: f64,
    last: f64,
    /// Mean square of the difference between turns by the compass and by images, and the frames in it.
    difference: f64,
    frames: f64,
}

impl HeadingFilter {
    pub(crate) fn new(compass_rad: f64) -> Self {
        let mut covariance = Covariance::zeros();
        for i in 1..N {
            covariance[(i, i)] = DEVIATION_SIGMA[(i - 1) / 2].powi(2);
        }
        Self {
            state: [compass_rad, 0.0, 0.0, 0.0, 0.0],
            covariance: covariance.iter().copied().collect(),
            first: compass_rad,
            last: compass_rad,
            difference: 2.0 * FIRST_NOISE.powi(2),
            frames: FIRST_FRAMES,
        }
    }

    pub(crate) fn heading_rad(&self) -> f64 {
        self.state[0]
    }

    /// The heading that the compass shows without its deviation, as far as it is known, and its standard deviation.
    pub(crate) fn corrected(&self, compass_rad: f64) -> (f64, f64) {
        let row = self.row(compass_rad);
        let (state, covariance) = self.parts();
        let mut deviation = row;
        deviation[0] = 0.0;
        let variance = (covariance * deviation).dot(&deviation) + self.noise().powi(2);
        (compass_rad - deviation.dot(&state), variance.max(0.0).sqrt())
    }

    /// A new frame with its compass heading. `turned` is the clockwise turn since the frame before by the images, with
    /// its standard deviation, radians.
    pub(crate) fn advance(&mut self, compass_rad: f64, turned: Option<(f64, f64)>) {
        let by_compass = wrap_rad(compass_rad - self.last);
        let (turn, sigma) = turned.unwrap_or((by_compass, UNSEEN_TURN));
        if turned.is_some() && by_compass.abs() < STRAIGHT {
            let off = wrap_rad(by_compass - turn).clamp(-0.05, 0.05);
            self.frames = (self.frames + 1.0).min(MEMORY_FRAMES);
            self.difference += (off * off - sigma * sigma - self.difference) / self.frames;
        }
        self.last = compass_rad;
        let (mut state, mut covariance) = self.parts();
        state[0] = wrap_rad(state[0] + turn);
        covariance[(0, 0)] += sigma * sigma;
        self.set(state, covariance);
    }

    /// The heading of the newest frame by its overlap with an earlier frame.
    pub(crate) fn measure(&mut self, heading_rad: f64, sigma: f64) {
        let row = State::from([1.0, 0.0, 0.0, 0.0, 0.0]);
        self.update(row, wrap_rad(heading_rad - self.state[0]), sigma);
    }

    /// Corrects the heading of the newest frame by its compass heading.
    pub(crate) fn measure_compass(&mut self) {
        let row = self.row(self.last);
        let (state, covariance) = self.parts();
        let mut deviation = row;
        deviation[0] = 0.0;
        let off = wrap_rad(self.last - state[0] - deviation.dot(&state));
        let expected = ((covariance * row).dot(&row) + self.noise().powi(2)).sqrt();
        // An error beyond the expected ones, as beside iron, counts less.
        let doubt = (off.abs() / (3.0 * expected)).max(1.0);
        self.update(row, off, self.noise() * doubt);
    }

    fn noise(&self) -> f64 {
        (self.difference.max(0.0) / 2.0).sqrt().max(MIN_NOISE)
    }

    /// The derivatives of the compass heading with respect to the state.
    fn row(&self, compass_rad: f64) -> State {
        let part = |k: f64| {
            let ((sin, cos), (first_sin, first_cos)) = ((k * compass_rad).sin_cos(), (k * self.first).sin_cos());
            [sin - first_sin, cos - first_cos]
        };
        let ([a, b], [c, d]) = (part(1.0), part(2.0));
        State::from([1.0, a, b, c, d])
    }

    fn update(&mut self, row: State, off: f64, sigma: f64) {
        let (state, covariance) = self.parts();
        let gain = covariance * row / ((covariance * row).dot(&row) + sigma * sigma).max(1e-12);
        let mut covariance = covariance - gain * (covariance * row).transpose();
        covariance = (covariance + covariance.transpose()) / 2.0;
        for i in 0..N {
            covariance[(i, i)] = covariance[(i, i)].max(0.0);
        }
        let mut state = state + gain * off;
        state[0] = wrap_rad(state[0]);
        self.set(state, covariance);
    }

    fn parts(&self) -> (State, Covariance) {
        (State::from(self.state), Covariance::from_iterator(self.covariance.iter().copied()))
    }

    fn set(&mut self, state: State, covariance: Covariance) {
        self.state = state.into();
        self.covariance = covariance.iter().copied().collect();
    }

    /// Whether the numbers can be those of a filter.
    pub(crate) fn is_sound(&self) -> bool {
        let others = [self.first, self.last, self.difference, self.frames];
        let all = self.state.iter().chain(&self.covariance).chain(&others);
        self.covariance.len() == N * N && all.copied().all(|value| value.abs() < 1e6) && self.frames >= 1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Legs in alternating direction, with images that measure turns to 0.0008 rad.
    fn survey(deviation: impl Fn(f64) -> f64, noise: f64) -> Vec<f64> {
        let mut random = 1u64;
        let mut normal = || {
            let mut unit = || {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (random >> 11) as f64 / (1u64 << 53) as f64
            };
            (0..12).map(|_| unit()).sum::<f64>() - 6.0
        };
        let headings: Vec<f64> = (0..150).map(|i| [1.57, 0.0, -1.57, 0.0][i / 25 % 4]).collect();
        let mut filter: Option<HeadingFilter> = None;
        let mut errors = Vec::new();
        let mut before = headings[0];
        for heading in headings {
            let compass = heading + deviation(heading) + noise * normal();
            match &mut filter {
                None => filter = Some(HeadingFilter::new(compass)),
                Some(filter) => {
                    filter.advance(compass, Some((heading - before + 0.0008 * normal(), 0.0008)));
                    filter.measure_compass();
                }
            }
            before = heading;
            errors.push(wrap_rad(filter.as_ref().unwrap().heading_rad() - heading));
        }
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        errors.iter().map(|error| (error - mean).to_degrees()).collect()
    }

    fn worst(errors: &[f64]) -> f64 {
        errors.iter().map(|error| error.abs()).fold(0.0, f64::max)
    }

    #[test]
    fn an_exact_compass_keeps_the_heading() {
        let errors = survey(|_| 0.0, 0.0);
        assert!(worst(&errors) < 0.15, "{} degrees", worst(&errors));
    }

    #[test]
    fn a_deviation_is_learnt_at_the_turns() {
        let errors = survey(|heading| 3f64.to_radians() * (heading - 0.5).sin(), 0.0);
        assert!(worst(&errors) < 0.35, "{} degrees", worst(&errors));
    }

    #[test]
    fn a_noisy_compass_counts_little() {
        let errors = survey(|_| 0.0, 2f64.to_radians());
        assert!(worst(&errors) < 1.0, "{} degrees", worst(&errors));
    }

    #[test]
    fn without_images_the_compass_gives_the_heading() {
        let mut filter = HeadingFilter::new(0.3);
        for i in 1..20 {
            filter.advance(0.3 + 0.1 * f64::from(i), None);
            filter.measure_compass();
        }
        assert!(wrap_rad(filter.heading_rad() - 2.2).abs() < 1e-6, "{}", filter.heading_rad());
        assert!(filter.is_sound());
    }
}
