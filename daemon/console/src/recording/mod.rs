//! The records of both ends of a mission, on the clock of the surface.

mod map;

pub(crate) use map::ShownMap;

pub use map::layer_text;
use map::{MapHistory, layer_of_text};
use scenecast_core::UserError;
use scenecast_files::{
    FrameTimes, MissionClock, MissionSpeed, RecordedMessage, StateTime, mission_records, read_record,
};
use scenecast_messages::builtin_interfaces::Time;
use scenecast_messages::contents::valid_part;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Frame, Link, Order, OrderStatus};
use scenecast_messages::std_msgs::Text;
use scenecast_protocol::time::Instant;
use scenecast_surface::FloorPlace;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What the records of a mission say, by the nanoseconds since 1970 of the surface's clock.
#[derive(Debug, Default)]
pub struct Recording {
    pub(crate) timeline: Timeline,
    /// What the operator knew of each vehicle, by the part of its topics.
    pub(crate) operator: BTreeMap<String, Known>,
    /// What each vehicle knew, from its own records, by the part of its topics.
    pub(crate) vehicles: BTreeMap<String, Known>,
    /// The entries of the surface's log with the times at which they were recorded.
    pub(crate) log: Vec<(u64, Event)>,
    /// How many frames the surface sent, received and dropped, over all its records.
    pub(crate) frames: FrameCounts,
    /// What the surface ran with, as JSON.
    pub(crate) settings: String,
    /// Why some of the records could not be read.
    pub damage: Vec<String>,
}

/// The states that the page showed, and the mission times that they tell.
#[derive(Debug, Default)]
pub(crate) struct Timeline {
    /// The times of the first and the last message of all records.
    pub(crate) span: (u64, u64),
    pub(crate) clock: MissionClock,
    pub(crate) states: Vec<StateText>,
}

/// A state that the page showed.
#[derive(Debug)]
pub(crate) struct StateText {
    pub(crate) nanos: u64,
    pub(crate) json: String,
    pub(crate) head: StateHead,
}

/// The time of a state, and what the time line needs of it.
#[derive(Debug, Deserialize)]
pub(crate) struct StateHead {
    now_s: f64,
    mission: MissionHead,
    #[serde(default)]
    link: LinkHead,
    pub(crate) vehicles: Vec<Loops>,
}

/// The numbers of frames in both directions, which begin again with each process of the surface.
#[derive(Debug, Default, Deserialize)]
struct LinkHead {
    up: FrameCount,
    down: FrameCount,
}

#[derive(Debug, Default, Deserialize)]
struct FrameCount {
    frames: u64,
}

#[derive(Debug, Deserialize)]
struct MissionHead {
    #[serde(default)]
    id: String,
    #[serde(flatten)]
    speed: MissionSpeed,
}

/// The loops that a vehicle has closed.
#[derive(Debug, Deserialize)]
pub(crate) struct Loops {
    pub(crate) id: u8,
    pub(crate) name: String,
    pub(crate) registration: Option<Closed>,
}

#[derive(Debug, Deserialize)]
pub(crate) struct Closed {
    pub(crate) closed: u16,
}

/// How many frames an end has sent, and what became of those that it heard.
#[derive(Debug, Clone, Default)]
pub(crate) struct FrameCounts {
    /// Frames that were sent, copies of earlier ones included.
    pub(crate) sent: u64,
    pub(crate) received: u64,
    /// By the reason for which they were dropped.
    pub(crate) dropped: BTreeMap<String, u64>,
}

impl FrameCounts {
    pub(crate) fn unused(&self) -> u64 {
        self.dropped.values().sum()
    }

    pub(crate) fn heard(&self) -> u64 {
        self.received + self.unused()
    }

    fn take(&mut self, frame: &Frame) {
        match frame.direction {
            Frame::SENT => self.sent += 1,
            Frame::RECEIVED => self.received += 1,
            Frame::DROPPED => *self.dropped.entry(frame.reason.clone()).or_default() += 1,
            _ => {}
        }
    }

    fn add(&mut self, other: &Self) {
        (self.sent, self.received) = (self.sent + other.sent, self.received + other.received);
        other.dropped.iter().for_each(|(reason, count)| *self.dropped.entry(reason.clone()).or_default() += count);
    }
}

/// What one end knew of a vehicle.
#[derive(Debug, Default)]
pub(crate) struct Known {
    /// The name for people; empty where no message has it.
    pub(crate) name: String,
    pub(crate) map: MapHistory,
    pub(crate) exemplars: Vec<(u64, Exemplar)>,
    /// Views of the sea floor in the frame of the map.
    pub(crate) floor: Vec<(u64, Exemplar)>,
    /// When each frame came in: at a surface of those of the vehicle, at a vehicle of those of the surface.
    pub(crate) heard: Vec<u64>,
    pub(crate) poses: Vec<(u64, PoseWithCovarianceStamped)>,
    /// What the vehicle says of itself.
    pub(crate) events: Vec<(u64, Event)>,
    /// Orders as they were given, and how far each had come.
    pub(crate) given: Vec<Order>,
    pub(crate) orders: Vec<OrderStatus>,
    pub(crate) link: Vec<(u64, Link)>,
    /// Frames of the end of this record.
    pub(crate) frames: FrameCounts,
    /// The bits of what they carried first, by its name.
    pub(crate) sent_bits: BTreeMap<String, u64>,
    /// Begin and end of each record.
    pub(crate) runs: Vec<(u64, u64)>,
    /// What this end ran with, as JSON.
    pub(crate) settings: String,
}

/// One record of a surface or of a vehicle, on the clock of the end that made it.
#[derive(Default)]
struct Record {
    path: PathBuf,
    states: Vec<StateText>,
    clock: MissionClock,
    known: BTreeMap<String, Known>,
    log: Vec<(u64, Event)>,
    settings: String,
    counts: FrameCounts,
    sent_bits: BTreeMap<String, u64>,
    frames: FrameTimes,
    span: Option<(u64, u64)>,
}

impl Recording {
    /// Reads records of a surface, of vehicles, or of both: files, their folders, or folders with such folders.
    ///
    /// # Errors
    /// There is no record, it has no message of an end, or two of them are of different missions.
    pub fn read(paths: &[PathBuf]) -> Result<Self, UserError> {
        let mut whole = Self::default();
        let (mut surfaces, mut vehicles) = (Vec::new(), Vec::new());
        let paths = paths.iter().map(|path| mission_records(path)).collect::<Result<Vec<_>, _>>()?.concat();
        for path in &paths {
            let record = Record::read(path, &mut whole.damage)?;
            if record.span.is_none() || record.states.is_empty() && record.known.is_empty() {
                return Err(UserError::file(path, "it is no record of a mission: it has no topic of scenecast"));
            }
            if record.states.is_empty() { &mut vehicles } else { &mut surfaces }.push(record);
        }
        of_one_mission(&surfaces, &vehicles)?;
        let mut span = (u64::MAX, 0);
        let frames = FrameTimes::joined(surfaces.iter().map(|surface| &surface.frames));
        surfaces.sort_by_key(|record| record.span);
        for surface in surfaces {
            span = joined(span, surface.span, 0);
            whole.timeline.states.extend(surface.states);
            whole.timeline.clock.add(&surface.clock);
            whole.log.extend(surface.log);
            whole.frames.add(&surface.counts);
            whole.settings = surface.settings;
            surface.known.into_iter().for_each(|(part, known)| whole.operator.entry(part).or_default().add(known, 0));
        }
        vehicles.sort_by_key(|record| record.span);
        for vehicle in vehicles {
            let shift = vehicle.frames.shift_to(&frames);
            let runs: Vec<_> = vehicle.span.into_iter().collect();
            span = joined(span, vehicle.span, shift);
            vehicle.known.into_iter().for_each(|(part, known)| {
                whole.vehicles.entry(part).or_default().add(
                    Known {
                        frames: vehicle.counts.clone(),
                        sent_bits: vehicle.sent_bits.clone(),
                        settings: vehicle.settings.clone(),
                        runs: runs.clone(),
                        ..known
                    },
                    shift,
                )
            });
        }
        whole.join_names();
        // Before the first state the page would show nothing.
        whole.timeline.span = (whole.timeline.states.first().map_or(span.0, |first| first.nanos), span.1);
        Ok(whole)
    }

    /// Takes the only vehicle that the surface knew by another name than it has itself for one of two names.
    fn join_names(&mut self) {
        let only = |here: &BTreeMap<String, Known>, there: &BTreeMap<String, Known>| {
            let mut names = here.keys().filter(|name| !there.contains_key(*name));
            names.next().filter(|_| names.next().is_none()).cloned()
        };
        let names = only(&self.vehicles, &self.operator).zip(only(&self.operator, &self.vehicles));
        if let Some((own, shown)) = names
            && let Some(known) = self.vehicles.remove(&own)
        {
            self.vehicles.insert(shown, known);
        }
    }
}

impl Timeline {
    /// The mission time at a moment, seconds.
    pub(crate) fn mission_s(&self, nanos: u64) -> f64 {
        // Without a surface the record has no other time than its own.
        self.clock.mission_s(nanos).unwrap_or_else(|| nanos.saturating_sub(self.span.0) as f64 / 1e9)
    }

    /// The same as a moment.
    pub(crate) fn mission_time(&self, nanos: u64) -> Instant {
        Instant::from_secs_f64(self.mission_s(nanos))
    }

    /// The last state of each process of the surface but the last, and the first one of the next.
    pub(crate) fn restarts(&self) -> impl Iterator<Item = (&StateText, &StateText)> {
        let pairs = self.states.iter().zip(self.states.iter().skip(1));
        pairs.filter(|(a, b)| {
            let (a, b) = (&a.head.link, &b.head.link);
            b.up.frames < a.up.frames || b.down.frames < a.down.frames
        })
    }

    /// The last state up to a moment.
    pub(crate) fn state_at(&self, nanos: u64) -> Option<&StateText> {
        let next = self.states.partition_point(|state| state.nanos <= nanos);
        self.states.get(next.checked_sub(1)?)
    }
}

/// Labels and clocks of two missions have nothing to do with each other, so records of two are refused by name.
fn of_one_mission(surfaces: &[Record], vehicles: &[Record]) -> Result<(), UserError> {
    let Some(first) = surfaces.first() else { return Ok(()) };
    let refused = |other: &Record, why: &str| {
        let (a, b) = (first.path.display(), other.path.display());
        Err(UserError::Input(format!("{a} and {b} are records of two missions: {why}; give those of one")))
    };
    if let Some(other) = surfaces.iter().find(|other| other.mission() != first.mission()) {
        return refused(other, &format!("the surface names them {} and {}", first.mission(), other.mission()));
    }
    let is_apart = |vehicle: &&Record| {
        let meets = |surface: &Record| vehicle.frames.meets(&surface.frames) || vehicle.overlaps(surface);
        !surfaces.iter().any(meets)
    };
    match vehicles.iter().find(is_apart) {
        Some(vehicle) => refused(vehicle, "they have no frame in common, and their times do not overlap"),
        None => Ok(()),
    }
}

fn joined(span: (u64, u64), with: Option<(u64, u64)>, shift: i64) -> (u64, u64) {
    let Some((first, last)) = with else { return span };
    (span.0.min(first.saturating_add_signed(shift)), span.1.max(last.saturating_add_signed(shift)))
}

impl Record {
    fn read(path: &Path, damage: &mut Vec<String>) -> Result<Self, UserError> {
        let mut record = Self { path: path.to_owned(), ..Self::default() };
        let found = read_record(path, |message| record.take(&message))?;
        let name = path.file_name().unwrap_or_default().display();
        damage.extend(found.map(|found| format!("{name}: {found}")));
        Ok(record)
    }

    /// The mission, as the surface names it.
    fn mission(&self) -> &str {
        self.states.last().map_or("", |state| &state.head.mission.id)
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.span.zip(other.span).is_some_and(|(own, other)| own.0 <= other.1 && other.0 <= own.1)
    }

    fn take(&mut self, message: &RecordedMessage) {
        let nanos = message.nanos();
        let Some(topic) = message.topic().strip_prefix("/scenecast/") else { return };
        let (first, last) = self.span.unwrap_or((nanos, nanos));
        self.span = Some((first.min(nanos), last.max(nanos)));
        let Some((part, topic)) = topic.split_once('/') else { return self.take_common(topic, nanos, message) };
        let known = self.known.entry(part.to_owned()).or_default();
        match topic {
            "map_cells" => message.decode().into_iter().for_each(|cells| known.map.take(nanos, cells)),
            "layers" => {
                let descriptor = message.decode::<Text>().and_then(|text| layer_of_text(&text.data));
                descriptor.into_iter().for_each(|descriptor| known.map.describe(descriptor));
            }
            "exemplars" => known.exemplars.extend(message.decode().map(|exemplar| (nanos, exemplar))),
            "floor" => known.floor.extend(message.decode().map(|view| (nanos, view))),
            "orders" => known.given.extend(message.decode::<Order>()),
            "order_status" => known.orders.extend(message.decode::<OrderStatus>()),
            "link" => known.link.extend(message.decode().map(|link| (nanos, link))),
            "pose" => known.poses.extend(message.decode().map(|pose| (nanos, pose))),
            "events" => {
                let event: Option<Event> = message.decode();
                if let Some(event) = &event {
                    known.name.clone_from(&event.vehicle);
                }
                known.events.extend(event.map(|event| (nanos, event)));
            }
            _ => {}
        }
    }

    fn take_common(&mut self, topic: &str, nanos: u64, message: &RecordedMessage) {
        match topic {
            "state" => {
                let Some(text) = message.decode::<Text>() else { return };
                if let Ok(head) = serde_json::from_str::<StateHead>(&text.data) {
                    self.clock.take(nanos, StateTime { now_s: head.now_s, mission: head.mission.speed });
                    self.states.push(StateText { nanos, json: text.data, head });
                }
            }
            "settings" => self.settings = message.decode::<Text>().map_or_else(String::new, |text| text.data),
            "events" => self.log.extend(message.decode().map(|event| (nanos, event))),
            "frames" => {
                let Some(frame) = message.decode::<Frame>() else { return };
                self.frames.take(nanos, &frame);
                self.counts.take(&frame);
                if frame.direction == Frame::SENT {
                    for (content, bits) in frame.contents.iter().zip(&frame.content_bits) {
                        *self.sent_bits.entry(content.clone()).or_default() += u64::from(*bits);
                    }
                }
                if frame.direction == Frame::RECEIVED && !frame.vehicle.is_empty() {
                    self.known.entry(valid_part(&frame.vehicle)).or_default().heard.push(nanos);
                }
            }
            _ => {}
        }
    }
}

impl Known {
    /// The views of the sea floor on its map that had come in by a moment, the latest of each place, with the times at which they did.
    pub(crate) fn floor_until(&self, nanos: u64) -> BTreeMap<FloorPlace, (u64, &Exemplar)> {
        let epoch = u32::from(self.map.shown().epoch);
        let so_far = self.floor.iter().take_while(|(at, _)| *at <= nanos).filter(|(_, view)| view.epoch == epoch);
        let dm = |m: f64| (m * 10.0).round() as i32;
        so_far.map(|(at, view)| ((dm(view.middle.x), dm(view.middle.y)), (*at, view))).collect()
    }

    /// Adds what a later record knew, by a clock that is to be shifted by `shift` nanoseconds.
    fn add(&mut self, later: Self, shift: i64) {
        let moved = |nanos: u64| nanos.saturating_add_signed(shift);
        if !later.name.is_empty() {
            self.name = later.name;
        }
        self.map.add(later.map, moved);
        self.exemplars.extend(later.exemplars.into_iter().map(|(at, exemplar)| (moved(at), exemplar)));
        self.floor.extend(later.floor.into_iter().map(|(at, view)| (moved(at), view)));
        self.heard.extend(later.heard.into_iter().map(moved));
        self.frames.add(&later.frames);
        later.sent_bits.into_iter().for_each(|(content, bits)| *self.sent_bits.entry(content).or_default() += bits);
        self.runs.extend(later.runs.into_iter().map(|(from, to)| (moved(from), moved(to))));
        if !later.settings.is_empty() {
            self.settings = later.settings;
        }
        self.given.extend(later.given);
        self.orders.extend(later.orders.into_iter().map(|mut order| {
            let stamp = &mut order.header.stamp;
            *stamp = Time::from_nanos(stamp.nanos().saturating_add(shift));
            order
        }));
        self.link.extend(later.link.into_iter().map(|(at, link)| (moved(at), link)));
        self.poses.extend(later.poses.into_iter().map(|(at, pose)| (moved(at), pose)));
        self.events.extend(later.events.into_iter().map(|(at, event)| (moved(at), event)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(path: &str, mission: Option<&str>, span: (u64, u64)) -> Record {
        let head =
            |id: &str| serde_json::json!({ "now_s": 1.0, "mission": { "id": id, "speed": 1.0 }, "vehicles": [] });
        let state = |id: &str| {
            let head = serde_json::from_value(head(id)).expect("the head of a state");
            StateText { nanos: span.0, json: String::new(), head }
        };
        Record {
            path: path.into(),
            states: mission.map(state).into_iter().collect(),
            span: Some(span),
            ..Record::default()
        }
    }

    fn refusal(surfaces: &[Record], vehicles: &[Record]) -> Option<String> {
        of_one_mission(surfaces, vehicles).err().map(|error| error.to_string())
    }

    #[test]
    fn the_only_vehicle_is_one_under_two_names() {
        let known = |names: &[&str]| names.iter().map(|name| ((*name).to_owned(), Known::default())).collect();
        let joined = |surface: &[&str], own: &[&str]| {
            let mut both = Recording { operator: known(surface), vehicles: known(own), ..Recording::default() };
            both.join_names();
            both.vehicles.into_keys().collect::<Vec<_>>()
        };
        assert_eq!(joined(&["vehicle_1"], &["glider"]), ["vehicle_1"]);
        assert_eq!(joined(&["auv_1", "vehicle_2"], &["auv_1", "glider"]), ["auv_1", "vehicle_2"]);
        assert_eq!(joined(&["vehicle_1", "vehicle_2"], &["glider"]), ["glider"], "it may be either");
        assert_eq!(joined(&[], &["glider"]), ["glider"]);
    }

    #[test]
    fn records_of_two_missions_are_refused_by_name() {
        let first = || record("ship", Some("0a"), (100, 200));
        assert_eq!(
            refusal(&[first(), record("boat", Some("0a"), (300, 400))], &[record("auv", None, (350, 360))]),
            None
        );
        let two = refusal(&[first(), record("boat", Some("0b"), (100, 200))], &[]).expect("they are of two missions");
        assert!(["ship", "boat", "0a", "0b"].iter().all(|word| two.contains(word)), "{two}");
        let later = refusal(&[first()], &[record("auv", None, (201, 300))]).expect("they have nothing in common");
        assert!(later.contains("ship and auv") && later.contains("no frame"), "{later}");
        assert_eq!(refusal(&[], &[record("auv", None, (201, 300))]), None);
    }
}
