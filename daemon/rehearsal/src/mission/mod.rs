//! The loop of a rehearsal: the roles, the water and the sea floor on one virtual clock.

mod anchored;
mod carrier;
mod events;
#[cfg(test)]
mod planned;
#[cfg(test)]
mod tuned;

use super::docked::{self, Docked};
use super::frames_log::FramesLog;
use super::meter::Meter;
use super::script::Script;
use super::world::World;
use anchored::Anchored;
use scene_model::project::Pose;
use scenecast_config::Config;
use scenecast_config::cell_m;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_files::{Recorder, Recording};
use scenecast_motion::Motion;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::map::LayerKind;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::{Surface, SurfaceOutput};
use scenecast_vehicle::{AppliedSlot, Durable, MapUpdate, Mapper, Vehicle};
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, NodePosition};
use std::collections::BTreeMap;
use std::time::Duration;

const SURFACE: NodeId = NodeId(0);
const VEHICLE: NodeId = NodeId(1);
/// Seconds between two steps of the vehicle's motion.
const STEP_S: f64 = 0.5;

/// What a rehearsal is made of besides its configuration.
pub struct MissionOptions {
    /// The sea floor.
    pub world: World,
    /// Seed of everything random.
    pub seed: u64,
    /// Where to record the camera frames, if wanted.
    pub record: Option<std::path::PathBuf>,
}

/// When each of the regular events is next due.
#[derive(Debug, Clone, Copy)]
struct Timetable {
    step: Instant,
    frame: Instant,
    fix: Instant,
    look: Instant,
}

/// From where to where in the world, metres east and north.
pub type Leg = ((f64, f64), (f64, f64));

/// A mission under way.
pub struct Mission {
    pub(super) config: Config,
    pub(super) seed: u64,
    pub(super) world: World,
    pub(super) vehicle: Vehicle,
    pub(super) mapper: Mapper,
    pub(super) surface: Surface,
    pub(super) address: Address,
    pub(super) motion: Motion,
    pub(super) log: FramesLog,
    pub(super) meter: Meter,
    pub(super) layer_meters: BTreeMap<LayerKind, Meter>,
    pub(super) audits: [Audit; 2],
    pub(super) applied: Vec<AppliedSlot>,
    pub(super) issued: BTreeMap<(SlotId, u16), Instant>,
    pub(super) png_full_bytes: u64,
    pub(super) ended: Option<Instant>,
    pub(super) update: Option<MapUpdate>,
    /// Where the vehicle was when it saw something, by its own belief.
    pub(super) track: Vec<(f64, f64)>,
    /// Each order to go somewhere: from, to, by its belief.
    pub(super) legs: Vec<Leg>,
    /// How many legs there were when the vehicle put the last fence in force.
    pub(super) legs_before_fence: usize,
    channel: Channel,
    /// Drivers and emulated modems with a water of their own, if the configuration names a make of modem.
    docked: Option<Docked>,
    pub(super) modem: ModemProfile,
    script: Script,
    recording: Option<Recording>,
    recorder: Option<Recorder>,
    next_recorded: usize,
    times: Timetable,
    now: Instant,
    transmitting: [Option<Instant>; 2],
    map_version: u64,
    picture_version: u64,
    heard_bits: u64,
    anchored: Anchored,
    events: Vec<SurfaceOutput>,
}

impl Mission {
    /// A mission at its start.
    pub fn new(config: Config, options: MissionOptions) -> Result<Self, UserError> {
        let MissionOptions { world, seed, record } = options;
        let now = Instant::ZERO;
        let mut docked = carrier::docked(&config, seed, now)?;
        let water = scenecast_config::modem_profile(&config, config.channel.bit_rate);
        let [modem, surface_modem] = docked.as_mut().map_or([water; 2], carrier::profiles);
        let recording = match config.camera.source.as_str() {
            "" => None,
            source => Some(Recording::open(Recording::folder(source)?, config.camera.metres_per_pixel)?),
        };
        let area = survey_area(&config, recording.as_ref(), &world);
        if recording.is_none() && !overlap(&area, &world.area()) {
            let a = world.area();
            let limits = format!("{} to {} m east, {} to {} m north", a.west, a.east, a.south, a.north);
            return Err(UserError::Input(format!("survey.area_m lies outside the image, which covers {limits}")));
        }
        let vehicle = scenecast_vehicle::assemble(
            &config,
            scenecast_config::authenticity(&config)?,
            modem,
            area,
            Durable::default(),
            seed ^ 0x0A0B,
            now,
        )?;
        let mut surface = scenecast_surface::assemble(
            &config,
            scenecast_config::authenticity(&config)?,
            scenecast_config::tuning_table(&config)?,
            surface_modem,
            seed ^ 0x5EA,
            now,
        )?;
        let (x, y) = vehicle.navigator().position().xy();
        let drift = config.navigation.drift_percent / 100.0;
        let motion = Motion::new(x, y, config.survey.speed_m_s, drift, seed);
        let mut channel = Channel::new(channel_config(&config), seed);
        let middle = ((area.west + area.east) / 2.0, (area.south + area.north) / 2.0);
        let surface_place = NodePosition::new(middle.0 + config.channel.range_m, middle.1, anchored::HEAD_M);
        channel.place(SURFACE, surface_place);
        if let Some(docked) = &mut docked {
            docked.place(docked::SURFACE, surface_place);
        }
        let (anchored, relay) = Anchored::new(&config, surface_place, scenecast_config::origin(&config)?, seed ^ 0x6B5);
        surface.set_relay(relay);
        let script = match config.operator.script.as_str() {
            "scripted" => Script::of_survey(config.survey.duration_s),
            "fenced" => Script::fenced(config.survey.duration_s, area, config.survey.speed_m_s),
            _ => Script::none(),
        };
        let fix_period = Instant::from_secs_f64(config.navigation.fix_period_s);
        let window = Duration::from_secs_f64(config.link.budget_window_s);
        let mut mission = Self {
            mapper: Mapper::new(&config, scenecast_files::configured_vocabulary(&config.scene.vocabulary)?, 0, seed)?,
            address: scenecast_config::vehicle_address(&config)?,
            recorder: record.as_deref().map(Recorder::new).transpose()?,
            times: Timetable { step: now, frame: now, fix: fix_period, look: now },
            audits: [Audit::new(window), Audit::new(window)],
            log: FramesLog::default(),
            meter: Meter::default(),
            layer_meters: BTreeMap::new(),
            applied: Vec::new(),
            issued: BTreeMap::new(),
            png_full_bytes: 0,
            ended: None,
            update: None,
            track: Vec::new(),
            legs: Vec::new(),
            legs_before_fence: 0,
            transmitting: [None; 2],
            map_version: 0,
            picture_version: 0,
            heard_bits: 0,
            next_recorded: 0,
            events: Vec::new(),
            config,
            seed,
            world,
            vehicle,
            surface,
            motion,
            channel,
            docked,
            modem,
            script,
            recording,
            now,
            anchored,
        };
        mission.place_vehicle();
        mission.pump();
        Ok(mission)
    }

    /// The time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// The configuration.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// The modem of both ends.
    pub fn modem(&self) -> &ModemProfile {
        &self.modem
    }

    /// Bits on air of the frames that the surface heard.
    pub fn heard_bits(&self) -> u64 {
        self.heard_bits
    }

    /// The surface, for the operator.
    pub fn surface(&mut self) -> &mut Surface {
        &mut self.surface
    }

    /// The vehicle.
    pub fn vehicle(&self) -> &Vehicle {
        &self.vehicle
    }

    /// Each order to go somewhere that the vehicle gave itself: from where to where, by its belief.
    pub fn legs(&self) -> &[Leg] {
        &self.legs
    }

    /// Metres that the vehicle really went.
    pub fn distance_m(&self) -> f64 {
        self.motion.distance_m
    }

    /// The vehicle's address.
    pub fn address(&self) -> Address {
        self.address
    }

    /// Bits on air of vehicle and surface.
    pub fn audits(&self) -> &[Audit; 2] {
        &self.audits
    }

    /// Frames sent and lost.
    pub fn frames(&self) -> &FramesLog {
        &self.log
    }

    /// What the surface had to tell since the last call.
    pub fn take_events(&mut self) -> Vec<SurfaceOutput> {
        std::mem::take(&mut self.events)
    }

    /// Whether the survey has ended and the operator has everything.
    pub fn is_drained(&self) -> bool {
        self.ended.is_some() && self.vehicle.is_converged() && self.meter.agreement() >= 1.0
    }

    /// Runs until `until`, or a little beyond the last event before it.
    pub fn advance(&mut self, until: Instant) -> Result<(), UserError> {
        while let Some(next) = self.next_event().filter(|&at| at <= until) {
            self.now = self.now.max(next);
            self.handle_timeouts()?;
            self.pump();
        }
        self.now = self.now.max(until);
        self.pump();
        Ok(())
    }

    /// Flies the survey to its end, then lets the channel drain for at most `drain`.
    pub fn run(&mut self, drain: Duration, progress: &mut dyn FnMut(f64)) -> Result<(), UserError> {
        let end = Instant::from_secs_f64(self.config.survey.duration_s);
        while self.now < end {
            self.advance((self.now + Duration::from_secs(10)).min(end))?;
            progress(self.now.as_secs_f64() / end.as_secs_f64());
        }
        self.end_survey();
        let give_up = end + drain;
        while !self.is_drained() && self.now < give_up {
            self.advance(self.now + Duration::from_secs(1))?;
        }
        if let Some(recorder) = &self.recorder {
            recorder.finish()?;
        }
        Ok(())
    }

    /// The camera and the sampler stop; the link goes on.
    pub fn end_survey(&mut self) {
        if self.ended.is_none() {
            self.look();
            self.meter.end_survey();
            self.layer_meters.values_mut().for_each(Meter::end_survey);
            self.ended = Some(self.now);
            self.vehicle.finish_survey();
            self.pump();
        }
    }

    /// Metres between where the vehicle is and where it believes to be.
    pub fn position_error_m(&self) -> f64 {
        let (x, y) = self.vehicle.navigator().world().xy();
        (x - self.motion.x_m).hypot(y - self.motion.y_m)
    }

    /// Edge of a cell in metres.
    pub fn cell_m(&self) -> f64 {
        cell_m(&self.config)
    }
}

/// The camera's pose as the vehicle believes it.
pub(crate) fn pose_of(vehicle: &Vehicle) -> Pose {
    let (x, y) = vehicle.navigator().position().xy();
    Pose { x, y, z: -vehicle.navigator().depth_m(), yaw_rad: -vehicle.navigator().heading_rad() }
}

fn survey_area(config: &Config, recording: Option<&Recording>, world: &World) -> Area {
    scenecast_config::survey_area(config).unwrap_or_else(|| recording.map_or_else(|| world.area(), Recording::area))
}

fn overlap(a: &Area, b: &Area) -> bool {
    a.west < b.east && b.west < a.east && a.south < b.north && b.south < a.north
}

fn channel_config(config: &Config) -> ChannelConfig {
    let c = &config.channel;
    ChannelConfig {
        sound_speed_m_s: c.sound_speed_m_s,
        half_duplex: c.half_duplex,
        loss: if c.loss > 0.0 { LossModel::Independent { probability: c.loss } } else { LossModel::None },
        corruption: c.corruption,
        duplication: c.duplication,
        reordering: c.reordering,
        reorder_delay: Duration::from_secs(5),
        ..ChannelConfig::default()
    }
}
