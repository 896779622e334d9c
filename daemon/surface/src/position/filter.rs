//! A Kalman filter of a position in the plane, with nearly constant velocity.

/// A position with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub x_m: f64,
    pub y_m: f64,
    /// Covariance of x and y, square metres: xx, xy, yy.
    pub cov_m2: [f64; 3],
}

impl Estimate {
    /// A position with the same uncertainty in every direction.
    pub fn round(x_m: f64, y_m: f64, sigma_m: f64) -> Self {
        Self { x_m, y_m, cov_m2: [sigma_m * sigma_m, 0.0, sigma_m * sigma_m] }
    }

    /// Standard deviation of one coordinate in metres, averaged over all directions.
    pub fn sigma_m(&self) -> f64 {
        ((self.cov_m2[0] + self.cov_m2[2]) / 2.0).max(0.0).sqrt()
    }

    /// Whether every number is finite.
    pub fn is_finite(&self) -> bool {
        [self.x_m, self.y_m].into_iter().chain(self.cov_m2).all(f64::is_finite)
    }
}

/// The decision about a measurement.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeasurementVerdict {
    Used,
    /// It is too far from the prediction.
    Outlier,
    /// It is far from the prediction, but so were those before it, at the same place. The
    /// filter has started again there.
    Restarted,
}

/// A filter with constant velocity and random acceleration, which refuses outliers.
#[derive(Debug, Clone)]
pub struct PlaneFilter {
    /// Standard deviation of the acceleration, metres a second squared over a second.
    acceleration: f64,
    state: Option<FilterState>,
    /// The number of refused measurements in a row that agreed with each other, and the last one with its time.
    refused: (u32, Option<(f64, Estimate)>),
}

#[derive(Debug, Clone, Copy)]
struct FilterState {
    at_s: f64,
    place: [f64; 2],
    velocity: [f64; 2],
    /// Covariance of each axis: position, position and velocity, velocity. An elliptical measurement
    /// is taken axis by axis.
    p: [[f64; 3]; 2],
}

impl PlaneFilter {
    /// The squared Mahalanobis distance with two degrees of freedom that one of a thousand good measurements exceeds.
    pub const GATE: f64 = 13.8;
    /// The number of refused measurements in a row that agree with each other after which they are trusted.
    const MIN_AGREEING: u32 = 4;
    /// Standard deviation of the initial velocity, m/s.
    const FIRST_SPEED: f64 = 1.0;
    /// The filter starts again after this many seconds without a measurement.
    const TIMEOUT_S: f64 = 600.0;

    /// A filter of a body that accelerates by about `acceleration` m/s2 over a second.
    pub fn new(acceleration: f64) -> Self {
        Self { acceleration, state: None, refused: (0, None) }
    }

    /// The position at `at_s`, seconds.
    pub fn predict(&self, at_s: f64) -> Option<Estimate> {
        let s = self.state?.moved(at_s, self.acceleration);
        Some(Estimate { x_m: s.place[0], y_m: s.place[1], cov_m2: [s.p[0][0], 0.0, s.p[1][0]] })
    }

    /// East and north, metres a second.
    pub fn velocity(&self) -> Option<(f64, f64)> {
        self.state.map(|s| (s.velocity[0], s.velocity[1]))
    }

    /// Takes a measurement of the time `at_s`. One from before the last is moved to the
    /// last, with a larger uncertainty.
    pub fn update(&mut self, seen: &Estimate, at_s: f64) -> MeasurementVerdict {
        let state = self.state.filter(|s| at_s - s.at_s < Self::TIMEOUT_S);
        let Some(state) = state else {
            self.begin(seen, at_s);
            return MeasurementVerdict::Used;
        };
        let late_s = (state.at_s - at_s).max(0.0);
        // The measurement is moved along the velocity. A turn in the meantime adds to the uncertainty.
        let seen_now = Estimate {
            x_m: seen.x_m + state.velocity[0] * late_s,
            y_m: seen.y_m + state.velocity[1] * late_s,
            cov_m2: {
                let turned = (self.acceleration * late_s * late_s / 2.0).powi(2);
                [seen.cov_m2[0] + turned, seen.cov_m2[1], seen.cov_m2[2] + turned]
            },
        };
        let mut moved = state.moved(at_s.max(state.at_s), self.acceleration);
        if moved.distance2(&seen_now) > Self::GATE {
            return self.refuse(seen, at_s);
        }
        self.refused = (0, None);
        moved.correct(&seen_now);
        self.state = Some(moved);
        MeasurementVerdict::Used
    }

    fn refuse(&mut self, seen: &Estimate, at_s: f64) -> MeasurementVerdict {
        let agrees = self.refused.1.is_some_and(|(before_s, before)| {
            let reach = 3.0 * (before.sigma_m().hypot(seen.sigma_m())) + 2.0 * (at_s - before_s).abs();
            (seen.x_m - before.x_m).hypot(seen.y_m - before.y_m) < reach
        });
        let row = if agrees { self.refused.0 + 1 } else { 1 };
        if row < Self::MIN_AGREEING {
            self.refused = (row, Some((at_s, *seen)));
            return MeasurementVerdict::Outlier;
        }
        self.begin(seen, at_s);
        MeasurementVerdict::Restarted
    }

    fn begin(&mut self, seen: &Estimate, at_s: f64) {
        let axis = |variance: f64| [variance, 0.0, Self::FIRST_SPEED.powi(2)];
        let p = [axis(seen.cov_m2[0]), axis(seen.cov_m2[2])];
        self.state = Some(FilterState { at_s, place: [seen.x_m, seen.y_m], velocity: [0.0; 2], p });
        self.refused = (0, None);
    }
}

impl FilterState {
    fn moved(mut self, at_s: f64, acceleration: f64) -> Self {
        let dt = (at_s - self.at_s).clamp(0.0, 3600.0);
        let q = acceleration * acceleration;
        for axis in 0..2 {
            self.place[axis] += self.velocity[axis] * dt;
            let [place, both, velocity] = self.p[axis];
            self.p[axis] = [
                place + 2.0 * dt * both + dt * dt * velocity + q * dt.powi(3) / 3.0,
                both + dt * velocity + q * dt * dt / 2.0,
                velocity + q * dt,
            ];
        }
        self.at_s = self.at_s.max(at_s);
        self
    }

    fn distance2(&self, seen: &Estimate) -> f64 {
        let (dx, dy) = (seen.x_m - self.place[0], seen.y_m - self.place[1]);
        let [xx, xy, yy] = seen.cov_m2;
        let (xx, yy) = (xx + self.p[0][0], yy + self.p[1][0]);
        let determinant = (xx * yy - xy * xy).max(1e-9);
        (dx * dx * yy - 2.0 * dx * dy * xy + dy * dy * xx) / determinant
    }

    fn correct(&mut self, seen: &Estimate) {
        for (axis, (value, variance)) in
            [(seen.x_m, seen.cov_m2[0]), (seen.y_m, seen.cov_m2[2])].into_iter().enumerate()
        {
            let [place, both, velocity] = self.p[axis];
            let s = (place + variance).max(1e-9);
            let (k, kv) = (place / s, both / s);
            let off = value - self.place[axis];
            self.place[axis] += k * off;
            self.velocity[axis] += kv * off;
            self.p[axis] = [place * (1.0 - k), both * (1.0 - k), velocity - kv * both];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_motion_is_filtered_below_measurement_noise() {
        let mut random = 1_u64;
        let mut unit = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1_u64 << 53) as f64
        };
        // Nearly normal: the sum of twelve uniform numbers has the variance 1.
        let mut normal = || (0..12).map(|_| unit()).sum::<f64>() - 6.0;
        let mut filter = PlaneFilter::new(0.02);
        let mut worst: f64 = 0.0;
        for s in 0..200 {
            let t = f64::from(s);
            let seen = Estimate::round(t + 3.0 * normal(), 2.0 * t + 3.0 * normal(), 3.0);
            assert_ne!(filter.update(&seen, t), MeasurementVerdict::Restarted);
            if s > 50 {
                let e = filter.predict(t).unwrap();
                worst = worst.max((e.x_m - t).hypot(e.y_m - 2.0 * t));
            }
        }
        assert!(worst < 3.0, "{worst}");
        let (vx, vy) = filter.velocity().unwrap();
        assert!((vx - 1.0).abs() < 0.2 && (vy - 2.0).abs() < 0.2, "{vx} {vy}");
    }

    #[test]
    fn an_echo_is_refused_until_it_repeats() {
        let mut filter = PlaneFilter::new(0.02);
        for s in 0..20 {
            filter.update(&Estimate::round(0.0, 0.0, 1.0), f64::from(s));
        }
        assert_eq!(filter.update(&Estimate::round(40.0, 0.0, 1.0), 20.0), MeasurementVerdict::Outlier);
        assert_eq!(filter.update(&Estimate::round(-300.0, 0.0, 1.0), 21.0), MeasurementVerdict::Outlier);
        assert_eq!(filter.update(&Estimate::round(0.5, 0.0, 1.0), 22.0), MeasurementVerdict::Used);
        let verdicts: Vec<_> =
            (23..28).map(|s| filter.update(&Estimate::round(40.0, 0.0, 1.0), f64::from(s))).collect();
        assert_eq!(verdicts[3], MeasurementVerdict::Restarted, "{verdicts:?}");
        assert!((filter.predict(28.0).unwrap().x_m - 40.0).abs() < 1.0);
    }
}
