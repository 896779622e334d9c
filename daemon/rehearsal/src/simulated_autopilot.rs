//! A simulated vehicle as an autopilot.

use scenecast_config::{Config, survey_depth_m};
use scenecast_core::LatLon;
use scenecast_drivers::autopilot::{Autopilot, Counters, Goal, Health, Step, Tray};
use scenecast_motion::Motion;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// Simulated kinematics with two steps per second of mission time.
#[derive(Debug)]
pub struct SimulatedAutopilot {
    motion: Motion,
    depth_m: f64,
    next: Instant,
    tray: Tray,
}

impl SimulatedAutopilot {
    const STEP_S: f64 = 0.5;
    /// Vertical speed of the vehicle, m/s.
    const DIVES_M_S: f64 = 0.3;

    /// A vehicle with the given motion and depth.
    pub fn new(motion: Motion, depth_m: f64, now: Instant) -> Self {
        Self { motion, depth_m, next: now, tray: Tray::default() }
    }
}

/// The simulated vehicle of a configuration, at the start of its survey.
pub fn simulated_autopilot(config: &Config, now: Instant) -> Box<dyn Autopilot> {
    let drift = config.navigation.drift_percent / 100.0;
    let [east, north] = config.autopilot.current_m_s;
    let motion = Motion::new(0.0, 0.0, config.survey.speed_m_s, drift, config.runtime.seed)
        .with_turn_rate(config.autopilot.turn_rate_deg_s.to_radians())
        .with_current(east, north);
    Box::new(SimulatedAutopilot::new(motion, survey_depth_m(config), now))
}

impl Autopilot for SimulatedAutopilot {
    fn handle_open(&mut self, _now: Instant) {}

    fn handle_bytes(&mut self, _bytes: &[u8], _now: Instant) {}

    fn handle_timeout(&mut self, now: Instant) {
        // After a long sleep of the host at most one minute is simulated.
        if now.since(self.next) > Duration::from_secs(60) {
            self.next = now;
        }
        while now >= self.next {
            self.next = self.next + Duration::from_secs_f64(Self::STEP_S);
            let o = self.motion.step_on(Self::STEP_S);
            let (dx_m, dy_m, heading_rad, depth_m) = (o.dx_m, o.dy_m, o.heading_rad, self.depth_m);
            self.tray.walk(Step { dx_m, dy_m, heading_rad, depth_m, ..Step::default() });
        }
    }

    fn poll_timeout(&self) -> Instant {
        self.next
    }

    fn tray(&mut self) -> &mut Tray {
        &mut self.tray
    }

    fn set_goal(&mut self, goal: Option<Goal>, _now: Instant) {
        self.motion.set_relative_target(goal.map(|g| (g.east_m, g.north_m)));
        if let Some(depth) = goal.and_then(|g| g.depth_m) {
            let most = Self::DIVES_M_S;
            self.depth_m += (depth - self.depth_m).clamp(-most, most);
        }
    }

    fn handle_place(&mut self, _place: LatLon, _sigma_m: f64, _now: Instant) {}

    fn health(&self, _now: Instant) -> Health {
        Health::InCommand
    }

    fn counters(&self) -> Counters {
        Counters::new()
    }
}
