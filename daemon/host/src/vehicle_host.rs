//! The host of the vehicle: role, modem, autopilot, persistent state and mapper.

use crate::link_host::{FrameEvent, FrameOutcome, LinkHost};
use crate::pilot::{PilotEvent, VehiclePilot};
use scenecast_drivers::autopilot::{Counters, Health, Plausible, Step};
use scenecast_drivers::modem::Station;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{Budget, Fix, Settings};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{EquipmentFaults, UtcHours, VehicleMode};
use scenecast_vehicle::{
    AppliedSlot, MapChanges, RegisteredFrame, SharedExemplars, Vehicle, VehicleDisk, VehicleOutput,
};
use std::collections::VecDeque;
use std::time::Duration;

/// Requests and events of a vehicle's host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleHostEvent {
    /// Make [`Vehicle::durable`] durable, then call [`VehicleHost::handle_persisted`]. Until then the host returns
    /// no further event and no frame. If it fails, call [`VehicleHost::handle_persist_failed`].
    Persist,
    /// The vehicle's next waypoint, metres east and north in the map frame.
    Waypoint(MapPoint),
    /// The vehicle holds its position.
    Hold,
    Surface,
    /// Give these settings to the mapper; others have their configured values.
    Tune(Settings),
    /// The recorded survey has ended: let the mapper keep a checkpoint.
    SurveyEnded,
    /// The vehicle applied or refused a slot.
    Applied(AppliedSlot),
    /// A fix was used; the time is that of its measurement.
    Fixed(Fix, Instant),
    /// An event of frames or modem.
    Frame(FrameEvent),
    Pilot(PilotEvent),
    /// A line on the navigation source that a person should read.
    Note(String),
}

/// The pose of a camera frame, in the map frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    pub x_m: f64,
    pub y_m: f64,
    pub heading_rad: f64,
    pub depth_m: f64,
}

/// What an autopilot measured last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredPose {
    pub pose: CameraPose,
    /// Rotation about the forward axis, starboard down, radians.
    pub roll_rad: f64,
    /// Rotation about the starboard axis, bow up, radians.
    pub pitch_rad: f64,
    /// Height above the sea floor, metres, where it is measured.
    pub altitude_m: Option<f64>,
    /// When the autopilot's step with these values came in.
    pub at: Instant,
}

/// Camera frames on their way through the mapper.
#[derive(Debug, Default)]
struct MapperQueue {
    /// Frames without a report of the mapper yet.
    outstanding: u32,
    /// Whether the recording has ended.
    is_over: bool,
}

/// The vehicle's role with its modem, its autopilot, its persistent state and its mapper.
pub struct VehicleHost {
    link: LinkHost<Vehicle>,
    pilot: Option<VehiclePilot>,
    mapper: MapperQueue,
    /// Whether the owner still has to make the state durable.
    is_persisting: bool,
    /// Depth and heading of the navigation source.
    plausible: Plausible,
    events: VecDeque<VehicleHostEvent>,
}

impl VehicleHost {
    /// Joins the vehicle's role with its modem. Without an autopilot, the owner acts on
    /// waypoints and reports the odometry.
    pub fn new(vehicle: Vehicle, station: Station, pilot: Option<VehiclePilot>) -> Self {
        let link = LinkHost::new(vehicle, station);
        Self {
            link,
            pilot,
            mapper: MapperQueue::default(),
            is_persisting: false,
            plausible: Plausible::default(),
            events: VecDeque::new(),
        }
    }

    pub fn vehicle(&self) -> &Vehicle {
        self.link.end()
    }

    /// The link's host, for the account of bits and the port.
    pub fn link(&self) -> &LinkHost<Vehicle> {
        &self.link
    }

    /// The link's host, to report on the modem's port.
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

    /// Takes bytes of the autopilot's port, in pieces of any size. Returns [`FrameOutcome::Accepted`] where the autopilot itself is the
    /// sender.
    pub fn handle_pilot_bytes(&mut self, bytes: &[u8], now: Instant) -> FrameOutcome {
        let Some(pilot) = &mut self.pilot else { return FrameOutcome::Dropped };
        let outcome = pilot.pilot.handle_bytes(bytes, now);
        pilot.fly(self.link.end_mut(), now);
        outcome
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

    /// The time at which [`Self::handle_timeout`] is due or output should be polled again.
    pub fn poll_timeout(&self, now: Instant) -> Option<Instant> {
        let pilot = self.pilot.as_ref().map(|p| p.pilot.autopilot.poll_timeout());
        self.link.poll_timeout(now).into_iter().chain(pilot).min()
    }

    /// Lets the vehicle choose a waypoint if it has none.
    pub fn steer(&mut self, now: Instant) {
        self.link.end_mut().steer(now);
    }

    /// Takes the faults of the sensors; that of an autopilot which does not follow is added.
    pub fn handle_faults(&mut self, sensors: EquipmentFaults) {
        let autopilot_refuses = self.pilot.as_ref().is_some_and(|pilot| pilot.pilot.health() == Health::NotInCommand);
        self.link.end_mut().set_faults(EquipmentFaults { autopilot_refuses, ..sensors });
    }

    /// Takes the odometry of a vehicle without an autopilot.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        self.link.end_mut().handle_odometry(dx_m, dy_m, heading_rad, depth_m, now);
    }

    /// No pose came in from the navigation source for `unseen` since the last call; `None` while poses come in. The
    /// autopilot holds its position meanwhile, since a goal relative to an old pose would lead astray.
    pub fn handle_pose_gap(&mut self, unseen: Option<Duration>) {
        if let Some(pilot) = &mut self.pilot {
            pilot.is_blind = unseen.is_some();
        }
        if let Some(unseen) = unseen {
            self.link.end_mut().handle_unmeasured(unseen);
        }
    }

    fn is_measured_by_pilot(&self) -> bool {
        self.pilot.as_ref().is_some_and(|pilot| pilot.measures)
    }

    /// Takes the pose of a recording or of a navigation source, unless an autopilot measures it.
    pub fn handle_pose(&mut self, pose: CameraPose, now: Instant) {
        if self.is_measured_by_pilot() {
            return;
        }
        let step = Step { heading_rad: Some(pose.heading_rad), depth_m: Some(pose.depth_m), ..Step::default() };
        let (step, jumps) = self.plausible.check(step, now);
        let (heading_rad, depth_m) =
            (step.heading_rad.unwrap_or(pose.heading_rad), step.depth_m.unwrap_or(pose.depth_m));
        self.events.extend(jumps.into_iter().filter_map(|jump| jump.note).map(VehicleHostEvent::Note));
        self.link.end_mut().set_pose(pose.x_m, pose.y_m, heading_rad, depth_m, now);
    }

    /// Replaces the budget and the shares that the surface ordered by those of the configuration.
    pub fn handle_budget(&mut self, budget: Budget, now: Instant) {
        self.link.end_mut().set_budget(budget, now);
    }

    /// A camera frame is given to the mapper. Returns its pose: that of the autopilot, or else `recorded`.
    pub fn handle_camera(&mut self, recorded: CameraPose) -> CameraPose {
        self.mapper.outstanding += 1;
        if !self.is_measured_by_pilot() {
            return recorded;
        }
        self.dead_reckoned_pose()
    }

    /// A frame of a live camera, whose pose is that of its own time, is given to the mapper.
    pub fn handle_matched_camera(&mut self) {
        self.mapper.outstanding += 1;
    }

    /// Frames that the mapper has not reported on yet.
    pub fn frames_in_mapper(&self) -> u32 {
        self.mapper.outstanding
    }

    /// The vehicle's pose by the last report of its autopilot; `None` if there is none yet, if it has no heading, or if another
    /// source measures the pose.
    pub fn measured_pose(&self) -> Option<MeasuredPose> {
        let (Step { heading_rad, roll_rad, pitch_rad, altitude_m, .. }, at) = self.pilot.as_ref()?.last_step?;
        heading_rad?;
        Some(MeasuredPose { pose: self.dead_reckoned_pose(), roll_rad, pitch_rad, altitude_m, at })
    }

    /// State and counters of the autopilot, if there is one.
    pub fn autopilot(&self) -> Option<(Health, Counters)> {
        let pilot = &self.pilot.as_ref()?.pilot;
        Some((pilot.health(), pilot.autopilot.counters()))
    }

    /// Whether its autopilot takes the vehicle to the surface of the sea.
    pub fn is_coming_up(&self) -> bool {
        self.pilot.is_some() && self.vehicle().mode().0 == VehicleMode::Surface
    }

    fn dead_reckoned_pose(&self) -> CameraPose {
        let navigator = self.vehicle().navigator();
        let (x_m, y_m) = navigator.dead_reckoned().xy();
        CameraPose { x_m, y_m, heading_rad: navigator.heading_rad(), depth_m: navigator.depth_m() }
    }

    /// The recording has ended; the survey ends with the mapper's report on its last frame.
    pub fn handle_camera_end(&mut self) {
        self.mapper.is_over = true;
    }

    /// The mapper has handled the frame of `pose` and placed it; `None` at the start, when the map is that of a
    /// checkpoint, and for a frame that was not mapped.
    pub fn handle_mapped(
        &mut self,
        pose: Option<CameraPose>,
        registered: Option<&RegisteredFrame>,
        changes: &MapChanges,
        exemplars: SharedExemplars,
        now: Instant,
    ) {
        if let Some(pose) = pose {
            self.mapper.outstanding -= 1;
            self.handle_pose(pose, now);
        }
        if let Some(frame) = registered {
            self.handle_registration(frame, now);
        }
        self.handle_changes(changes, now);
        self.handle_exemplars(exemplars, now);
        self.finish_after_last_frame();
    }

    /// The mapper skipped an unreadable frame.
    pub fn handle_missed(&mut self) {
        self.mapper.outstanding -= 1;
        self.finish_after_last_frame();
    }

    /// The mapper has placed a camera frame.
    pub fn handle_registration(&mut self, frame: &RegisteredFrame, now: Instant) {
        self.link.end_mut().handle_registration(frame, now);
    }

    /// Takes changes of the map, of the mapper or of another program. Returns the label whose name is refused, because it has
    /// another one already.
    pub fn handle_changes(&mut self, changes: &MapChanges, now: Instant) -> Option<u8> {
        self.link.end_mut().handle_changes(changes, now)
    }

    /// Takes the mapper's exemplars of each label, the best first.
    pub fn handle_exemplars(&mut self, exemplars: SharedExemplars, now: Instant) {
        self.link.end_mut().handle_exemplars(exemplars, now);
    }

    fn finish_after_last_frame(&mut self) {
        if self.mapper.outstanding == 0 && std::mem::take(&mut self.mapper.is_over) {
            self.finish_survey();
            self.events.push_back(VehicleHostEvent::SurveyEnded);
        }
    }

    /// Ends the survey: the vehicle holds its position, and the link continues.
    pub fn finish_survey(&mut self) {
        self.link.end_mut().finish_survey();
    }

    /// The owner has made [`Vehicle::durable`] durable.
    pub fn handle_persisted(&mut self) {
        self.is_persisting = false;
        self.link.end_mut().handle_persisted();
    }

    /// The owner could not make [`Vehicle::durable`] durable. The vehicle holds and aborts from memory, refuses other
    /// orders, and asks for it again later.
    pub fn handle_persist_failed(&mut self, now: Instant) {
        self.is_persisting = false;
        self.link.end_mut().handle_persist_failed(now);
    }

    /// Sets the clock of this computer, with which that of the surface is compared.
    pub fn set_clock(&mut self, clock: UtcHours) {
        self.link.end_mut().set_clock(clock);
    }

    /// Sets the state of the disk; the next status reports it.
    pub fn handle_disk(&mut self, disk: VehicleDisk) {
        self.link.end_mut().set_disk(disk);
    }

    /// The next request or event; `None` while the state is being made durable.
    pub fn poll_event(&mut self) -> Option<VehicleHostEvent> {
        if self.is_persisting {
            return None;
        }
        self.collect();
        let event = self.events.pop_front()?;
        self.is_persisting = event == VehicleHostEvent::Persist;
        Some(event)
    }

    /// The next bytes for the modem's port. They hold no frame while a state must first be made durable.
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
