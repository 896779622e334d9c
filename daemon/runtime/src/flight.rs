//! The vehicle and what flies it.

use super::clock::Clock;
use super::pilot::{Pilot, SimulatedAutopilot, next_of};
use scenecast_config::{Config, survey_depth_m};
use scenecast_core::TangentPlane;
use scenecast_core::UserError;
use scenecast_drivers::autopilot::Goal;
use scenecast_files::RecordedFrame;
use scenecast_vehicle::Vehicle;

/// The autopilot, if there is one, and what it must know besides the vehicle's decisions.
pub(super) struct Flight {
    pilot: Option<Pilot>,
    plane: Option<TangentPlane>,
    /// Of the survey, metres.
    depth_m: f64,
    clock: Clock,
    /// Whether it is to come up where it is.
    is_rising: bool,
}

impl Flight {
    /// Fixes that are older do not tell the autopilot where it is, seconds.
    const OLDEST_FIX_S: f64 = 60.0;

    /// Opens the way to the autopilot that is configured.
    pub(super) fn open(
        config: &Config,
        simulated: Option<SimulatedAutopilot>,
        clock: Clock,
    ) -> Result<Self, UserError> {
        let plane = config.mission.origin_deg.map(TangentPlane::new);
        Ok(Self {
            pilot: Pilot::open(config, simulated, clock)?,
            plane,
            depth_m: survey_depth_m(config),
            clock,
            is_rising: false,
        })
    }

    /// Come up where it is, or no longer.
    pub(super) fn set_rising(&mut self, is_rising: bool) {
        self.is_rising = is_rising;
    }

    /// Whether an autopilot says where the vehicle is.
    pub(super) fn is_piloted(&self) -> bool {
        self.pilot.is_some()
    }

    /// The camera is where the autopilot says, whatever a recording does.
    pub(super) fn place_camera(&self, vehicle: &Vehicle, frame: &mut RecordedFrame) {
        if self.is_piloted() {
            let navigator = vehicle.navigator();
            (frame.x_m, frame.y_m) = navigator.position().xy();
            (frame.heading_rad, frame.depth_m) = (navigator.heading_rad(), navigator.depth_m());
        }
    }

    /// Something has happened at the autopilot; never without one. Safe to abandon.
    pub(super) async fn next(&mut self) {
        next_of(&mut self.pilot).await;
    }

    /// Takes the way that the autopilot tells into the vehicle, and tells it where to go.
    pub(super) fn steer(&mut self, vehicle: &mut Vehicle) {
        let now = self.clock.now();
        let Some(pilot) = &mut self.pilot else { return };
        while let Some(step) = pilot.poll_step() {
            vehicle.handle_odometry(step.dx_m, step.dy_m, step.heading_rad, step.depth_m, now);
            vehicle.handle_unseen(step.unseen);
        }
        vehicle.set_autopilot_silent(pilot.health().is_silent());
        let navigator = vehicle.navigator();
        let (x, y) = navigator.position().xy();
        let (world_x, world_y) = navigator.world().xy();
        let goal = vehicle.waypoint().map(|to| {
            let (east_m, north_m) = (to.x_m - x, to.y_m - y);
            let place = self.plane.map(|plane| plane.to_place(world_x + east_m, world_y + north_m));
            Goal { east_m, north_m, depth_m: Some(self.depth_m), place }
        });
        let up = Goal { east_m: 0.0, north_m: 0.0, depth_m: Some(0.0), place: None };
        pilot.set_goal(if self.is_rising { Some(up) } else { goal });
        let is_fixed = navigator.last_fix().is_some_and(|at| now.since(at).as_secs_f64() < Self::OLDEST_FIX_S);
        if let (true, Some(plane)) = (is_fixed, &self.plane) {
            pilot.handle_place(plane.to_place(world_x, world_y), navigator.sigma_m());
        }
    }
}
