//! The vehicle's host.

use crate::link_host::{FrameEvent, LinkHost};
use crate::pilot::{Pilot, PilotEvent};
use scenecast_core::TangentPlane;
use scenecast_drivers::autopilot::{Autopilot, Goal};
use scenecast_drivers::modem::Station;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{Budget, Fix, Settings};
use scenecast_protocol::time::Instant;
use scenecast_vehicle::{AppliedSlot, MapUpdate, SharedExemplars, Vehicle, VehicleOutput};
use std::collections::VecDeque;

/// An older fix does not tell the autopilot where it is, seconds.
const MAX_FIX_AGE_S: f64 = 60.0;

/// Requests and news of a vehicle's host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleHostEvent {
    /// Make [`Vehicle::durable`] durable, then call [`VehicleHost::handle_persisted`]. Until then the host gives no further
    /// event and no frame; where it fails, end the run.
    Persist,
    /// The vehicle goes there, metres east and north in the map's frame.
    Waypoint(MapPoint),
    /// The vehicle stays where it is.
    Hold,
    /// The vehicle comes up.
    Surface,
    /// Have the mapper follow these settings; those that are not named are as configured.
    Tune(Settings),
    /// The recorded survey has ended: have the mapper keep a checkpoint.
    SurveyEnded,
    /// A slot was decided about.
    Applied(AppliedSlot),
    /// A fix in the world was used, and when it was taken.
    Fixed(Fix, Instant),
    /// News of frames and modem.
    Frame(FrameEvent),
    /// News of the autopilot.
    Pilot(PilotEvent),
}

/// Where a camera frame was taken, in the map's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    /// East, metres.
    pub x_m: f64,
    /// North, metres.
    pub y_m: f64,
    /// Clockwise from north, radians.
    pub heading_rad: f64,
    /// Below the surface, metres.
    pub depth_m: f64,
}

/// A vehicle's autopilot and the facts that its goals need.
pub struct VehiclePilot {
    pilot: Pilot,
    /// Converts places of the world to latitude and longitude, where the origin is known.
    plane: Option<TangentPlane>,
    /// Depth of the survey, metres.
    depth_m: f64,
    /// Whether it comes up where it is.
    is_rising: bool,
}

impl VehiclePilot {
    /// An autopilot for a survey at `depth_m` metres.
    pub fn new(autopilot: Box<dyn Autopilot>, plane: Option<TangentPlane>, depth_m: f64, now: Instant) -> Self {
        Self { pilot: Pilot::new(autopilot, now), plane, depth_m, is_rising: false }
    }

    /// Takes the autopilot's odometry into the vehicle, and gives the autopilot its goal.
    fn fly(&mut self, vehicle: &mut Vehicle, now: Instant) {
        let autopilot = &mut self.pilot.autopilot;
        while let Some(step) = autopilot.poll_step() {
            vehicle.handle_odometry(step.dx_m, step.dy_m, step.heading_rad, step.depth_m, now);
            vehicle.handle_unmeasured(step.unseen);
        }
        vehicle.set_autopilot_silent(autopilot.health(now).is_silent());
        let navigator = vehicle.navigator();
        let (x, y) = navigator.position().xy();
        let (world_x, world_y) = navigator.world().xy();
        let goal = vehicle.waypoint().map(|to| {
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

/// Camera frames on their way through the mapper.
#[derive(Debug, Default)]
struct MapperQueue {
    /// Frames that the mapper has not reported on yet.
    outstanding: u32,
    /// The recorded camera has given its last frame.
    is_over: bool,
}

/// The vehicle's role with its modem, its autopilot, its persistent state and its mapper.
pub struct VehicleHost {
    link: LinkHost<Vehicle>,
    pilot: Option<VehiclePilot>,
    mapper: MapperQueue,
    /// The owner was asked to make the state durable and has not done it yet.
    is_persisting: bool,
    events: VecDeque<VehicleHostEvent>,
}

impl VehicleHost {
    /// A vehicle at its modem. Without an autopilot, the owner acts on the waypoints and reports the odometry.
    pub fn new(vehicle: Vehicle, station: Station, pilot: Option<VehiclePilot>) -> Self {
        let link = LinkHost::new(vehicle, station);
        Self { link, pilot, mapper: MapperQueue::default(), is_persisting: false, events: VecDeque::new() }
    }

    /// The role.
    pub fn vehicle(&self) -> &Vehicle {
        self.link.end()
    }

    /// The link's side of the host, for its account and its port.
    pub fn link(&self) -> &LinkHost<Vehicle> {
        &self.link
    }

    /// The modem's port, as [`LinkHost`] has it.
    pub fn link_mut(&mut self) -> &mut LinkHost<Vehicle> {
        &mut self.link
    }

    /// The autopilot's port was opened.
    pub fn handle_pilot_open(&mut self, now: Instant) {
        if let Some(pilot) = &mut self.pilot {
            pilot.pilot.handle_open(now);
            pilot.fly(self.link.end_mut(), now);
        }
    }

    /// Takes bytes of the autopilot's port, in pieces of any size.
    pub fn handle_pilot_bytes(&mut self, bytes: &[u8], now: Instant) {
        if let Some(pilot) = &mut self.pilot {
            pilot.pilot.handle_bytes(bytes, now);
            pilot.fly(self.link.end_mut(), now);
        }
    }

    /// Lets time pass in the modem's driver and in the autopilot.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.link.handle_timeout(now);
        if let Some(pilot) = &mut self.pilot
            && pilot.pilot.handle_timeout(now)
        {
            pilot.fly(self.link.end_mut(), now);
        }
    }

    /// When [`Self::handle_timeout`] is due, or the host should be asked for output again.
    pub fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        let pilot = self.pilot.as_ref().map(|p| p.pilot.autopilot.poll_timeout());
        self.link.poll_timeout(now).into_iter().chain(pilot).min()
    }

    /// Lets the vehicle choose its next waypoint, if it needs one.
    pub fn steer(&mut self, now: Instant) {
        self.link.end_mut().steer(now);
    }

    /// The vehicle's own sensors measured a stretch of path, where there is no autopilot.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        self.link.end_mut().handle_odometry(dx_m, dy_m, heading_rad, depth_m, now);
    }

    /// A recording gives the pose, where there is no autopilot to do it.
    pub fn handle_pose(&mut self, pose: CameraPose, now: Instant) {
        if self.pilot.is_none() {
            self.link.end_mut().set_pose(pose.x_m, pose.y_m, pose.heading_rad, pose.depth_m, now);
        }
    }

    /// Budget and shares of the configuration take the place of those that the surface ordered.
    pub fn handle_budget(&mut self, budget: Budget, now: Instant) {
        self.link.end_mut().set_budget(budget, now);
    }

    /// A camera frame goes to the mapper. Returns the pose that it was taken at: that of the autopilot, or else `recorded`.
    pub fn handle_camera(&mut self, recorded: CameraPose) -> CameraPose {
        self.mapper.outstanding += 1;
        if self.pilot.is_none() {
            return recorded;
        }
        let navigator = self.vehicle().navigator();
        let (x_m, y_m) = navigator.position().xy();
        CameraPose { x_m, y_m, heading_rad: navigator.heading_rad(), depth_m: navigator.depth_m() }
    }

    /// The recorded camera has given its last frame: the survey ends with the mapper's report on it.
    pub fn handle_camera_end(&mut self) {
        self.mapper.is_over = true;
    }

    /// The mapper has seen the frame of `pose`; `None` at the start, when the map is that of a checkpoint.
    pub fn handle_mapped(
        &mut self,
        pose: Option<CameraPose>,
        update: &MapUpdate,
        exemplars: SharedExemplars,
        now: Instant,
    ) {
        if let Some(pose) = pose {
            self.mapper.outstanding -= 1;
            self.handle_pose(pose, now);
        }
        self.handle_map(update, now);
        self.handle_exemplars(exemplars);
        self.finish_after_last_frame();
    }

    /// The mapper passed over a frame that could not be read.
    pub fn handle_missed(&mut self) {
        self.mapper.outstanding -= 1;
        self.finish_after_last_frame();
    }

    /// The mapper has a new map.
    pub fn handle_map(&mut self, update: &MapUpdate, now: Instant) {
        self.link.end_mut().handle_map(update, now);
    }

    /// The mapper has the best exemplars of each label, the best first.
    pub fn handle_exemplars(&mut self, exemplars: SharedExemplars) {
        self.link.end_mut().handle_exemplars(exemplars);
    }

    fn finish_after_last_frame(&mut self) {
        if self.mapper.outstanding == 0 && std::mem::take(&mut self.mapper.is_over) {
            self.finish_survey();
            self.events.push_back(VehicleHostEvent::SurveyEnded);
        }
    }

    /// The survey is over: the vehicle stays, and the link continues.
    pub fn finish_survey(&mut self) {
        self.link.end_mut().finish_survey();
    }

    /// The owner has made [`Vehicle::durable`] durable.
    pub fn handle_persisted(&mut self) {
        self.is_persisting = false;
        self.link.end_mut().handle_persisted();
    }

    /// The next request or news; none while the state is being made durable.
    pub fn poll_event(&mut self) -> Option<VehicleHostEvent> {
        if self.is_persisting {
            return None;
        }
        self.collect();
        let event = self.events.pop_front()?;
        self.is_persisting = event == VehicleHostEvent::Persist;
        Some(event)
    }

    /// The next bytes for the modem's port. No frame is among them while a state has to be made durable first.
    pub fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>> {
        self.collect();
        if self.is_persisting || self.events.contains(&VehicleHostEvent::Persist) {
            return self.link.poll_modem_output(now);
        }
        self.link.poll_output(now)
    }

    /// The next bytes for the autopilot's port.
    pub fn poll_pilot_output(&mut self) -> Option<Vec<u8>> {
        self.pilot.as_mut()?.pilot.autopilot.poll_output()
    }

    fn collect(&mut self) {
        while let Some(event) = self.link.poll_event() {
            self.events.push_back(VehicleHostEvent::Frame(event));
        }
        while let Some(event) = self.pilot.as_mut().and_then(|p| p.pilot.poll_event()) {
            self.events.push_back(VehicleHostEvent::Pilot(event));
        }
        while let Some(output) = self.link.end_mut().poll_output() {
            if let Some(pilot) = &mut self.pilot {
                match output {
                    VehicleOutput::Waypoint(..) | VehicleOutput::Hold => pilot.is_rising = false,
                    VehicleOutput::Surface => pilot.is_rising = true,
                    _ => {}
                }
            }
            self.events.push_back(output.into());
        }
    }
}

impl From<VehicleOutput> for VehicleHostEvent {
    fn from(output: VehicleOutput) -> Self {
        match output {
            VehicleOutput::Persist => Self::Persist,
            VehicleOutput::Waypoint(at) => Self::Waypoint(at),
            VehicleOutput::Hold => Self::Hold,
            VehicleOutput::Surface => Self::Surface,
            VehicleOutput::Tune(settings) => Self::Tune(settings),
            VehicleOutput::Applied(applied) => Self::Applied(applied),
            VehicleOutput::Fixed(fix, taken) => Self::Fixed(fix, taken),
        }
    }
}
