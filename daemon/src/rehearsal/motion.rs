//! How the vehicle of a rehearsal really moves, and what its own sensors make of it.

use sim_channel::Stream;

/// What the vehicle's sensors tell of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Odometry {
    /// East, metres.
    pub dx_m: f64,
    /// North, metres.
    pub dy_m: f64,
    /// Heading clockwise from north, radians.
    pub heading_rad: f64,
}

/// Kinematics with drifting dead reckoning: a scale error and a heading error that stay, and a random walk.
#[derive(Debug)]
pub struct Motion {
    /// True place east, metres. Only the camera and the water may look.
    pub x_m: f64,
    /// True place north, metres.
    pub y_m: f64,
    /// True heading clockwise from north, radians.
    pub heading_rad: f64,
    /// Way so far, metres.
    pub distance_m: f64,
    speed_m_s: f64,
    scale_error: f64,
    heading_error_rad: f64,
    drift: f64,
    target: Option<(f64, f64)>,
    rising: bool,
    dice: Stream,
}

/// Speed up and down, metres a second: that of a small vehicle.
const VERTICAL_M_S: f64 = 0.3;

impl Motion {
    /// At rest at a place; `drift` is the error of dead reckoning a metre of way.
    pub fn new(x_m: f64, y_m: f64, speed_m_s: f64, drift: f64, seed: u64) -> Self {
        let mut dice = Stream::new(seed, &[1]);
        let scale_error = drift * dice.normal();
        let heading_error_rad = drift * dice.normal();
        let (heading_rad, distance_m, target, rising) = (0.0, 0.0, None, false);
        Self {
            x_m,
            y_m,
            heading_rad,
            distance_m,
            speed_m_s,
            scale_error,
            heading_error_rad,
            drift,
            target,
            rising,
            dice,
        }
    }

    /// Sets the waypoint (in the vehicle's own coordinates), or stops.
    pub fn set_target(&mut self, target: Option<(f64, f64)>) {
        (self.target, self.rising) = (target, false);
    }

    /// Goes up where it is.
    pub fn come_up(&mut self) {
        (self.target, self.rising) = (None, true);
    }

    /// The depth after `dt_s` seconds, from `depth_m` and with the survey at `survey_m` below the surface.
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

    /// Moves for `dt_s` seconds; `believed` is where the vehicle believes to be, which is what it steers by.
    pub fn step(&mut self, believed: (f64, f64), dt_s: f64) -> Odometry {
        let Some((tx, ty)) = self.target else {
            return Odometry { dx_m: 0.0, dy_m: 0.0, heading_rad: self.heading_rad };
        };
        let (to_x, to_y) = (tx - believed.0, ty - believed.1);
        let way = (self.speed_m_s * dt_s).min(to_x.hypot(to_y));
        if way > 1e-9 {
            self.heading_rad = to_x.atan2(to_y);
        }
        let (sin, cos) = self.heading_rad.sin_cos();
        // It believes to go straight at the target; the compass error turns the true way.
        let (true_sin, true_cos) = (self.heading_rad + self.heading_error_rad).sin_cos();
        self.x_m += way * true_sin;
        self.y_m += way * true_cos;
        self.distance_m += way;
        let measured = way * (1.0 + self.scale_error) + self.drift * way.sqrt() * 0.3 * self.dice.normal();
        Odometry { dx_m: measured * sin, dy_m: measured * cos, heading_rad: self.heading_rad }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_after_1_km(drift: f64, seed: u64) -> f64 {
        let mut motion = Motion::new(0.0, 0.0, 1.0, drift, seed);
        motion.set_target(Some((1e6, 0.0)));
        let mut believed = (0.0, 0.0);
        for _ in 0..2000 {
            let o = motion.step(believed, 0.5);
            believed = (believed.0 + o.dx_m, believed.1 + o.dy_m);
        }
        (believed.0 - motion.x_m).hypot(believed.1 - motion.y_m)
    }

    #[test]
    fn dead_reckoning_drifts_by_about_its_percentage_of_the_way() {
        let errors: Vec<f64> = (0..40).map(|seed| error_after_1_km(0.01, seed)).collect();
        let mean = errors.iter().sum::<f64>() / 40.0;
        assert!((6.0..20.0).contains(&mean), "{mean} m after 1 km at 1 %");
        assert!(error_after_1_km(0.0, 1) < 1e-6);
    }
}
