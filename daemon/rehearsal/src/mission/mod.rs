//! A mission in virtual time: both hosts, the medium between them, and the simulated world around them.

mod accuracy;
mod anchored;
mod camera;
mod events;
mod labels;
mod logbook;
mod quality;

use crate::carrier::Carrier;
use crate::frames_log::FramesLog;
use crate::modem_rig::SURFACE;
use crate::script::Script;
use crate::world::World;
pub use accuracy::{FrameErrors, MapInformation};
use anchored::Anchored;
use camera::Camera;
use labels::LabelReplay;
pub use logbook::{EndEvent, Leg};
use logbook::{Logbook, Timetable};
pub use quality::MapQuality;
use quality::Meters;
use scenecast_config::{Config, OperatorScript, cell_m};
use scenecast_core::{Area, UserError};
use scenecast_drivers::modem::Station;
use scenecast_host::{SurfaceHost, VehicleHost};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_registration::CameraFinding;
use scenecast_surface::{Surface, SurfaceOutput};
use scenecast_vehicle::{Durable, Mapper, Vehicle};
use scenecast_worlds::Motion;
use sim_channel::NodePosition;
use std::time::Duration;

/// The choices of a rehearsal besides its configuration.
pub struct MissionOptions {
    pub world: World,
    pub seed: u64,
    /// Folder for a recording of the camera frames.
    pub record: Option<std::path::PathBuf>,
}

/// A running mission. Each part owns its state; the mission passes events from one to the other.
pub struct Mission {
    pub(crate) config: Config,
    pub(crate) seed: u64,
    address: Address,
    vehicle: VehicleHost,
    surface: SurfaceHost,
    pub(crate) mapper: Mapper,
    pub(crate) motion: Motion,
    pub(crate) camera: Camera,
    /// Labels of another program, in place of those of the mapper.
    labels: Option<LabelReplay>,
    anchored: Anchored,
    pub(crate) carrier: Carrier,
    script: Script,
    pub(crate) logbook: Logbook,
    pub(crate) meters: Meters,
    times: Timetable,
}

impl Mission {
    /// A mission before its first event.
    pub fn new(config: Config, options: MissionOptions) -> Result<Self, UserError> {
        let MissionOptions { world, seed, record } = options;
        let now = Instant::ZERO;
        let (mut carrier, [at_vehicle, at_surface]) = Carrier::new(&config, seed, now)?;
        let camera = Camera::new(&config, world, record.as_deref())?;
        let labels = LabelReplay::new(&config)?;
        let area = camera.survey_area(&config)?;
        let vehicle = vehicle_host(&config, at_vehicle, area, seed, now)?;
        let mut surface = surface_host(&config, at_surface, seed, now)?;
        let (x, y) = vehicle.vehicle().navigator().position().xy();
        let drift = config.navigation.drift_percent / 100.0;
        let motion = Motion::new(x, y, config.survey.speed_m_s, drift, seed);
        let middle = ((area.west + area.east) / 2.0, (area.south + area.north) / 2.0);
        let surface_place = NodePosition::new(middle.0 + config.channel.range_m, middle.1, anchored::HEAD_M);
        carrier.place(SURFACE, surface_place);
        let (anchored, relay) = Anchored::new(&config, surface_place, config.mission.origin_deg, seed ^ 0x6B5);
        surface.surface_mut().set_relay(relay);
        let mut mission = Self {
            mapper: Mapper::new(
                &config,
                scenecast_files::configured_vocabulary(config.scene.vocabulary.as_deref())?,
                0,
                seed,
            )?,
            address: scenecast_config::vehicle_address(&config)?,
            script: script(&config, area),
            times: Timetable::new(&config, now),
            logbook: Logbook::default(),
            meters: Meters::default(),
            config,
            seed,
            vehicle,
            surface,
            motion,
            camera,
            labels,
            anchored,
            carrier,
        };
        if mission.camera.is_recorded() {
            mission.mapper.check_camera();
        }
        mission.place_vehicle();
        mission.pump();
        Ok(mission)
    }

    pub fn now(&self) -> Instant {
        self.times.now
    }

    pub fn ended(&self) -> Option<Instant> {
        self.times.ended
    }

    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The seed of all its random numbers.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The modem of both ends.
    pub fn modem(&self) -> &ModemProfile {
        self.vehicle.link().profile()
    }

    pub fn mapper(&self) -> &Mapper {
        &self.mapper
    }

    /// The vehicle's true motion, without the errors of its navigation.
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Changes of the label of a cell that had one on the vehicle's published map.
    pub fn flips(&self) -> u64 {
        self.logbook.map.flips
    }

    /// Bits on air of the frames that the surface received.
    pub fn received_bits(&self) -> u64 {
        self.logbook.received_bits
    }

    /// What people should know of a recording: what could not be read, and what is wrong with the camera.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let unreadable = self.logbook.unreadable.as_ref();
        let unreadable = unreadable.map(|(count, first)| format!("{count} frames cannot be read, the first: {first}"));
        let wrong = |finding| if let CameraFinding::Wrong(advice) = finding { Some(advice) } else { None };
        let of_all = || self.mapper.last_camera_finding().and_then(wrong);
        let advice = self.logbook.camera_advice.clone().or_else(of_all);
        self.camera.recording_notes().iter().cloned().chain(advice).chain(unreadable)
    }

    /// The surface's role, which has what the operator sees.
    pub fn surface(&self) -> &Surface {
        self.surface.surface()
    }

    /// The surface, for the operator's orders.
    pub fn surface_mut(&mut self) -> &mut Surface {
        self.surface.surface_mut()
    }

    pub fn vehicle(&self) -> &Vehicle {
        self.vehicle.vehicle()
    }

    /// The legs of the vehicle, start and waypoint, by its own position estimate.
    pub fn legs(&self) -> &[Leg] {
        &self.logbook.legs
    }

    /// Length of the vehicle's true path, metres.
    pub fn distance_m(&self) -> f64 {
        self.motion.distance_m
    }

    pub fn address(&self) -> Address {
        self.address
    }

    /// Bits on air of vehicle and surface.
    pub fn audits(&self) -> [&Audit; 2] {
        [self.vehicle.link().audit(), self.surface.link().audit()]
    }

    /// Bits on air of vehicle and surface, repeats of the modems themselves included.
    pub fn bits_on_air(&self) -> [u64; 2] {
        let (vehicle, surface) = (self.vehicle.link(), self.surface.link());
        [vehicle.audit().total_bits() + vehicle.repeated_bits(), surface.audit().total_bits() + surface.repeated_bits()]
    }

    /// Keeps the events of both ends from now on, for [`Self::take_end_events`].
    pub fn keep_end_events(&mut self) {
        self.logbook.events.get_or_insert_default();
    }

    /// The events of both ends since the last call, with their times.
    pub fn take_end_events(&mut self) -> Vec<(Instant, EndEvent)> {
        self.logbook.events.as_mut().map(std::mem::take).unwrap_or_default()
    }

    pub fn frames(&self) -> &FramesLog {
        &self.carrier.log
    }

    /// Events of the surface since the last call.
    pub fn take_events(&mut self) -> Vec<SurfaceOutput> {
        std::mem::take(&mut self.logbook.outputs)
    }

    /// Whether the survey has ended and the operator's map is complete.
    pub fn is_drained(&self) -> bool {
        self.times.ended.is_some() && self.vehicle().is_converged() && self.meters.labels.agreement() >= 1.0
    }

    /// Handles all events until `until`.
    pub fn advance(&mut self, until: Instant) -> Result<(), UserError> {
        loop {
            let next = self.next_event();
            if next > until {
                break;
            }
            self.times.now = self.times.now.max(next);
            self.handle_timeouts()?;
            self.pump();
        }
        self.times.now = self.times.now.max(until);
        self.pump();
        Ok(())
    }

    /// Runs the survey to its end, then lets the link drain for at most `drain`. `then` is called every second.
    pub fn run(
        &mut self,
        drain: Duration,
        then: &mut dyn FnMut(&mut Self) -> Result<(), UserError>,
    ) -> Result<(), UserError> {
        self.run_survey(Duration::from_secs(1), then)?;
        let give_up = self.now() + drain;
        while !self.is_drained() && self.now() < give_up {
            self.advance(self.now() + Duration::from_secs(1))?;
            then(self)?;
        }
        self.camera.finish_recording()
    }

    /// Runs the survey to its end in steps, with a call of `then` after each of them.
    pub(crate) fn run_survey(
        &mut self,
        step: Duration,
        then: &mut dyn FnMut(&mut Self) -> Result<(), UserError>,
    ) -> Result<(), UserError> {
        let end = Instant::from_secs_f64(self.config.survey.duration_s);
        while self.now() < end {
            self.advance((self.now() + step).min(end))?;
            then(self)?;
        }
        self.end_survey();
        Ok(())
    }

    /// Stops camera and sampler; the link continues.
    pub fn end_survey(&mut self) {
        if self.times.ended.is_none() {
            self.look();
            self.meters.end_survey();
            self.times.ended = Some(self.times.now);
            self.vehicle.finish_survey();
            self.pump();
        }
    }

    /// Metres between the vehicle's true and its estimated position.
    pub fn position_error_m(&self) -> f64 {
        let (x, y) = self.vehicle().navigator().world().xy();
        (x - self.motion.x_m).hypot(y - self.motion.y_m)
    }

    /// The simulated sea floor that the camera sees.
    pub fn world(&self) -> &World {
        &self.camera.world
    }

    /// What has become of the camera's images.
    pub fn images(&self) -> String {
        let mapped = self.logbook.poses.len();
        match &self.logbook.unreadable {
            None => format!("{mapped} images mapped"),
            Some((count, _)) => format!("{mapped} images mapped, {count} dropped (unreadable {count})"),
        }
    }

    /// The configuration, with the area that is surveyed if it has none.
    pub fn settings(&self) -> Config {
        let mut config = self.config.clone();
        config.survey.area_m = self.camera.survey_area(&config).ok();
        config
    }

    /// The part of the sea floor that pictures of the mission show, in the world frame.
    pub fn pictured_area(&self) -> Area {
        let surveyed = self.config.survey.area_m.unwrap_or_else(|| self.camera.world.survey_area());
        self.camera.world.pictured_area(&surveyed)
    }

    /// Edge of a map cell, metres.
    pub fn cell_m(&self) -> f64 {
        cell_m(&self.config)
    }
}

fn vehicle_host(
    config: &Config,
    station: Station,
    area: Area,
    seed: u64,
    now: Instant,
) -> Result<VehicleHost, UserError> {
    let authenticity = scenecast_config::authenticity(config, scenecast_config::vehicle_address(config)?)?;
    let profile = *station.profile();
    let vehicle =
        scenecast_vehicle::assemble(config, authenticity, profile, area, Durable::default(), seed ^ 0x0A0B, now)?;
    Ok(VehicleHost::new(vehicle, station, None))
}

fn surface_host(config: &Config, station: Station, seed: u64, now: Instant) -> Result<SurfaceHost, UserError> {
    let authenticity = scenecast_config::authenticity(config, Address::SURFACE)?;
    let (table, profile) = (scenecast_config::tuning_table(config)?, *station.profile());
    let surface = scenecast_surface::assemble(config, authenticity, table, profile, seed ^ 0x5EA, now)?;
    Ok(SurfaceHost::new(surface, station, None))
}

fn script(config: &Config, area: Area) -> Script {
    let survey = &config.survey;
    match config.operator.script {
        OperatorScript::Scripted => Script::of_survey(survey.duration_s),
        OperatorScript::Fenced => Script::fenced(survey.duration_s, area, survey.speed_m_s),
        OperatorScript::None => Script::none(),
    }
}

#[cfg(test)]
mod floor_tests;
#[cfg(test)]
mod label_tests;
#[cfg(test)]
mod planned_tests;
#[cfg(test)]
mod track_tests;
#[cfg(test)]
mod tuned_tests;
