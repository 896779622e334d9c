//! ArduSub and ArduRover over MAVLink 2.

mod attitude;
pub mod frame;
pub mod message;
mod reception;
mod sources;
mod targets;

use super::{Autopilot, Counters, Goal, Health, Outbox, Step};
use attitude::Attitude;
use frame::{Deframer, Frame, encode};
use message::{Heard, Said, boot_time_ms, heard_extra};
use reception::{BootClock, BootTime, Reception};
use scenecast_core::LatLon;
use scenecast_protocol::time::Instant;
use sources::{Altimeter, Claim, HeightSource, Sources, Texts};
use std::time::Duration;
use targets::{CommandWatch, Echo, Sent, Verdict};

/// How this end presents itself and what it may do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MavlinkConfig {
    /// System number of the autopilot; frames of others are passed over.
    pub system: u8,
    /// Component number of the autopilot; `None`: the component whose heartbeat says that it is one.
    pub component: Option<u8>,
    /// Whether to arm it and to switch it to guided mode, once.
    pub arms: bool,
    /// Silence after which it counts as gone.
    pub silence: Duration,
}

/// The last heartbeat of the autopilot.
#[derive(Debug, Clone, Copy)]
struct Peer {
    component: u8,
    guided_mode: u32,
    custom_mode: u32,
    is_armed: bool,
    heard: Instant,
}

impl Peer {
    fn is_in_command(&self) -> bool {
        self.is_armed && self.custom_mode == self.guided_mode
    }
}

#[derive(Debug, Clone, Copy)]
struct Pose {
    /// North, east, down in its own frame, metres; `None` if it reports only global positions.
    local: Option<[f32; 3]>,
    place: Option<(i32, i32)>,
    depth_m: f64,
    /// East and north, metres a second.
    velocity: (f64, f64),
    time_boot_ms: u32,
    heard: Instant,
}

/// A state machine toward an autopilot of the ArduPilot family.
///
/// Its track is the sum of its velocities, not the difference of its positions: these jump when it uses a fix, and a fix
/// that this vehicle has used already must not count twice. A waypoint is kept as the distance that remains, and sent each
/// second in the autopilot's own frame, so that nothing depends on where that has its origin.
#[derive(Debug)]
pub struct Mavlink {
    config: MavlinkConfig,
    deframer: Deframer,
    sources: Sources,
    texts: Texts,
    seq: u8,
    began: Instant,
    reception: Reception,
    clock: BootClock,
    peer: Option<Peer>,
    pose: Option<Pose>,
    attitude: Attitude,
    altimeter: Altimeter,
    /// The distance that remains, east and north, and the depth; `None`: stay.
    goal: Option<Goal>,
    stay: Option<[f32; 3]>,
    sent: Option<Sent>,
    echo: Echo,
    /// Its place on the Earth, moved by its own track: latitude, longitude, standard deviation.
    place: Option<(LatLon, f32, Instant)>,
    command: CommandWatch,
    due: Due,
    outbox: Outbox,
    was_silent: bool,
    is_position_lost: bool,
}

#[derive(Debug, Clone, Copy)]
struct Due {
    second: Instant,
    gps: Instant,
    /// When the streams may be asked for again because no position or no target is reported.
    streams: Instant,
}

const SET_MODE: u16 = 176;
const ARM: u16 = 400;
const INTERVAL: u16 = 511;
/// Component of this end: MAV_COMP_ID_ONBOARD_COMPUTER.
const OWN_COMPONENT: u8 = 191;
/// Messages that the autopilot is asked for, and microseconds between two: attitude, local and global position, target in both,
/// navigation, and three for the height above the sea floor.
const STREAMS: [(f32, f32); 9] = [
    (30.0, 200_000.0),
    (32.0, 200_000.0),
    (33.0, 500_000.0),
    (85.0, 1_000_000.0),
    (87.0, 1_000_000.0),
    (62.0, 1_000_000.0),
    (132.0, 200_000.0),
    (173.0, 500_000.0),
    (141.0, 500_000.0),
];
/// Time between two requests for streams that do not come.
const STREAMS_PERIOD: Duration = Duration::from_secs(10);
/// Longest time between two positions that is bridged by the velocity.
const BRIDGED: Duration = Duration::from_secs(3);
/// GPS_INPUT goes out so often, as ArduPilot expects of a receiver.
const GPS_PERIOD: Duration = Duration::from_millis(200);
/// A global position is forwarded for this long.
const PLACE_LASTS: Duration = Duration::from_secs(5);

impl Mavlink {
    /// For an autopilot that was never received.
    pub fn new(config: MavlinkConfig, now: Instant) -> Self {
        Self {
            config,
            deframer: Deframer::default(),
            sources: Sources::default(),
            texts: Texts::default(),
            seq: 0,
            began: now,
            reception: Reception::default(),
            clock: BootClock::default(),
            peer: None,
            pose: None,
            attitude: Attitude::default(),
            altimeter: Altimeter::default(),
            goal: None,
            stay: None,
            sent: None,
            echo: Echo::default(),
            place: None,
            command: CommandWatch::default(),
            due: Due { second: now, gps: now, streams: now },
            outbox: Outbox::default(),
            was_silent: false,
            is_position_lost: false,
        }
    }

    fn say(&mut self, said: &Said, now: Instant) {
        let (id, extra) = said.id();
        let component = self.peer.map_or(1, |p| p.component);
        let time_ms = now.since(self.began).as_millis() as u32;
        let payload = said.payload(self.config.system, component, time_ms);
        let frame = Frame { system: self.config.system, component: OWN_COMPONENT, id, payload, is_signed: false };
        self.outbox.write(encode(&frame, self.seq, extra));
        self.seq = self.seq.wrapping_add(1);
    }

    fn handle_frame(&mut self, frame: &Frame, now: Instant) {
        let Some(heard) = Heard::read(frame.id, &frame.payload) else {
            self.outbox.count("unreadable");
            return;
        };
        if let Heard::Heartbeat { custom_mode, kind, autopilot, base_mode } = heard {
            return match self.claim(frame, kind, autopilot, now) {
                Claim::Autopilot => self.handle_heartbeat(frame, custom_mode, kind, base_mode, now),
                Claim::Passed(reason) => self.outbox.count(reason),
            };
        }
        if frame.system != self.config.system {
            return self.outbox.count(sources::OTHER_SYSTEMS);
        }
        // Cameras, gimbals and companion computers have clocks, attitudes and positions of their own.
        if self.peer.is_none_or(|peer| peer.component != frame.component) {
            return self.outbox.count(sources::OTHER_COMPONENTS);
        }
        self.outbox.count("messages");
        if self.is_of_other_vehicle(frame, &heard, now) {
            return self.outbox.count(sources::OTHER_VEHICLE);
        }
        match heard {
            Heard::Heartbeat { .. } | Heard::DistanceElsewhere => {}
            Heard::Attitude { roll, pitch, yaw } => self.attitude.handle([roll, pitch, yaw], now),
            Heard::DistanceDown(number, along_m) => {
                self.handle_beam(HeightSource::DistanceSensor(number), along_m, now);
            }
            Heard::Rangefinder(along_m) => self.handle_beam(HeightSource::Rangefinder, Some(along_m), now),
            Heard::Altitude(m) => self.altimeter.handle(HeightSource::Altitude, m.map(f64::from), now),
            Heard::LocalTarget(told) => self.handle_local_target(told, now),
            Heard::GlobalTarget(told) => self.handle_global_target(told, now),
            Heard::WaypointDistance(told_m) => self.handle_distance(told_m, now),
            Heard::Local { time_boot_ms, place, velocity: [north, east, _] } => {
                let velocity = (f64::from(east), f64::from(north));
                let was = self.pose.and_then(|p| p.place);
                let depth_m = f64::from(place[2]);
                let pose = Pose { local: Some(place), place: was, depth_m, velocity, time_boot_ms, heard: now };
                self.handle_pose(pose, true);
            }
            Heard::Global { time_boot_ms, lat, lon, relative_alt, velocity: [north, east, _], heading } => {
                if heading != u16::MAX {
                    self.attitude.handle_heading((f64::from(heading) / 100.0).to_radians(), now);
                }
                let velocity = (f64::from(east) / 100.0, f64::from(north) / 100.0);
                // Without a fix or an origin it has no place.
                if (lat, lon) == (0, 0) {
                    return self.outbox.count("null_islands");
                }
                let local = self.pose.filter(|p| now.since(p.heard) < BRIDGED).and_then(|p| p.local);
                let depth_m = -f64::from(relative_alt) / 1000.0;
                let pose = Pose { local, place: Some((lat, lon)), depth_m, velocity, time_boot_ms, heard: now };
                self.handle_pose(pose, local.is_none());
            }
            Heard::Ack { command, result } => {
                // In progress is no refusal.
                if !matches!(result, 0 | 5) {
                    self.outbox.count("commands_refused");
                    if command != INTERVAL {
                        self.note_rarely(format!("the autopilot refuses command {command}: result {result}"), now);
                    }
                }
            }
            Heard::Text { severity, text, part, is_end } if severity <= 4 => {
                for text in self.texts.join(part, text, is_end) {
                    self.note_rarely(format!("the autopilot says: {text}"), now);
                }
            }
            Heard::Text { .. } => {}
        }
    }

    /// Notes a text unless it was noted not long ago.
    fn note_rarely(&mut self, text: String, now: Instant) {
        match self.texts.is_news(&text, now) {
            true => self.outbox.note(text),
            false => self.outbox.count("texts_repeated"),
        }
    }

    /// Whether a heartbeat is that of the autopilot, and a note where people should know that it is not.
    fn claim(&mut self, frame: &Frame, kind: u8, autopilot: u8, now: Instant) -> Claim {
        let current = self.peer.filter(|peer| now.since(peer.heard) < self.config.silence).map(|peer| peer.component);
        let (claim, note) =
            self.sources.judge(&self.config, (frame.system, frame.component), (kind, autopilot), current);
        if let Some(note) = note {
            self.outbox.note(note);
        }
        claim
    }

    fn handle_heartbeat(&mut self, frame: &Frame, custom_mode: u32, kind: u8, base_mode: u8, now: Instant) {
        let component = frame.component;
        // GUIDED is 4 of ArduSub and ArduCopter, 15 of ArduRover, which drives boats too.
        let guided_mode = if matches!(kind, 10 | 11) { 15 } else { 4 };
        let peer = Peer { component, guided_mode, custom_mode, is_armed: base_mode & 128 != 0, heard: now };
        if self.peer.is_some_and(|before| before.component != component) {
            // Another autopilot, with a clock and a frame of its own.
            (self.peer, self.pose, self.stay, self.command) = (None, None, None, CommandWatch::default());
            self.clock = BootClock::default();
            self.echo.forget();
            self.altimeter.forget();
            self.outbox.forget_measured();
        }
        let is_new = self.peer.is_none_or(|p| now.since(p.heard) >= self.config.silence);
        let was_in_command = self.peer.is_some_and(|p| p.is_in_command());
        self.peer = Some(peer);
        if is_new {
            self.outbox.note(match frame.is_signed {
                false => "the autopilot answers",
                true => {
                    "the autopilot answers and signs its messages: those of this vehicle have no signature, so it may obey none of \
                     them; switch signing off for this link"
                }
            });
            self.was_silent = false;
            self.reception.handle_answer(now);
            self.ask_for_streams(now);
        }
        if self.command.handle_heartbeat(was_in_command, peer.is_in_command(), now) {
            self.outbox.note("the autopilot was taken out of guided mode or disarmed: waypoints wait until it is back");
        }
        if !peer.is_in_command() {
            self.echo.forget();
        }
    }

    /// Whether a message is of another vehicle with the same numbers, by its clock or while two clocks are heard.
    fn is_of_other_vehicle(&mut self, frame: &Frame, heard: &Heard, now: Instant) -> bool {
        let Some(ms) = boot_time_ms(frame.id, &frame.payload) else {
            let is_measured = matches!(heard, Heard::Rangefinder(_) | Heard::Altitude(_) | Heard::WaypointDistance(_));
            return is_measured && self.clock.is_contested(now);
        };
        let verdict = self.clock.handle(frame.id, ms, now);
        if verdict == BootTime::Restarted {
            self.handle_restart(ms, now);
        }
        if let Some(apart_s) = self.clock.poll_conflict_s() {
            let MavlinkConfig { system, .. } = self.config;
            let component = frame.component;
            self.outbox.note(format!(
                "two vehicles answer as system {system} component {component}, with clocks {apart_s} s apart: the first one is used; give each a system of its own (SYSID_THISMAV, or MAV_SYSID from ArduSub 4.7 on)"
            ));
        }
        verdict == BootTime::Foreign
    }

    fn handle_restart(&mut self, ms: u32, now: Instant) {
        self.command.handle_restart(ms, self.pose.map(|pose| pose.depth_m), now);
        self.outbox.count("restarts");
        self.outbox.note("the autopilot has restarted");
        self.echo.forget();
        self.altimeter.forget();
        self.outbox.forget_measured();
        self.stay = None;
        self.ask_for_streams(now);
    }

    /// A distance along a beam that is fixed to the vehicle and looks down.
    fn handle_beam(&mut self, source: HeightSource, along_m: Option<f32>, now: Instant) {
        let (roll, pitch) = self.attitude.tilt(now);
        let upright = roll.cos() * pitch.cos();
        self.altimeter.handle(source, along_m.map(|m| f64::from(m) * upright), now);
    }

    fn ask_for_streams(&mut self, now: Instant) {
        self.due.streams = now + STREAMS_PERIOD;
        for (id, interval_us) in STREAMS {
            self.say(&Said::Command { command: INTERVAL, params: [id, interval_us, 0.0] }, now);
        }
    }

    /// Takes a position; `counts` is whether its velocity is the one to add up.
    fn handle_pose(&mut self, pose: Pose, counts: bool) {
        let before = self.pose;
        if !counts {
            if let Some(mine) = &mut self.pose {
                mine.place = pose.place;
            }
            return;
        }
        let pose = Pose { velocity: self.outbox.plausible_velocity(pose.velocity, pose.heard), ..pose };
        self.pose = Some(pose);
        if let Some([north, east, _]) = pose.local {
            self.outbox.check_place((north.into(), east.into()), pose.heard);
        } else if let Some((lat, lon)) = pose.place {
            // Of a degree of latitude, everywhere long enough.
            let metres = |units: i32| f64::from(units) / 1e7 * 111_320.0;
            self.outbox.check_place((metres(lat), metres(lon)), pose.heard);
        }
        self.reception.handle_position();
        if std::mem::take(&mut self.is_position_lost) {
            self.outbox.note("the autopilot reports its position again");
        }
        let Some(before) = before else { return };
        let passed_ms = pose.time_boot_ms.wrapping_sub(before.time_boot_ms);
        // A clock that went back is another run of the autopilot.
        if passed_ms == 0 || u128::from(passed_ms) > BRIDGED.as_millis() {
            self.outbox.count("gaps");
            return self.push_step(0.0, 0.0, &pose, pose.heard.since(before.heard));
        }
        let passed_s = f64::from(passed_ms) / 1000.0;
        let mean = |a: f64, b: f64| (a + b) / 2.0 * passed_s;
        let (dx_m, dy_m) = (mean(before.velocity.0, pose.velocity.0), mean(before.velocity.1, pose.velocity.1));
        if dx_m.hypot(dy_m) > 20.0 * passed_s {
            self.outbox.count("absurd_velocities");
            return self.push_step(0.0, 0.0, &pose, Duration::from_secs_f64(passed_s));
        }
        if let Some(goal) = &mut self.goal {
            (goal.east_m, goal.north_m) = (goal.east_m - dx_m, goal.north_m - dy_m);
        }
        if let Some((place, ..)) = &mut self.place {
            *place = moved(*place, dx_m, dy_m);
        }
        self.push_step(dx_m, dy_m, &pose, Duration::ZERO);
    }

    fn push_step(&mut self, dx_m: f64, dy_m: f64, pose: &Pose, unseen: Duration) {
        let heading_rad = self.attitude.heading_rad(pose.heard);
        let (roll_rad, pitch_rad) = self.attitude.tilt(pose.heard);
        let altitude_m = self.altimeter.height_m(pose.heard);
        let depth_m = Some(pose.depth_m);
        let step = Step { dx_m, dy_m, heading_rad, depth_m, roll_rad, pitch_rad, altitude_m, unseen };
        self.outbox.walk_measured(step, pose.heard);
    }

    fn handle_second(&mut self, now: Instant) {
        self.say(&Said::Heartbeat, now);
        let health = self.health(now);
        if health == Health::Silent && !std::mem::replace(&mut self.was_silent, true) {
            self.outbox.count("silences");
            self.outbox.note("the autopilot does not answer any more");
        }
        let Some(peer) = self.peer.filter(|_| !health.is_silent()) else {
            let refused = self.deframer.refused();
            let note = self.reception.poll_silence(self.config.system, refused, now).filter(|_| self.peer.is_none());
            note.into_iter().for_each(|note| self.outbox.note(note));
            return self.echo.forget();
        };
        if self.pose.is_none_or(|p| now.since(p.heard) > BRIDGED) {
            if now >= self.due.streams {
                self.ask_for_streams(now);
            }
            if let Some(note) = self.reception.poll_no_position(now) {
                self.outbox.count("position_losses");
                self.outbox.note(note);
                self.is_position_lost = true;
            }
            if self.pose.is_some() && !std::mem::replace(&mut self.is_position_lost, true) {
                self.outbox.count("position_losses");
                self.outbox.note("the autopilot reports no position any more");
            }
            // Without a position no target goes out that it could follow.
            self.echo.forget();
        } else if self.attitude.is_missing(now) {
            if now >= self.due.streams {
                self.ask_for_streams(now);
            }
            if let Some(note) = self.attitude.poll_absence(now) {
                self.outbox.count("attitude_losses");
                self.outbox.note(note);
            }
        }
        if peer.is_in_command() {
            self.send_target(now);
            self.judge_echo(now);
        } else if self.config.arms && self.goal.is_some() && self.command.may_be_armed() {
            // MAV_MODE_FLAG_CUSTOM_MODE_ENABLED.
            let params = [1.0, peer.guided_mode as f32, 0.0];
            self.say(&Said::Command { command: SET_MODE, params }, now);
            self.say(&Said::Command { command: ARM, params: [1.0, 0.0, 0.0] }, now);
        }
    }

    fn judge_echo(&mut self, now: Instant) {
        if let Some(note) = self.echo.handle_timeout(now) {
            self.outbox.note(note);
        }
        match self.echo.verdict() {
            Verdict::Refuses => self.outbox.count("targets_refused"),
            Verdict::Mute => {
                self.outbox.count("targets_unconfirmed");
                if now >= self.due.streams {
                    self.ask_for_streams(now);
                }
            }
            Verdict::Open | Verdict::Follows => {}
        }
    }
}

fn units(place: LatLon) -> (i32, i32) {
    ((place.lat_deg * 1e7).round() as i32, (place.lon_deg * 1e7).round() as i32)
}

/// A place so many metres further.
fn moved(place: LatLon, east_m: f64, north_m: f64) -> LatLon {
    scenecast_core::TangentPlane::new(place).to_place(east_m, north_m)
}

impl Autopilot for Mavlink {
    fn handle_open(&mut self, now: Instant) {
        self.deframer.clear();
        self.reception.handle_open();
        self.echo.forget();
        self.due = Due { second: now, gps: now, streams: now };
    }

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant) -> bool {
        let mut frames = Vec::new();
        self.reception.handle_bytes(bytes.len(), now);
        self.deframer.push(bytes, heard_extra, |frame| frames.push(frame));
        frames.iter().for_each(|frame| self.handle_frame(frame, now));
        let is_heard = |peer: Peer| {
            let is_its = |frame: &Frame| frame.system == self.config.system && frame.component == peer.component;
            peer.heard == now && frames.iter().any(|frame| frame.id == message::HEARTBEAT && is_its(frame))
        };
        self.peer.is_some_and(is_heard)
    }

    fn handle_timeout(&mut self, now: Instant) {
        if now >= self.due.second {
            self.due.second = now + Duration::from_secs(1);
            self.handle_second(now);
        }
        if now >= self.due.gps {
            self.due.gps = now + GPS_PERIOD;
            let fresh = self.place.filter(|(_, _, at)| now.since(*at) < PLACE_LASTS);
            if let Some((place, sigma_m, _)) = fresh.filter(|_| !self.health(now).is_silent()) {
                let (lat, lon) = units(place);
                self.outbox.count("gps_inputs");
                self.say(&Said::Gps { lat, lon, sigma_m }, now);
            }
        }
    }

    fn poll_timeout(&self) -> Instant {
        if self.place.is_some() { self.due.second.min(self.due.gps) } else { self.due.second }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn set_goal(&mut self, goal: Option<Goal>, _now: Instant) {
        self.goal = goal.filter(Goal::is_finite);
    }

    fn handle_place(&mut self, place: LatLon, sigma_m: f64, now: Instant) {
        self.place = Some((place, sigma_m as f32, now));
    }

    fn health(&self, now: Instant) -> Health {
        match self.peer {
            None => Health::Awaited,
            Some(peer) if now.since(peer.heard) >= self.config.silence => Health::Silent,
            Some(peer) if peer.is_in_command() && !self.is_position_lost && self.echo.verdict() != Verdict::Refuses => {
                Health::InCommand
            }
            Some(_) => Health::NotInCommand,
        }
    }

    fn counters(&self) -> Counters {
        let refused = self.deframer.refused();
        let mut counters = self.outbox.counters.clone();
        let more = [
            ("checksum", refused.checksum),
            ("incompatible", refused.incompatible),
            ("garbage_bytes", refused.garbage),
        ];
        counters.extend(more.into_iter().filter(|(_, n)| *n > 0));
        counters
    }
}

#[cfg(test)]
mod tests;
