//! `scenecast auv`: ports, disk and clock around the vehicle's host.

use super::checkpoint::Keep;
use super::clock::{Clock, utc_hours};
use super::durable::{Checkpoint, DiskWatch, Keeper, StartedRun};
use super::equipment::SensorFaults;
use super::journal::Folder;
use super::labels::{self, FromLabels, LabelThread, move_the_vehicle};
use super::mapping::{Disagreement, FromMapper, Mapped, MapperThread, ToMapper};
use super::modem::{self, ModemPort, warn_without_key};
use super::pilot::{self, PilotPort, SimulatedAutopilot};
use super::record::VehicleRecord;
use super::restore::{Start, start};
use super::ros2::{RosSensors, VehicleRos2};
use super::stop::{Load, Reload, Stop, configured_budget, hold_hang_up, keep_private};
use crate::camera::{Camera, CameraFrame};
use crate::port::FromPort;
use scenecast_config::{Config, LabelSource};
use scenecast_core::{Area, UserError};
use scenecast_files::{Recording, configured_recording, read_class_names};
use scenecast_host::{CameraPose, VehicleHost, VehicleHostEvent, modem_station};
use scenecast_labels::ImagePose;
use scenecast_protocol::directive::{SlotId, SlotState};
use scenecast_protocol::link::Authenticity;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::LayerSet;
use scenecast_protocol::time::Instant;
use scenecast_vehicle::{ForeignMap, MapChanges, MapProducer, Vehicle};
use std::time::Duration;

/// Maximum time between two calls of the host.
const MAX_SLEEP: Duration = Duration::from_secs(1);

/// Runs the vehicle until it is interrupted; on SIGHUP it calls `load` for a new budget and new shares.
pub fn run_vehicle(load: Load, simulated: Option<SimulatedAutopilot>) -> Result<(), UserError> {
    hold_hang_up();
    super::block_on(async move {
        let config = load()?;
        keep_private();
        warn_without_key(&config);
        let (shell, stop) = VehicleShell::start(&config, load, simulated).await?;
        shell.run(stop).await
    })
}

/// The vehicle's role at the start of a run, with the state that was restored.
fn vehicle_of(
    config: &Config,
    authenticity: Option<Authenticity>,
    restored: StartedRun<Folder>,
    modem: ModemProfile,
    recording: Option<&Recording>,
    now: Instant,
) -> Result<(Vehicle, Keeper<Folder>), UserError> {
    let StartedRun { keeper, durable, is_again, is_stored } = restored;
    let area = survey_area(config, recording)?;
    let seed = super::random_bits();
    let mut vehicle = scenecast_vehicle::assemble(config, authenticity, modem, area, durable, seed, now)?;
    if is_again {
        vehicle.assume_budget_spent(now);
    }
    if !is_stored {
        vehicle.assume_start_refused(now);
    }
    Ok((vehicle, keeper))
}

fn survey_area(config: &Config, recording: Option<&Recording>) -> Result<Area, UserError> {
    let area = config.survey.area_m.or_else(|| recording.map(Recording::area));
    let missing = "survey.area_m: set the west, south, east and north limits of the survey";
    area.ok_or_else(|| UserError::Input(missing.to_owned()))
}

struct Ports {
    modem: ModemPort,
    pilot: PilotPort,
}

impl Ports {
    async fn open(config: &Config, has_autopilot: bool, now: Instant) -> Result<Self, UserError> {
        Ok(Self { modem: ModemPort::open(config, now).await?, pilot: PilotPort::open(config, has_autopilot) })
    }
}

/// The thread of other programs' labels and bands.
struct Labels {
    thread: Option<LabelThread>,
    /// Whether the labels are not the scene model's, which then sees no frames.
    is_foreign: bool,
    /// Whether images of another program move the vehicle.
    move_vehicle: bool,
}

impl Labels {
    /// Starts the thread with the map of the last checkpoint; without one there is no such program.
    fn start(
        config: &Config,
        map: Option<(ForeignMap, Keep)>,
        sensors: &RosSensors,
        clock: Clock,
    ) -> Result<Self, UserError> {
        let thread = map.map(|(map, keep)| {
            let names = config.labels.classes.as_deref().map(read_class_names).transpose()?;
            let names = names.map_or(Vec::new(), |item| item.classes);
            let feeds = labels::open(config, &map, &|topic| labels::topic(sensors, topic))?;
            LabelThread::start(map, &names, feeds, keep, clock)
        });
        let is_foreign = config.labels.source != LabelSource::SceneModel;
        Ok(Self { thread: thread.transpose()?, is_foreign, move_vehicle: move_the_vehicle(config) })
    }
}

/// Moves bytes, reads the clock and syncs files; the host makes all decisions.
struct VehicleShell {
    host: VehicleHost,
    camera: Camera,
    mapper: MapperThread,
    labels: Labels,
    ports: Ports,
    ros2: VehicleRos2,
    clock: Clock,
    keeper: Keeper<Folder>,
    disk: DiskWatch,
    faults: SensorFaults,
    disagreement: Disagreement,
    record: VehicleRecord,
    reload: Reload,
}

impl VehicleShell {
    /// Starts every part of the vehicle as it is configured.
    async fn start(
        config: &Config,
        load: Load,
        simulated: Option<SimulatedAutopilot>,
    ) -> Result<(Self, Stop), UserError> {
        let address = scenecast_config::vehicle_address(config)?;
        // A wrong key ends the start before the folder of the state is touched.
        let authenticity = scenecast_config::authenticity(config, address)?;
        let dir = config.runtime.state_dir.as_path();
        let Start { run, mapper, keep, labels } = start(config, dir)?;
        let clock = Clock::new(config.runtime.time_scale);
        let profile = scenecast_drivers::modem::modem_of_process(config, address)?;
        let recording = configured_recording(config)?;
        for note in recording.iter().flat_map(|recording| &recording.notes) {
            tracing::warn!("camera.source: {note}");
        }
        let (vehicle, keeper) = vehicle_of(config, authenticity, run, profile, recording.as_ref(), clock.now())?;
        // Files that do not end, such as a pipe for a key, are read above: until there a signal ends the program at once.
        let stop = Stop::new()?;
        let (is_recorded, sensors) = (recording.is_some(), RosSensors::new(config)?);
        let camera = Camera::start(config, recording, &sensors, clock, mapper.last_s())?;
        let mapper = MapperThread::start(mapper, config, vehicle.settings(), keep)?;
        let labels = Labels::start(config, labels, &sensors, clock)?;
        let pilot = pilot::of_vehicle(config, simulated, clock.now())?;
        let ports = Ports::open(config, pilot.is_some(), clock.now()).await?;
        let reload = Reload::new(load, config)?;
        let mut host = VehicleHost::new(vehicle, modem_station(config, address, profile)?, pilot);
        if is_recorded && camera.is_over() {
            host.handle_camera_end();
        }
        let ros2 = VehicleRos2::start(config)?;
        let (disk, faults, disagreement) = (DiskWatch::new(dir), SensorFaults::default(), Disagreement::default());
        let record = VehicleRecord::start(config, &dir.join("records"), config.runtime.time_scale);
        let shell = Self {
            host,
            camera,
            mapper,
            labels,
            ports,
            ros2,
            clock,
            keeper,
            disk,
            faults,
            disagreement,
            record,
            reload,
        };
        Ok((shell, stop))
    }

    /// Tells how long one pass of the survey takes, where an autopilot carries it out.
    fn tell_pass(&self) {
        let (metres, time) = self.host.vehicle().pass();
        if self.host.autopilot().is_some() && metres > 0.0 {
            tracing::info!(
                "one pass of the survey is {metres:.0} m long and takes {:.1} min",
                time.as_secs_f64() / 60.0
            );
        }
    }

    async fn run(mut self, mut stop: Stop) -> Result<(), UserError> {
        self.tell_pass();
        loop {
            self.pump()?;
            let now = self.clock.now();
            let wake = self.host.poll_timeout(now).map_or(now + MAX_SLEEP, |due| due.min(now + MAX_SLEEP));
            tokio::select! {
                () = stop.asked() => {
                    modem::log_audit(self.host.link());
                    self.camera.log_end();
                    self.mapper.finish();
                    self.labels.thread.into_iter().for_each(LabelThread::finish);
                    self.record.finish(self.camera.tally());
                    return Ok(());
                }
                _ = tokio::time::sleep_until(self.clock.wall(wake)) => {}
                report = self.ports.modem.next() => {
                    self.ports.modem.handle(report, self.host.link_mut(), self.clock.now());
                }
                report = self.ports.pilot.next() => self.handle_pilot(report),
                config = self.reload.next() => self.follow(&config),
                () = self.camera.wait() => {}
                report = LabelThread::next(&mut self.labels.thread) => match report {
                    Some(FromLabels::Mapped(changes, pose)) => self.handle_labels(&changes, pose),
                    Some(FromLabels::Checkpoint { is_refused }) => {
                        self.disk.handle_checkpoint(Checkpoint::Labels, is_refused);
                    }
                    None => return Err(UserError::Failed("the labels' thread ended".to_owned())),
                },
                mapped = self.mapper.mapped.recv() => match mapped {
                    Some(FromMapper::Mapped(mapped)) => self.handle_seen(*mapped),
                    Some(FromMapper::Missed(error)) => self.handle_missed(&error),
                    Some(FromMapper::Checkpoint { is_refused }) => {
                        self.disk.handle_checkpoint(Checkpoint::SceneModel, is_refused);
                    }
                    None => return Err(UserError::Failed("the scene model's thread ended".to_owned())),
                },
            }
            self.host.handle_timeout(self.clock.now());
            self.poll_camera();
        }
    }

    /// Gives the camera the vehicle's pose, and the camera's frames that are due to the scene model.
    fn poll_camera(&mut self) {
        let unseen = self.camera.poll_pose_gap();
        self.host.handle_pose_gap(unseen);
        let labels = self.labels.thread.as_ref().map(LabelThread::health);
        let is_refusing = labels.is_some_and(|health| health.is_failing);
        let faults = self.faults.now(
            self.camera.tally(),
            self.camera.is_silent(),
            unseen,
            is_refusing,
            std::time::Instant::now(),
        );
        self.host.handle_faults(faults);
        if let Some(pose) = self.camera.poll_pose() {
            self.host.handle_pose(pose, self.clock.now());
        }
        if let Some(pose) = self.host.measured_pose() {
            self.camera.handle_pose(pose);
        }
        while let Some(frame) = self.camera.poll_frame(self.host.frames_in_mapper()) {
            self.handle_camera(frame);
        }
    }

    fn handle_pilot(&mut self, report: FromPort) {
        let now = self.clock.now();
        match report {
            FromPort::Open => self.host.handle_pilot_open(now),
            FromPort::Bytes(bytes) => _ = self.host.handle_pilot_bytes(&bytes, now),
            FromPort::Datagram(bytes, sender) => {
                self.ports.pilot.judge(sender, self.host.handle_pilot_bytes(&bytes, now));
            }
            FromPort::Closed => {}
        }
    }

    /// Replaces the budget and the shares that the surface ordered by those of the configuration.
    fn follow(&mut self, config: &Config) {
        let budget = configured_budget(config);
        let streams = budget.background.names(&LayerSet::default()).join(", ");
        tracing::info!("SIGHUP: budget {} bit/s, shares {:?} %, then {streams}", budget.bits_per_s, budget.shares.0);
        self.host.handle_budget(budget, self.clock.now());
    }

    /// Takes changes of another program. Unless something else measures its place, the vehicle is where the last image was
    /// taken.
    fn handle_labels(&mut self, changes: &MapChanges, pose: Option<ImagePose>) {
        let (now, began) = (self.clock.now(), std::time::Instant::now());
        let pose = pose.filter(|_| self.labels.move_vehicle && self.camera.newest_pose().is_none());
        if let Some(ImagePose { x_m, y_m, depth_m, heading_rad }) = pose {
            self.host.handle_pose(CameraPose { x_m, y_m, heading_rad, depth_m }, now);
        }
        if let Some(label) = self.host.handle_changes(changes, now) {
            tracing::warn!("labels: class {} has another name already, which it keeps", label - 1);
        }
        self.labels.thread.iter().for_each(|labels| labels.handle_taken(began));
    }

    fn handle_camera(&mut self, mut frame: CameraFrame) {
        let is_rising = self.camera.is_live() && self.host.is_coming_up();
        if self.labels.is_foreign || is_rising {
            // The frames still move the vehicle.
            let pose = self.camera.newest_pose().unwrap_or(frame.camera_pose());
            self.host.handle_pose(pose, self.clock.now());
            match is_rising {
                true => self.camera.drop_rising(),
                false => self.camera.leave_unmapped(),
            }
            if self.camera.is_over() {
                self.host.finish_survey();
            }
            return;
        }
        match &self.camera {
            Camera::Recorded(_) => {
                let pose = self.host.handle_camera(frame.camera_pose());
                (frame.pose.x_m, frame.pose.y_m) = (pose.x_m, pose.y_m);
                (frame.pose.heading_rad, frame.pose.depth_m) = (pose.heading_rad, pose.depth_m);
            }
            Camera::Live(_) => self.host.handle_matched_camera(),
        }
        let _ = self.mapper.orders.send(ToMapper::Frame(Box::new(frame)));
        if self.camera.is_over() {
            self.host.handle_camera_end();
        }
    }

    fn handle_seen(&mut self, mapped: Mapped) {
        let now = self.clock.now();
        mapped.unusable_depth.iter().for_each(|error| self.camera.handle_unusable_depth(error));
        // A pose that came in after the frame stays the vehicle's.
        let pose = mapped.frame.as_ref().map(|frame| self.camera.newest_pose().unwrap_or(frame.camera_pose()));
        let registered = mapped.registered.as_ref();
        // The dead reckoning of an autopilot drifts from the images; a navigation source gives places.
        if let (Some(frame), true) = (registered, self.camera.newest_pose().is_some()) {
            let places = (frame.dead_reckoned.xy(), (frame.pose.x, frame.pose.y));
            let line = self.disagreement.handle(places.0, places.1, std::time::Instant::now());
            line.iter().for_each(|line| tracing::warn!("camera: {line}"));
        }
        self.host.handle_mapped(pose, registered, &mapped.changes, mapped.exemplars, now);
    }

    /// Logs an unreadable frame; it does not end the mission.
    fn handle_missed(&mut self, error: &UserError) {
        self.camera.handle_missed(error);
        self.host.handle_missed();
    }

    /// Acts on every event of the host, then writes the bytes for the ports.
    fn pump(&mut self) -> Result<(), UserError> {
        let now = self.clock.now();
        if let Some(clock) = utc_hours() {
            self.host.set_clock(clock);
        }
        if let Some(disk) = self.disk.look(std::time::Instant::now()) {
            self.host.handle_disk(disk);
        }
        let navigator = self.host.vehicle().navigator();
        if let Some(labels) = self.labels.thread.as_ref().filter(|_| navigator.is_measured()) {
            let ((x_m, y_m), depth_m) = (navigator.dead_reckoned().xy(), navigator.depth_m());
            labels.handle_pose(ImagePose { x_m, y_m, depth_m, heading_rad: navigator.heading_rad() }, now);
        }
        self.host.steer(now);
        self.record.observe(self.host.vehicle(), now);
        self.record.observe_images(self.camera.tally());
        self.ros2.publish(&self.host, self.camera.tally(), || self.labels.thread.as_ref().map(LabelThread::health));
        self.handle_events()?;
        while let Some(bytes) = self.host.poll_output(now) {
            self.ports.modem.write(bytes);
        }
        self.ports.modem.reopen_if_silent(self.host.link(), now);
        self.ports.modem.listen(self.host.link());
        while let Some(bytes) = self.host.poll_pilot_output() {
            self.ports.pilot.write(bytes);
        }
        self.handle_events()
    }

    fn handle_events(&mut self) -> Result<(), UserError> {
        while let Some(event) = self.host.poll_event() {
            self.record.handle_event(&event, self.clock.now());
            match event {
                VehicleHostEvent::Persist => {
                    // A refusing disk must not end the link: the vehicle then obeys hold and abort from memory.
                    match self.keeper.save(self.host.vehicle().durable()) {
                        true => self.host.handle_persisted(),
                        false => self.host.handle_persist_failed(self.clock.now()),
                    }
                }
                VehicleHostEvent::Tune(settings) => {
                    let _ = self.mapper.orders.send(ToMapper::Tune(settings));
                }
                VehicleHostEvent::SurveyEnded => {
                    tracing::info!("the recorded mission has ended");
                    let _ = self.mapper.orders.send(ToMapper::Keep);
                }
                VehicleHostEvent::Applied(a) => {
                    tracing::info!("{} {}: {:?}", a.id.name(), a.version, a.state);
                    if a.id == SlotId::Fence && a.state == SlotState::Applied {
                        self.tell_pass();
                    }
                }
                VehicleHostEvent::Waypoint(at) => {
                    tracing::info!("waypoint {:.1} m east, {:.1} m north", at.x_m, at.y_m)
                }
                VehicleHostEvent::Hold => tracing::info!("hold"),
                VehicleHostEvent::Surface => tracing::info!("come up"),
                VehicleHostEvent::Fixed(fix, _) => {
                    tracing::debug!(
                        "fix: {:.1} m east, {:.1} m north, +-{:.1} m",
                        fix.position.east_m,
                        fix.position.north_m,
                        fix.sigma_m
                    );
                }
                VehicleHostEvent::Frame(event) => self.ports.modem.handle_event(&event)?,
                VehicleHostEvent::Pilot(event) => pilot::log(event),
                VehicleHostEvent::Note(note) => tracing::warn!("navigation: {note}"),
            }
        }
        Ok(())
    }
}
