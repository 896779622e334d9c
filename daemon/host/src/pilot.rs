//! An autopilot in a host: its odometry moves the vehicle, and the vehicle's goal moves it.

use crate::link_host::FrameOutcome;
use scenecast_core::TangentPlane;
use scenecast_drivers::autopilot::{Autopilot, Goal, Health, Step};
use scenecast_protocol::time::Instant;
use scenecast_vehicle::Vehicle;
use std::collections::VecDeque;

/// An event of an autopilot, for the log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PilotEvent {
    /// A line that a person should read.
    Note(String),
    Health {
        health: Health,
        /// The counters so far, as one line.
        counters: String,
    },
}

/// An autopilot and its events.
pub(crate) struct Pilot {
    pub(crate) autopilot: Box<dyn Autopilot>,
    health: Health,
    events: VecDeque<PilotEvent>,
}

impl Pilot {
    pub(crate) fn new(autopilot: Box<dyn Autopilot>, now: Instant) -> Self {
        let health = autopilot.health(now);
        Self { autopilot, health, events: VecDeque::new() }
    }

    /// Calls the autopilot's timeout if it is due; returns whether it was.
    pub(crate) fn handle_timeout(&mut self, now: Instant) -> bool {
        let is_due = self.autopilot.poll_timeout() <= now;
        if is_due {
            self.autopilot.handle_timeout(now);
            self.collect(now);
        }
        is_due
    }

    pub(crate) fn handle_open(&mut self, now: Instant) {
        self.autopilot.handle_open(now);
        self.collect(now);
    }

    /// Returns [`FrameOutcome::Accepted`] where the autopilot itself is the sender.
    pub(crate) fn handle_bytes(&mut self, bytes: &[u8], now: Instant) -> FrameOutcome {
        let is_heard = self.autopilot.handle_bytes(bytes, now);
        self.collect(now);
        if is_heard { FrameOutcome::Accepted } else { FrameOutcome::Dropped }
    }

    /// As of its last message or timeout.
    pub(crate) fn health(&self) -> Health {
        self.health
    }

    pub(crate) fn poll_event(&mut self) -> Option<PilotEvent> {
        self.events.pop_front()
    }

    fn collect(&mut self, now: Instant) {
        while let Some(note) = self.autopilot.poll_note() {
            self.events.push_back(PilotEvent::Note(note));
        }
        let health = self.autopilot.health(now);
        if std::mem::replace(&mut self.health, health) != health {
            self.events.push_back(PilotEvent::Health { health, counters: self.counters() });
        }
    }

    fn counters(&self) -> String {
        let counters = self.autopilot.counters();
        let all: Vec<String> = counters.iter().map(|(name, n)| format!("{name} {n}")).collect();
        if all.is_empty() { "none yet".to_owned() } else { all.join(", ") }
    }
}

/// Maximum age of a fix that is given to the autopilot, seconds.
const MAX_FIX_AGE_S: f64 = 60.0;

/// A vehicle's autopilot with the data for its goals.
pub struct VehiclePilot {
    pub(crate) pilot: Pilot,
    /// Converts world positions to latitude and longitude, if the origin is known.
    plane: Option<TangentPlane>,
    /// Depth of the survey, metres.
    depth_m: f64,
    /// Whether the vehicle is surfacing at its position.
    pub(crate) is_rising: bool,
    /// Whether its odometry is the vehicle's.
    pub(crate) measures: bool,
    /// Whether the source that measures the pose in its place is silent: it then holds its position.
    pub(crate) is_blind: bool,
    /// The last step of the track, and when it came in.
    pub(crate) last_step: Option<(Step, Instant)>,
}

impl VehiclePilot {
    /// An autopilot for a survey at `depth_m` metres.
    pub fn new(autopilot: Box<dyn Autopilot>, plane: Option<TangentPlane>, depth_m: f64, now: Instant) -> Self {
        Self {
            pilot: Pilot::new(autopilot, now),
            plane,
            depth_m,
            is_rising: false,
            measures: true,
            is_blind: false,
            last_step: None,
        }
    }

    /// Whether the autopilot's odometry counts; otherwise another source gives the vehicle's pose.
    #[must_use]
    pub fn measuring(mut self, measures: bool) -> Self {
        self.measures = measures;
        self
    }

    /// Gives the autopilot's odometry to the vehicle, and the vehicle's goal to the autopilot.
    pub(crate) fn fly(&mut self, vehicle: &mut Vehicle, now: Instant) {
        let autopilot = &mut self.pilot.autopilot;
        while let Some(step) = autopilot.poll_step() {
            if !self.measures {
                continue;
            }
            // What is not measured is as it was.
            let navigator = vehicle.navigator();
            let heading_rad = step.heading_rad.unwrap_or(navigator.heading_rad());
            let depth_m = step.depth_m.unwrap_or(navigator.depth_m());
            vehicle.handle_odometry(step.dx_m, step.dy_m, heading_rad, depth_m, now);
            vehicle.handle_unmeasured(step.unseen);
            self.last_step = Some((step, now));
        }
        vehicle.set_autopilot_silent(self.is_blind || autopilot.health(now).is_silent());
        let navigator = vehicle.navigator();
        let (x, y) = navigator.position().xy();
        let (world_x, world_y) = navigator.world().xy();
        let goal = vehicle.waypoint().filter(|_| !self.is_blind).map(|to| {
            let (east_m, north_m) = (to.x_m - x, to.y_m - y);
            let place = self.plane.map(|plane| plane.to_place(world_x + east_m, world_y + north_m));
            Goal { east_m, north_m, depth_m: Some(self.depth_m), place }
        });
        let up = Goal { east_m: 0.0, north_m: 0.0, depth_m: Some(0.0), place: None };
        autopilot.set_goal(if self.is_rising { Some(up) } else { goal }, now);
        let is_fixed = navigator.last_fix().is_some_and(|at| now.since(at).as_secs_f64() < MAX_FIX_AGE_S);
        if let (true, Some(plane)) = (is_fixed, &self.plane) {
            autopilot.handle_place(plane.to_place(world_x, world_y), navigator.sigma_m(), now);
        }
    }
}
