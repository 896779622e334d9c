//! Instruments of simulated vehicles: a GPS receiver, a compass, an autopilot.

use scenecast_config::{Config, survey_depth_m};
use scenecast_core::{LatLon, TangentPlane, nmea};
use scenecast_drivers::autopilot::{Autopilot, Counters, Goal, Health, Outbox, Step};
use scenecast_protocol::time::Instant;
use scenecast_worlds::Motion;
use sim_channel::RandomStream;
use std::time::Duration;

/// Standard deviation of the compass, degrees.
const COMPASS_SIGMA_DEG: f64 = 0.5;

#[derive(Debug, Clone, Copy)]
pub struct Receiver {
    /// Origin of the world frame.
    pub origin: LatLon,
    /// Standard deviation of the white noise, and of an error that changes over minutes, metres.
    pub sigma_m: f64,
    /// Reported quality: dilution of precision, and whether the receiver uses corrections.
    pub hdop: f64,
    pub is_corrected: bool,
}

/// Writes sentences, with random errors of its own.
#[derive(Debug)]
pub struct Instruments {
    receiver: Receiver,
    plane: TangentPlane,
    rng: RandomStream,
    slow_error: (f64, f64),
}

impl Instruments {
    pub fn new(receiver: Receiver, seed: u64) -> Self {
        let plane = TangentPlane::new(receiver.origin);
        Self { receiver, plane, rng: RandomStream::new(seed, &[9]), slow_error: (0.0, 0.0) }
    }

    /// Position and heading as NMEA 0183, once a second; `astray` is an additional error of the receiver, metres.
    pub fn report(&mut self, at: (f64, f64), heading_rad: f64, astray: (f64, f64), second: u32) -> String {
        let [a, b, c, d, e] = [(); 5].map(|()| self.rng.normal());
        let Receiver { sigma_m, hdop, is_corrected, .. } = self.receiver;
        let slow = |error: f64, draw: f64| error * 0.99 + sigma_m * 0.14 * draw;
        self.slow_error = (slow(self.slow_error.0, a), slow(self.slow_error.1, b));
        let x = at.0 + self.slow_error.0 + sigma_m * c + astray.0;
        let y = at.1 + self.slow_error.1 + sigma_m * d + astray.1;
        let place = nmea::place_fields(self.plane.to_place(x, y));
        let (h, m, s) = (second / 3600 % 24, second / 60 % 60, second % 60);
        let quality = if is_corrected { 4 } else { 1 };
        let gga = nmea::line(&format!("GPGGA,{h:02}{m:02}{s:02}.00,{place},{quality},09,{hdop:.1},0.0,M,0.0,M,,"));
        let heading = (heading_rad.to_degrees() + COMPASS_SIGMA_DEG * e).rem_euclid(360.0);
        gga + &nmea::line(&format!("HEHDT,{heading:.2},T"))
    }
}

/// Simulated kinematics with two steps per second of mission time.
#[derive(Debug)]
pub struct SimulatedAutopilot {
    motion: Motion,
    depth_m: f64,
    next: Instant,
    outbox: Outbox,
}

impl SimulatedAutopilot {
    const STEP_S: f64 = 0.5;
    /// Vertical speed of the vehicle, m/s.
    const DIVES_M_S: f64 = 0.3;

    /// A vehicle with the given motion and depth.
    pub fn new(motion: Motion, depth_m: f64, now: Instant) -> Self {
        Self { motion, depth_m, next: now, outbox: Outbox::default() }
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

    fn handle_bytes(&mut self, _bytes: &[u8], _now: Instant) -> bool {
        false
    }

    fn handle_timeout(&mut self, now: Instant) {
        // After a long sleep of the host at most one minute is simulated.
        if now.since(self.next) > Duration::from_secs(60) {
            self.next = now;
        }
        while now >= self.next {
            self.next = self.next + Duration::from_secs_f64(Self::STEP_S);
            let o = self.motion.step_on(Self::STEP_S);
            let (dx_m, dy_m, heading_rad, depth_m) = (o.dx_m, o.dy_m, Some(o.heading_rad), Some(self.depth_m));
            self.outbox.walk(Step { dx_m, dy_m, heading_rad, depth_m, ..Step::default() });
        }
    }

    fn poll_timeout(&self) -> Instant {
        self.next
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
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
