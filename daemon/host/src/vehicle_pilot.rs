//! The vehicle's autopilot: its odometry moves the vehicle, and the vehicle's goal moves it.

use crate::pilot::Pilot;
use scenecast_core::TangentPlane;
use scenecast_drivers::autopilot::{Autopilot, Goal, Step};
use scenecast_protocol::time::Instant;
use scenecast_vehicle::Vehicle;

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
            vehicle.handle_odometry(step.dx_m, step.dy_m, step.heading_rad, step.depth_m, now);
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
