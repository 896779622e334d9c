//! The true motion of a simulated vehicle, and the odometry of its drifting sensors.

use scenecast_core::wrap_rad;
use sim_channel::RandomStream;

/// The measured displacement of a step, in error by the drift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry {
    pub dx_m: f64,
    pub dy_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
}

/// Kinematics with drifting dead reckoning: a constant scale error, a constant heading error, and a random walk. With a
/// turn rate the vehicle turns while it moves. No sensor measures the current.
#[derive(Debug)]
pub struct Motion {
    /// True position east, metres. Only the simulated camera and channel may read it.
    pub x_m: f64,
    pub y_m: f64,
    /// True heading clockwise from north, radians.
    pub heading_rad: f64,
    pub distance_m: f64,
    speed_m_s: f64,
    scale_error: f64,
    heading_error_rad: f64,
    drift: f64,
    target: Option<(f64, f64)>,
    /// Turn rate, radians a second; `None` turns on the spot.
    turn_rate: Option<f64>,
    /// Current east and north, metres a second.
    current: (f64, f64),
    /// Position estimate of [`Self::step_on`], metres.
    estimated: (f64, f64),
    rising: bool,
    rng: RandomStream,
}

/// Vertical speed of a small vehicle, metres a second.
const VERTICAL_M_S: f64 = 0.3;

impl Motion {
    /// At rest at a position; `drift` is the error of dead reckoning per metre of path.
    pub fn new(x_m: f64, y_m: f64, speed_m_s: f64, drift: f64, seed: u64) -> Self {
        let mut rng = RandomStream::new(seed, &[1]);
        let scale_error = drift * rng.normal();
        let heading_error_rad = drift * rng.normal();
        Self {
            x_m,
            y_m,
            heading_rad: 0.0,
            distance_m: 0.0,
            speed_m_s,
            scale_error,
            heading_error_rad,
            drift,
            target: None,
            turn_rate: None,
            current: (0.0, 0.0),
            estimated: (0.0, 0.0),
            rising: false,
            rng,
        }
    }

    /// Limits the turn rate to `rad_s` radians a second; the vehicle moves while it turns.
    pub fn with_turn_rate(mut self, rad_s: f64) -> Self {
        self.turn_rate = (rad_s > 0.0).then_some(rad_s);
        self
    }

    /// Adds a current that no sensor measures, east and north, metres a second.
    pub fn with_current(mut self, east_m_s: f64, north_m_s: f64) -> Self {
        self.current = (east_m_s, north_m_s);
        self
    }

    /// Sets a target relative to the estimated position, metres east and north, or stops.
    pub fn set_relative_target(&mut self, offset: Option<(f64, f64)>) {
        let (x, y) = self.estimated;
        self.set_target(offset.map(|(east, north)| (x + east, y + north)));
    }

    /// Moves for `dt_s` seconds by its own dead reckoning.
    pub fn step_on(&mut self, dt_s: f64) -> Odometry {
        let step = self.step(self.estimated, dt_s);
        self.estimated = (self.estimated.0 + step.dx_m, self.estimated.1 + step.dy_m);
        step
    }

    /// Sets the target in the vehicle's estimated coordinates, or stops.
    pub fn set_target(&mut self, target: Option<(f64, f64)>) {
        (self.target, self.rising) = (target, false);
    }

    /// Surfaces at the current position.
    pub fn come_up(&mut self) {
        (self.target, self.rising) = (None, true);
    }

    /// Whether the vehicle comes up, or has come up.
    pub fn is_rising(&self) -> bool {
        self.rising
    }

    /// The depth `dt_s` seconds after it was `depth_m`, for a survey at `survey_m`, in metres below the surface.
    pub fn depth_m(&self, depth_m: f64, survey_m: f64, dt_s: f64) -> f64 {
        let aim = if self.rising {
            0.0
        } else if self.target.is_some() {
            survey_m
        } else {
            depth_m
        };
        depth_m + (aim - depth_m).clamp(-VERTICAL_M_S * dt_s, VERTICAL_M_S * dt_s)
    }

    /// Moves for `dt_s` seconds; it steers by `estimated`, its own position estimate.
    pub fn step(&mut self, estimated: (f64, f64), dt_s: f64) -> Odometry {
        self.x_m += self.current.0 * dt_s;
        self.y_m += self.current.1 * dt_s;
        let Some((tx, ty)) = self.target else {
            return Odometry { dx_m: 0.0, dy_m: 0.0, heading_rad: self.heading_rad };
        };
        let (to_x, to_y) = (tx - estimated.0, ty - estimated.1);
        let path_m = (self.speed_m_s * dt_s).min(to_x.hypot(to_y));
        if path_m > 1e-9 {
            let off = wrap_rad(to_x.atan2(to_y) - self.heading_rad);
            let most = self.turn_rate.map_or(f64::MAX, |rate| rate * dt_s);
            // A target within the turning circle would never be reached, so there the vehicle turns on the spot.
            let is_near = self.turn_rate.is_some_and(|rate| to_x.hypot(to_y) < 2.0 * self.speed_m_s / rate);
            self.heading_rad =
                if is_near || off.abs() <= most { to_x.atan2(to_y) } else { self.heading_rad + off.signum() * most };
        }
        let (sin, cos) = self.heading_rad.sin_cos();
        // The estimated heading points at the target; the compass error turns the true path.
        let (true_sin, true_cos) = (self.heading_rad + self.heading_error_rad).sin_cos();
        self.x_m += path_m * true_sin;
        self.y_m += path_m * true_cos;
        self.distance_m += path_m;
        let measured = path_m * (1.0 + self.scale_error) + self.drift * path_m.sqrt() * 0.3 * self.rng.normal();
        Odometry { dx_m: measured * sin, dy_m: measured * cos, heading_rad: self.heading_rad }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_after_1_km(drift: f64, seed: u64) -> f64 {
        let mut motion = Motion::new(0.0, 0.0, 1.0, drift, seed);
        motion.set_target(Some((1e6, 0.0)));
        let mut estimated = (0.0, 0.0);
        for _ in 0..2000 {
            let o = motion.step(estimated, 0.5);
            estimated = (estimated.0 + o.dx_m, estimated.1 + o.dy_m);
        }
        (estimated.0 - motion.x_m).hypot(estimated.1 - motion.y_m)
    }

    #[test]
    fn a_vehicle_arrives_at_any_turn_rate_and_turns_no_faster() {
        for target in [(40.0, 0.0), (-30.0, -30.0), (0.5, -1.0)] {
            let mut motion = Motion::new(0.0, 0.0, 1.0, 0.0, 1).with_turn_rate(0.2);
            motion.set_relative_target(Some(target));
            let (mut fastest, mut last) = (0.0f64, motion.heading_rad);
            for _ in 0..200 {
                motion.step_on(0.5);
                let far = (target.0 - motion.x_m).hypot(target.1 - motion.y_m) > 11.0;
                fastest = if far { fastest.max(wrap_rad(motion.heading_rad - last).abs()) } else { fastest };
                last = motion.heading_rad;
            }
            assert!((motion.x_m - target.0).hypot(motion.y_m - target.1) < 0.5, "{target:?}");
            assert!(fastest <= 0.1 + 1e-9, "{fastest} rad in half a second");
        }
    }

    #[test]
    fn a_current_moves_the_vehicle_unmeasured() {
        let mut motion = Motion::new(0.0, 0.0, 1.0, 0.0, 1).with_current(0.0, -0.1);
        let seen: f64 = (0..20).map(|_| motion.step_on(0.5).dy_m).sum();
        assert!((motion.y_m + 1.0).abs() < 1e-9 && seen == 0.0);
    }

    #[test]
    fn dead_reckoning_drifts_by_about_its_percentage_of_the_path() {
        let errors: Vec<f64> = (0..40).map(|seed| error_after_1_km(0.01, seed)).collect();
        let mean = errors.iter().sum::<f64>() / 40.0;
        assert!((6.0..20.0).contains(&mean), "{mean} m after 1 km at 1 %");
        assert!(error_after_1_km(0.0, 1) < 1e-6);
    }
}
