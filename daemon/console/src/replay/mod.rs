//! The replay of a mission from its records: the state that the page shows at any moment of it, as each side knew it.

mod events;
mod floor;
mod on_board;

use crate::recording::{Known, Recording};
use crate::report::{Dive, HTML};
use scenecast_messages::contents::{Stamps, valid_part};
use scenecast_messages::scenecast_msgs::Event;
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::wire::Address;
use scenecast_surface::state::{
    CellHistory, DifferingCells, MissionState, ReplayEvent, ReplayEventList, ReplayOrder, ReplaySide, ReplayState,
    VehicleState,
};
use scenecast_surface::{ClientRequest, LogEntry, LogKind, MapCells, Reply, Snapshot, SurfaceRequest};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::time::Duration;

/// Why the replay is not changed; as text one line for the operator.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
enum ReplayRefusal {
    #[error("at_utc_s {0}: it takes seconds since 1970")]
    Time(f64),
    #[error("speed {speed}: the range is {} to {}", Replay::SPEEDS.start(), Replay::SPEEDS.end())]
    Speed { speed: f64 },
    #[error("side {0:?}: the record of the other end is missing")]
    Side(ReplaySide),
}

/// A mission that is played from its records.
#[derive(Debug)]
pub struct Replay {
    recording: Recording,
    events: Vec<ReplayEvent>,
    /// The part of the topics of each vehicle, by its address.
    parts: BTreeMap<u8, String>,
    /// The moment that is shown, nanoseconds since 1970.
    at: u64,
    /// The times of day of the mission.
    stamps: Stamps,
    is_playing: bool,
    speed: f64,
    side: ReplaySide,
    /// The state of the last moment, before it was completed, with the time of its record.
    state: (u64, MissionState),
    /// The maps of the vehicles at that moment.
    shown: BTreeMap<u8, ShownVehicle>,
}

/// The map of a vehicle that is shown.
#[derive(Debug, Default)]
struct ShownVehicle {
    /// The side, and the places in the histories of both.
    of: Option<(ReplaySide, [usize; 2])>,
    /// Each other map that is shown has a higher version.
    version: u64,
    /// The cells in which both sides differ; empty where only one is known.
    difference: LabelGrid,
}

impl Replay {
    /// Recorded seconds for each second.
    pub const SPEEDS: RangeInclusive<f64> = 0.1..=1000.0;

    /// Plays records from their beginning, once it is ordered to.
    pub fn new(recording: Recording, speed: f64) -> Self {
        let parts = addresses(&recording);
        let events = events::events(&recording, |part| address(&parts, part));
        let side = if recording.timeline.states.is_empty() { ReplaySide::Vehicle } else { ReplaySide::Operator };
        let at = recording.timeline.span.0;
        let (state, shown) = ((u64::MAX, MissionState::default()), BTreeMap::new());
        let mut stamps = Stamps::with_speed(1.0);
        recording.timeline.clock.moments().for_each(|(now_s, nanos)| stamps.observe(now_s, nanos as i64));
        let mut replay = Self { recording, events, parts, at, stamps, is_playing: false, speed, side, state, shown };
        replay.show();
        replay
    }

    /// Why some of the records could not be read.
    pub fn damage(&self) -> &[String] {
        &self.recording.damage
    }

    /// Moves on by a time of the clock, if the record is played. Whether the moment has changed.
    pub fn advance(&mut self, passed: Duration) -> bool {
        if !self.is_playing {
            return false;
        }
        let nanos = passed.as_secs_f64() * self.speed * 1e9;
        self.at = self.at.saturating_add(nanos as u64).min(self.recording.timeline.span.1);
        self.is_playing = self.at < self.recording.timeline.span.1;
        self.show();
        true
    }

    /// Brings the maps to the moment and the side that are shown.
    fn show(&mut self) {
        let Recording { timeline, operator, vehicles, .. } = &mut self.recording;
        for known in operator.values_mut().chain(vehicles.values_mut()) {
            known.map.seek(self.at, |nanos| timeline.mission_time(nanos));
        }
        for (&id, part) in &self.parts {
            let both = [operator.get(part), vehicles.get(part)];
            let places = both.map(|known| known.map_or(0, |known| known.map.place()));
            let shown = self.shown.entry(id).or_default();
            let before = shown.of.replace((self.side, places));
            if before == shown.of {
                continue;
            }
            shown.version += 1;
            if let [Some(operator), Some(vehicle)] = both
                && before.is_none_or(|(_, before)| before != places)
            {
                shown.difference = vehicle.map.shown().difference(operator.map.shown());
            }
        }
    }

    /// The state at the moment that is shown.
    pub fn snapshot(&mut self) -> Snapshot {
        let mission_s = self.recording.timeline.mission_s(self.at);
        let mut state = self.recorded_state();
        let mission_speed = state.mission.speed.max(1e-3);
        state.mission.speed = if self.is_playing { mission_speed * self.speed } else { 0.0 };
        (state.now_s, state.utc_s) = (mission_s, Some(self.at as f64 / 1e9));
        // The picture of the true classes is in no record.
        state.truth = None;
        state.log = self.logged() as u64;
        for (&id, part) in &self.parts {
            if state.vehicles.iter().all(|vehicle| vehicle.id != id) && self.recording.vehicles.contains_key(part) {
                let name = self.recording.vehicles.get(part).map_or(part, |known| &known.name).clone();
                // A vehicle knows of itself at any time.
                let expected_interval_s = 60.0;
                state.vehicles.push(VehicleState { id, name, expected_interval_s, ..VehicleState::default() });
            }
        }
        for vehicle in &mut state.vehicles {
            self.complete(vehicle);
        }
        state.replay = Some(ReplayState { mission_speed, ..self.replay_state() });
        Snapshot::new(state, None, self.stamps.seen_at(mission_s, self.at as i64))
    }

    /// The last state that was recorded up to the moment that is shown; an empty one before the first.
    fn recorded_state(&mut self) -> MissionState {
        let Some(text) = self.recording.timeline.state_at(self.at) else {
            let mut state = MissionState::default();
            state.mission.speed = self.recording.timeline.clock.speed(self.at);
            return state;
        };
        if self.state.0 != text.nanos {
            let state = serde_json::from_str(&text.json).unwrap_or_default();
            self.state = (text.nanos, state);
        }
        self.state.1.clone()
    }

    /// Brings the state of a vehicle from the last recorded one to the present moment.
    fn complete(&self, vehicle: &mut VehicleState) {
        let part = valid_part(&vehicle.name);
        let maps = self.shown.get(&vehicle.id);
        vehicle.map.version = maps.map_or(0, |maps| maps.version);
        // It is the map of the run that was recorded.
        vehicle.map.earlier = None;
        if let Some(heard) = self.recording.operator.get(&part).and_then(|known| last_upto(&known.heard, self.at)) {
            let heard_s = self.recording.timeline.mission_s(heard);
            vehicle.last_received_s = Some(vehicle.last_received_s.map_or(heard_s, |before| before.max(heard_s)));
        }
        let Some(shown) = self.known(&part).map(|known| known.map.shown()) else { return };
        if shown.cell_m > 0.0 {
            (vehicle.map.cell_m, vehicle.map.epoch) = (shown.cell_m, shown.epoch);
        }
        vehicle.map.updated_s = shown.labels.updated().map(|at| at.as_secs_f64());
        let (bounds, counts) = match maps {
            Some(ShownVehicle { difference: cells, .. }) if self.side == ReplaySide::Difference => {
                let mut counts = BTreeMap::new();
                cells.iter().for_each(|(_, label)| *counts.entry(label).or_default() += 1);
                (cells.bounds(), counts)
            }
            _ => (shown.bounds(), shown.counts().collect()),
        };
        let map = &mut vehicle.map;
        (map.x0, map.y0) = bounds.map_or((0, 0), |b| (b.x, b.y));
        (map.width, map.height) = bounds.map_or((0, 0), |b| (b.width, b.height));
        on_board::recount(vehicle, &counts);
        if let Some(known) = self.recording.vehicles.get(&part).filter(|_| self.side == ReplaySide::Vehicle) {
            on_board::show(vehicle, known, self.at, |nanos| self.recording.timeline.mission_s(nanos));
        }
    }

    /// What the side that is shown knew of a vehicle; the operator for a difference.
    fn known(&self, part: &str) -> Option<&Known> {
        match self.side {
            ReplaySide::Vehicle => self.recording.vehicles.get(part),
            ReplaySide::Operator | ReplaySide::Difference => self.recording.operator.get(part),
        }
    }

    fn sides(&self) -> Vec<ReplaySide> {
        match (self.recording.timeline.states.is_empty(), self.recording.vehicles.is_empty()) {
            (true, _) => vec![ReplaySide::Vehicle],
            (false, true) => vec![ReplaySide::Operator],
            (false, false) => vec![ReplaySide::Operator, ReplaySide::Vehicle, ReplaySide::Difference],
        }
    }

    fn replay_state(&self) -> ReplayState {
        let utc_s = |nanos: u64| nanos as f64 / 1e9;
        let known_twice = self.parts.iter().filter(|(_, part)| {
            self.recording.vehicles.contains_key(*part) && self.recording.operator.contains_key(*part)
        });
        let cells = |id| self.shown.get(id).map_or(0, |shown| shown.difference.explored() as u32);
        let differing = known_twice.map(|(id, _)| DifferingCells { vehicle: *id, cells: cells(id) }).collect();
        ReplayState {
            from_utc_s: utc_s(self.recording.timeline.span.0),
            to_utc_s: utc_s(self.recording.timeline.span.1),
            at_utc_s: utc_s(self.at),
            is_playing: self.is_playing,
            speed: self.speed,
            mission_speed: 1.0,
            side: self.side,
            sides: self.sides(),
            differing_cells: differing,
            damage: self.recording.damage.clone(),
        }
    }

    /// Answers a reading from the record, or changes what is shown. A record takes no orders.
    pub fn handle_request(&mut self, request: ClientRequest) -> Reply {
        self.reply(request.request).unwrap_or(Reply::NotFound)
    }

    fn reply(&mut self, request: SurfaceRequest) -> Option<Reply> {
        let part = |id: u8| self.parts.get(&id).map(String::as_str);
        Some(match request {
            SurfaceRequest::Replay(order) => match self.change(&order) {
                Ok(()) => Reply::Replay(Box::new(self.replay_state())),
                Err(refusal) => Reply::Refused(refusal.to_string()),
            },
            SurfaceRequest::ReplayEvents => Reply::ReplayEvents(ReplayEventList { events: self.events.clone() }),
            SurfaceRequest::Report => self.report(),
            SurfaceRequest::Map(id) => Reply::Map(self.map(id, part(id)?)?),
            SurfaceRequest::FormerLabels(id, cell) => {
                let known = self.known(part(id)?)?;
                let former = known.map.former_labels(cell, |nanos| self.recording.timeline.mission_s(nanos));
                Reply::FormerLabels(CellHistory { former })
            }
            SurfaceRequest::Exemplar(id, label, number) => {
                let bytes = self.exemplar(part(id)?, label, number)?;
                Reply::File("image/webp", bytes)
            }
            SurfaceRequest::Floor(id, since) => Reply::Floor(self.floor(id, part(id)?, since)),
            SurfaceRequest::FloorImage(id, place) => {
                Reply::File("image/webp", self.floor_image(part(id)?, place)?.data.clone())
            }
            SurfaceRequest::Log => Reply::Log(self.log()),
            SurfaceRequest::Archives => Reply::Archives(Vec::new()),
            SurfaceRequest::ArchivedMap(_) => return None,
            _ => Reply::Refused("this is a record: it takes no orders".to_owned()),
        })
    }

    fn change(&mut self, order: &ReplayOrder) -> Result<(), ReplayRefusal> {
        let (from, to) = self.recording.timeline.span;
        if let Some(at_s) = order.at_utc_s.filter(|at_s| !at_s.is_finite()) {
            return Err(ReplayRefusal::Time(at_s));
        }
        if let Some(speed) = order.speed.filter(|speed| !Self::SPEEDS.contains(speed)) {
            return Err(ReplayRefusal::Speed { speed });
        }
        if let Some(side) = order.side.filter(|side| !self.sides().contains(side)) {
            return Err(ReplayRefusal::Side(side));
        }
        // A float holds the nanoseconds of today to a quarter of a microsecond.
        self.at = order.at_utc_s.map_or(self.at, |at_s| ((at_s.max(0.0) * 1e9) as u64).clamp(from, to));
        self.speed = order.speed.unwrap_or(self.speed);
        self.side = order.side.unwrap_or(self.side);
        self.is_playing = order.is_playing.unwrap_or(self.is_playing);
        if order.is_playing == Some(true) && self.at >= to {
            self.at = from;
        }
        self.show();
        Ok(())
    }

    /// The report of the whole record.
    fn report(&mut self) -> Reply {
        let dive = Dive::of(&mut self.recording);
        // The maps are at the end now.
        self.show();
        match dive {
            Ok(dive) => Reply::File(HTML, dive.html().into_bytes()),
            Err(error) => Reply::Refused(error.to_string()),
        }
    }

    fn map(&self, id: u8, part: &str) -> Option<MapCells> {
        let ShownVehicle { version, difference, .. } = self.shown.get(&id)?;
        let (version, at) = (*version, self.recording.timeline.mission_time(self.at));
        let shown = self.known(part)?.map.shown();
        if self.side == ReplaySide::Difference {
            let cells = MapCells::of_labels(difference, shown.cell_m);
            return Some(MapCells { version, at, ..cells });
        }
        Some(shown.cells(version, at))
    }

    /// The WebP of an image that the operator had of a label: that with a number, or the latest.
    fn exemplar(&self, part: &str, label: u8, number: Option<u8>) -> Option<Vec<u8>> {
        let known = self.recording.operator.get(part)?;
        let epoch = u32::from(known.map.shown().epoch);
        let upto = known.exemplars.partition_point(|(at, _)| *at <= self.at);
        let wanted = |image: u8| number.is_none_or(|number| image == number);
        let mut held = known.exemplars.get(..upto)?.iter().rev().map(|(_, exemplar)| exemplar);
        let found = held.find(|held| (held.epoch, held.label) == (epoch, label) && wanted(held.image))?;
        Some(found.data.clone())
    }

    /// The number of entries of the log up to the moment.
    fn logged(&self) -> usize {
        self.recording.log.partition_point(|(at, _)| *at <= self.at)
    }

    fn log(&self) -> Vec<LogEntry> {
        let entry = |(number, (at, event)): (u64, &(u64, Event))| {
            let vehicle = address(&self.parts, &valid_part(&event.vehicle)).and_then(Address::vehicle);
            let at = self.recording.timeline.mission_time(*at);
            let kind = LogKind::ALL.into_iter().find(|kind| kind.name() == event.source).unwrap_or(LogKind::Record);
            LogEntry { number, at, vehicle, kind, by: None, text: event.text.clone() }
        };
        (1..).zip(&self.recording.log[..self.logged()]).map(entry).collect()
    }
}

/// The address of the vehicle with this part of topics.
fn address(parts: &BTreeMap<u8, String>, part: &str) -> Option<u8> {
    parts.iter().find(|(_, own)| *own == part).map(|(&id, _)| id)
}

/// The last moment of a list up to this one.
fn last_upto(moments: &[u64], at: u64) -> Option<u64> {
    let next = moments.partition_point(|moment| *moment <= at);
    moments.get(next.checked_sub(1)?).copied()
}

/// The part of the topics of each vehicle by its address: that of the states, or else the lowest that is free.
fn addresses(recording: &Recording) -> BTreeMap<u8, String> {
    let mut parts = BTreeMap::new();
    for vehicle in recording.timeline.states.iter().flat_map(|state| &state.head.vehicles) {
        parts.insert(vehicle.id, valid_part(&vehicle.name));
    }
    for part in recording.vehicles.keys() {
        if !parts.values().any(|known| known == part)
            && let Some(id) = (1..=14).find(|id| !parts.contains_key(id))
        {
            parts.insert(id, part.clone());
        }
    }
    parts
}
