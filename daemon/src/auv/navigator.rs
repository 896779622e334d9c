//! Where the vehicle believes it is.

use scenecast_protocol::time::Instant;
use std::collections::VecDeque;

/// Dead reckoning, corrected by fixes that may come late.
#[derive(Debug)]
pub struct Navigator {
    x_m: f64,
    y_m: f64,
    heading_rad: f64,
    depth_m: f64,
    variance_m2: f64,
    drift: f64,
    /// Estimates of the past, for fixes that tell where the vehicle was.
    track: VecDeque<(Instant, f64, f64)>,
    last_fix: Option<Instant>,
}

impl Navigator {
    /// Oldest fix that is of use.
    const MEMORY_S: f64 = 120.0;

    /// At `(x_m, y_m)` for certain; `drift` is the expected error a metre of way.
    pub fn new(x_m: f64, y_m: f64, depth_m: f64, drift: f64) -> Self {
        let track = VecDeque::new();
        Self { x_m, y_m, heading_rad: 0.0, depth_m, variance_m2: 0.0, drift, track, last_fix: None }
    }

    /// East and north of the origin, metres.
    pub fn position(&self) -> (f64, f64) {
        (self.x_m, self.y_m)
    }

    /// Heading clockwise from north, radians.
    pub fn heading_rad(&self) -> f64 {
        self.heading_rad
    }

    /// Depth below the surface, metres.
    pub fn depth_m(&self) -> f64 {
        self.depth_m
    }

    /// Standard deviation of the position, metres.
    pub fn sigma_m(&self) -> f64 {
        self.variance_m2.sqrt()
    }

    /// When the last fix was used.
    pub fn last_fix(&self) -> Option<Instant> {
        self.last_fix
    }

    /// The vehicle's own sensors say that it moved by so much since the last call.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        self.x_m += dx_m;
        self.y_m += dy_m;
        self.heading_rad = heading_rad;
        self.depth_m = depth_m;
        self.variance_m2 += (self.drift * dx_m.hypot(dy_m)).powi(2) + self.drift * dx_m.hypot(dy_m) * self.sigma_m();
        self.track.push_back((now, self.x_m, self.y_m));
        while self.track.front().is_some_and(|(at, ..)| now.since(*at).as_secs_f64() > Self::MEMORY_S) {
            self.track.pop_front();
        }
    }

    /// The position is known from elsewhere, as in a recorded mission.
    pub fn set_pose(&mut self, x_m: f64, y_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        (self.x_m, self.y_m, self.heading_rad, self.depth_m) = (x_m, y_m, heading_rad, depth_m);
        self.track.push_back((now, x_m, y_m));
    }

    /// A fix of where the vehicle was at `taken`; says whether it was of use.
    pub fn handle_fix(&mut self, x_m: f64, y_m: f64, sigma_m: f64, taken: Instant, now: Instant) -> bool {
        if now.since(taken).as_secs_f64() > Self::MEMORY_S {
            return false;
        }
        let then = self.track.iter().rev().find(|(at, ..)| *at <= taken).or(self.track.front());
        let (was_x, was_y) = then.map_or((self.x_m, self.y_m), |&(_, x, y)| (x, y));
        let gain = self.variance_m2 / (self.variance_m2 + sigma_m.max(0.1).powi(2));
        let (dx, dy) = ((x_m - was_x) * gain, (y_m - was_y) * gain);
        self.x_m += dx;
        self.y_m += dy;
        for (_, x, y) in &mut self.track {
            *x += dx;
            *y += dy;
        }
        self.variance_m2 *= 1.0 - gain;
        self.last_fix = Some(now);
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_late_fix_corrects_by_what_was_wrong_when_it_was_taken() {
        let at = |s: f64| Instant::from_secs_f64(s);
        let mut nav = Navigator::new(0.0, 0.0, 18.0, 0.1);
        for s in 1..=60 {
            nav.handle_odometry(1.0, 0.0, 0.0, 18.0, at(f64::from(s)));
        }
        assert!(nav.sigma_m() > 0.5);
        // At 30 s it believed to be at 30 m, but was at 33 m: now it is near 63 m.
        assert!(nav.handle_fix(33.0, 0.0, 0.1, at(30.0), at(60.0)));
        assert!((nav.position().0 - 63.0).abs() < 0.2, "{:?}", nav.position());
        assert!(!nav.handle_fix(0.0, 0.0, 0.1, at(30.0), at(600.0)), "a fix of ten minutes ago is of no use");
    }
}
