//! The loop of a rehearsal: the roles, the water and the sea floor on one virtual clock.

use super::frames_log::FramesLog;
use super::meter::Meter;
use super::motion::Motion;
use super::recording::{RecordedFrame, Recorder, Recording};
use super::script::Script;
use super::world::World;
use crate::asv::{Surface, SurfaceOutput};
use crate::auv::{AppliedSlot, Area, Durable, MapUpdate, Mapper, Vehicle, VehicleOutput, cell_m};
use crate::config::Config;
use crate::ends;
use crate::problem::Problem;
use scene_model::project::Pose;
use scenecast_protocol::directive::{Fix, SlotId};
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::schedule::Audit;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Address, SessionId};
use sim_channel::{Channel, ChannelConfig, LossModel, NodeId, Outcome, Position, Stream};
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
    pub(super) audits: [Audit; 2],
    pub(super) applied: Vec<AppliedSlot>,
    pub(super) issued: BTreeMap<(SlotId, u16), Instant>,
    pub(super) fixes_sent: u64,
    pub(super) png_full_bytes: u64,
    pub(super) ended: Option<Instant>,
    pub(super) update: Option<MapUpdate>,
    /// Where the vehicle was when it saw something, by its own belief.
    pub(super) track: Vec<(f64, f64)>,
    channel: Channel,
    modem: ModemProfile,
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
    dice: Stream,
    events: Vec<SurfaceOutput>,
}

impl Mission {
    /// A mission at its start.
    pub fn new(config: Config, options: MissionOptions) -> Result<Self, Problem> {
        let MissionOptions { world, seed, record } = options;
        let modem = ends::modem_profile(&config, config.channel.bit_rate);
        let now = Instant::ZERO;
        let recording = match config.camera.source.as_str() {
            "" => None,
            source => Some(Recording::open(Recording::folder(source)?)?),
        };
        let area = survey_area(&config, recording.as_ref(), &world);
        let mut dice = Stream::new(seed, &[2]);
        let session = SessionId::from_random(dice.below(65_536) as u16);
        let vehicle = ends::vehicle(&config, modem, area, Durable::default(), session, now)?;
        let surface = ends::surface(&config, modem, seed ^ 0x5EA, now)?;
        let (x, y) = vehicle.navigator().position();
        let drift = config.navigation.drift_percent / 100.0;
        let motion = Motion::new(x, y, config.survey.speed_m_s, drift, seed);
        let mut channel = Channel::new(channel_config(&config), seed);
        let middle = ((area.west + area.east) / 2.0, (area.south + area.north) / 2.0);
        channel.place(SURFACE, Position::new(middle.0 + config.channel.range_m, middle.1, -1.0));
        let script = match config.operator.script.as_str() {
            "scripted" => Script::of_survey(config.survey.duration_s),
            _ => Script::none(),
        };
        let fix_period = Instant::from_secs_f64(config.navigation.fix_period_s);
        let window = Duration::from_secs_f64(config.link.budget_window_s);
        let mut mission = Self {
            mapper: Mapper::new(&config, 0, seed)?,
            address: ends::vehicle_address(&config)?,
            recorder: record.as_deref().map(Recorder::new).transpose()?,
            times: Timetable { step: now, frame: now, fix: fix_period, look: now },
            audits: [Audit::new(window), Audit::new(window)],
            log: FramesLog::default(),
            meter: Meter::default(),
            applied: Vec::new(),
            issued: BTreeMap::new(),
            fixes_sent: 0,
            png_full_bytes: 0,
            ended: None,
            update: None,
            track: Vec::new(),
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
            modem,
            script,
            recording,
            now,
            dice,
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
        self.ended.is_some() && self.vehicle.is_settled() && self.meter.agreement() >= 1.0
    }

    /// Runs until `until`, or a little beyond the last event before it.
    pub fn advance(&mut self, until: Instant) -> Result<(), Problem> {
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
    pub fn run(&mut self, drain: Duration, progress: &mut dyn FnMut(f64)) -> Result<(), Problem> {
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
            self.ended = Some(self.now);
            self.vehicle.finish_survey();
            self.pump();
        }
    }

    fn next_event(&self) -> Option<Instant> {
        let links = [
            self.vehicle.poll_timeout().filter(|_| self.transmitting[0].is_none()),
            self.surface.poll_timeout().filter(|_| self.transmitting[1].is_none()),
        ];
        // A wake-up that has passed led to no frame: it waits for another event.
        let links = links.into_iter().flatten().map(|(at, _)| at).filter(|&at| at > self.now);
        let script = self.script.poll_timeout().filter(|_| self.ended.is_none());
        let regular = [self.times.look, self.times.step, self.times.frame];
        let fix = (self.config.navigation.fix_period_s > 0.0).then_some(self.times.fix);
        let channel = self.channel.poll_timeout().map(Instant::from);
        links
            .chain(self.transmitting.into_iter().flatten())
            .chain(regular)
            .chain(script)
            .chain(fix)
            .chain(channel)
            .min()
    }

    fn handle_timeouts(&mut self) -> Result<(), Problem> {
        let now = self.now;
        for (node, ends_at) in self.transmitting.into_iter().enumerate() {
            if ends_at.is_some_and(|at| at <= now) {
                self.transmitting[node] = None;
                if node == 0 {
                    self.vehicle.handle_transmit_outcome()
                } else {
                    self.surface.handle_transmit_outcome(now)
                }
            }
        }
        while let Some(arrival) = self.channel.poll_arrival(now.into()) {
            self.log.handle_fate(&arrival);
            if let Outcome::Delivered { bytes, .. } = &arrival.outcome {
                if arrival.to == SURFACE {
                    self.heard_bits += self.modem.bits_on_air(bytes.len());
                }
                if arrival.to == VEHICLE {
                    self.vehicle.handle_frame(bytes, now)
                } else {
                    self.surface.handle_frame(bytes, now)
                }
            }
        }
        if now >= self.times.step {
            self.times.step = self.times.step + Duration::from_secs_f64(STEP_S);
            self.step();
        }
        if now >= self.times.frame {
            self.camera()?;
        }
        if now >= self.times.fix && self.config.navigation.fix_period_s > 0.0 {
            self.times.fix = self.times.fix + Duration::from_secs_f64(self.config.navigation.fix_period_s);
            self.fix();
        }
        if self.ended.is_none() {
            self.script.handle_timeout(&mut self.surface, self.address, now);
        }
        if now >= self.times.look {
            self.times.look = self.times.look + Duration::from_secs(1);
            self.look();
        }
        Ok(())
    }

    /// Lets both ends speak and carries out what they ask for.
    fn pump(&mut self) {
        while let Some(output) = self.vehicle.poll_output() {
            match output {
                VehicleOutput::Persist => self.vehicle.handle_persisted(),
                VehicleOutput::Waypoint(x, y) => self.motion.set_target(Some((x, y))),
                VehicleOutput::Hold => self.motion.set_target(None),
                VehicleOutput::RefineRate(words_per_s) => self.mapper.set_refine_rate(words_per_s),
                VehicleOutput::Applied(applied) => self.applied.push(applied),
            }
        }
        while let Some(output) = self.surface.poll_output() {
            self.picture_version += u64::from(matches!(output, SurfaceOutput::MapChanged(_)));
            self.events.push(output);
        }
        self.note_issued();
        if self.transmitting[0].is_none()
            && let Some(t) = self.vehicle.poll_transmit(self.now)
        {
            self.transmit(0, t.bytes, t.kind);
        }
        if self.transmitting[1].is_none()
            && let Some(t) = self.surface.poll_transmit(self.now)
        {
            self.transmit(1, t.bytes, t.kind);
        }
    }

    fn transmit(&mut self, node: usize, bytes: Vec<u8>, kind: &'static str) {
        let airtime = self.modem.airtime(bytes.len());
        self.audits[node].record(self.modem.bits_on_air(bytes.len()), self.now);
        let from = if node == 0 { VEHICLE } else { SURFACE };
        let n = bytes.len();
        let transmission = self.channel.transmit(from, bytes, airtime, self.now.into());
        self.log.handle_sent(transmission, node == 0, n, kind);
        self.transmitting[node] = Some(self.now + airtime);
    }

    fn note_issued(&mut self) {
        let Some(view) = self.surface.view(self.address) else { return };
        for slot in view.slots() {
            self.issued.entry((slot.id, slot.version)).or_insert(slot.issued);
        }
    }

    fn step(&mut self) {
        if self.recording.is_some() || self.ended.is_some() {
            return;
        }
        self.vehicle.steer();
        self.pump();
        let o = self.motion.step(self.vehicle.navigator().position(), STEP_S);
        let depth = self.vehicle.navigator().depth_m();
        self.vehicle.handle_odometry(o.dx_m, o.dy_m, o.heading_rad, depth, self.now);
        self.place_vehicle();
    }

    fn place_vehicle(&mut self) {
        let depth = self.vehicle.navigator().depth_m();
        self.channel.place(VEHICLE, Position::new(self.motion.x_m, self.motion.y_m, -depth));
    }

    fn camera(&mut self) -> Result<(), Problem> {
        if self.ended.is_some() {
            self.times.frame = self.now + Duration::from_secs(3600);
            return Ok(());
        }
        let image = match &self.recording {
            Some(recording) => {
                let Some(frame) = recording.frames.get(self.next_recorded) else {
                    self.end_survey();
                    return Ok(());
                };
                if Instant::from_secs_f64(frame.t_s) > self.now {
                    self.times.frame = Instant::from_secs_f64(frame.t_s);
                    return Ok(());
                }
                self.next_recorded += 1;
                self.vehicle.set_pose(frame.x_m, frame.y_m, frame.heading_rad, frame.depth_m, self.now);
                frame.image()?
            }
            None => {
                self.times.frame = self.times.frame + Duration::from_secs_f64(1.0 / self.config.camera.rate_hz);
                let Motion { x_m, y_m, heading_rad, .. } = self.motion;
                let camera = &self.config.camera;
                self.world.view(x_m, y_m, heading_rad, camera.width_px, camera.height_px)
            }
        };
        self.see(&image)
    }

    fn see(&mut self, image: &image::RgbImage) -> Result<(), Problem> {
        let t_s = self.now.as_secs_f64();
        let pose = pose_of(&self.vehicle);
        if let Some(recorder) = &mut self.recorder {
            let heading_rad = self.vehicle.navigator().heading_rad();
            let depth_m = self.vehicle.navigator().depth_m();
            let frame = RecordedFrame { t_s, file: Default::default(), x_m: pose.x, y_m: pose.y, depth_m, heading_rad };
            recorder.push(image, &frame)?;
        }
        self.track.push((pose.x, pose.y));
        let update = self.mapper.handle_frame(image, &pose, t_s);
        let session = SessionId::from_random(self.dice.below(65_536) as u16);
        self.vehicle.handle_map(&update, session, self.now);
        self.vehicle.answer_requests(&|label| self.mapper.exemplar(label));
        if self.vehicle.map_version() != self.map_version {
            self.map_version = self.vehicle.map_version();
            self.png_full_bytes += crate::picture::encode(self.vehicle.map()).map_or(0, |png| png.len() as u64);
        }
        self.update = Some(update);
        Ok(())
    }

    fn fix(&mut self) {
        if self.recording.is_some() || self.ended.is_some() {
            return;
        }
        let sigma_m = self.config.navigation.fix_sigma_m;
        let x_m = self.motion.x_m + sigma_m * self.dice.normal();
        let y_m = self.motion.y_m + sigma_m * self.dice.normal();
        // The ranging signal was this long under way.
        let range = self.channel.range_m(SURFACE, VEHICLE).unwrap_or(0.0);
        let fix = Fix { x_m, y_m, sigma_m, age_s: range / self.config.channel.sound_speed_m_s };
        self.fixes_sent += u64::from(self.surface.send_fix(self.address, fix, self.now).is_ok());
    }

    fn look(&mut self) {
        let Some(operator) = self.surface.map(self.address) else { return };
        let versions = (self.vehicle.map_version(), self.picture_version);
        self.meter.look(self.vehicle.map(), operator, versions, self.now);
    }

    /// Metres between where the vehicle is and where it believes to be.
    pub fn position_error_m(&self) -> f64 {
        let (x, y) = self.vehicle.navigator().position();
        (x - self.motion.x_m).hypot(y - self.motion.y_m)
    }

    /// Edge of a cell in metres.
    pub fn cell_m(&self) -> f64 {
        cell_m(&self.config)
    }
}

/// The camera's pose as the vehicle believes it.
pub(crate) fn pose_of(vehicle: &Vehicle) -> Pose {
    let (x, y) = vehicle.navigator().position();
    Pose { x, y, z: -vehicle.navigator().depth_m(), yaw_rad: -vehicle.navigator().heading_rad() }
}

fn survey_area(config: &Config, recording: Option<&Recording>, world: &World) -> Area {
    let [west, south, east, north] = config.survey.area_m;
    if east > west && north > south {
        return Area { west, south, east, north };
    }
    match recording {
        Some(recording) => {
            let [west, south, east, north] = recording.limits();
            Area { west, south, east, north }
        }
        None => world.area(),
    }
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
