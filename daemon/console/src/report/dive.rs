//! What a record says about a dive.

use super::areas::{ClassArea, areas};
use super::link::budgets;
use super::log::{events, images};
use super::maps::{MapsAt, maps_over_time};
use super::orders::{OrderKey, OrderStep};
use super::restart::{SetBack, set_backs};
use super::settings::SettingsRecord;
use super::times::is_scaled;
use super::track::{TrackPoint, measured};
use super::words;
use crate::replay::{FrameCounts, Recording, StateText};
use scenecast_core::{UserError, utc_text};
use scenecast_files::{MissionClock, RecordFile};
use scenecast_messages::contents::valid_part;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Link, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_surface::state::{
    LinkDirection, LinkSummary, MapLabelTree, MissionState, ReplaySide, VehicleMarker, VehicleState,
};
use scenecast_surface::{MapCaption, MapCells};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// Why a record is not told as a dive.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DiveError {
    #[error("no record of a surface: it has no topic /scenecast/state")]
    NoSurface,
    #[error("/scenecast/state of the record: {0}")]
    State(#[from] serde_json::Error),
}

/// The dive of a record of the surface.
#[derive(Debug, Default)]
pub struct Dive {
    /// The times of its first and its last message, seconds since 1970.
    pub span_s: (f64, f64),
    /// The times of the first and the last state that the surface recorded.
    pub(super) surface_s: (f64, f64),
    /// The last state that the page showed.
    pub state: MissionState,
    /// What is known of each vehicle, by the part of its topics.
    pub(super) vehicles: BTreeMap<String, DiveVehicle>,
    /// The log of the surface, and modes and notes of the vehicles' own records, by time.
    pub(super) events: Vec<(f64, Event)>,
    /// Begin and end of the times in which the surface recorded nothing.
    pub(super) gaps_s: Vec<(f64, f64)>,
    /// How many frames the surface sent, received and dropped, over all its records.
    pub(super) frames: FrameCounts,
    /// The mission time at each recorded state, by which mission times become times of the surface's clock.
    pub(super) clock: MissionClock,
    /// What the surface ran with.
    pub(super) settings: SettingsRecord,
    /// Why some of the record could not be read.
    pub damage: Option<String>,
    /// When the surface ended and was started again.
    pub(super) restarts_s: Vec<(f64, f64)>,
    /// The files that it was read from; empty while they are written.
    pub(super) files: Vec<RecordFile>,
}

/// What a record says about a vehicle.
#[derive(Debug, Default)]
pub(super) struct DiveVehicle {
    /// The labels of the operator's map at the end.
    pub(super) labels: LabelGrid,
    /// The same with its layers, as files have it.
    cells: Option<MapCells>,
    epoch: u8,
    /// Cells of each layer of that map, by its name.
    pub(super) layer_cells: BTreeMap<String, usize>,
    /// When frames of it were received, seconds since 1970.
    pub(super) heard_s: Vec<f64>,
    /// The edge of a cell, metres.
    pub(super) cell_m: f64,
    /// The areas of the classes, the largest first.
    pub(super) classes: Vec<ClassArea>,
    /// The places that it has reported.
    pub(super) track: Vec<TrackPoint>,
    /// What its own record says.
    pub(super) own: OwnRecord,
    /// When the surface learned that its program had begun again.
    pub(super) restarts_s: Vec<f64>,
    /// How many times as fast as the clock the mission was.
    pub(super) mission_speed: f64,
    /// All labels that were on the operator's map of this epoch.
    pub(super) had: BTreeSet<u8>,
    /// The way of each order, by slot and version.
    pub(super) orders: BTreeMap<OrderKey, Vec<OrderStep>>,
    pub(super) given: BTreeMap<OrderKey, Order>,
    pub(super) exemplars: Vec<(f64, Exemplar)>,
    pub(super) link: Vec<(f64, Link)>,
    pub(super) maps: Vec<MapsAt>,
}

/// What a vehicle's own record says; empty without one.
#[derive(Debug, Default)]
pub(super) struct OwnRecord {
    /// Its places, in the world frame as its map lies at the end.
    pub(super) track: Vec<TrackPoint>,
    pub(super) frames: FrameCounts,
    /// The bits of what they carried first, by its name.
    pub(super) sent_bits: BTreeMap<String, u64>,
    /// Its bit budgets, bit/s, and since when, seconds since 1970.
    pub(super) budgets_bps: Vec<(f64, u32)>,
    /// When it heard frames of the surface, seconds since 1970.
    pub(super) heard_s: Vec<f64>,
    /// Begin and end of each of its records.
    pub(super) runs_s: Vec<(f64, f64)>,
    /// The maps before and after each restart of its program, which is the time between two of its records.
    pub(super) set_backs: Vec<Option<SetBack>>,
    /// When it decided about orders.
    pub(super) decided_s: BTreeMap<OrderKey, f64>,
    /// What had become of the images of the camera at the end of each run.
    pub(super) images: Vec<String>,
    /// The program and the settings of its last run; empty if its records have none.
    pub(super) settings: SettingsRecord,
}

impl OwnRecord {
    /// The times between its runs.
    pub(super) fn pauses(&self) -> impl Iterator<Item = (f64, f64)> {
        self.runs_s.iter().zip(self.runs_s.iter().skip(1)).map(|(before, after)| (before.1, after.0))
    }
}

/// The last that the record has of each process of the surface but the last, and the first state of the next.
fn restarts_s(recording: &Recording) -> Vec<(f64, f64)> {
    let heard = |until: u64| {
        let all = recording.operator.values().flat_map(|known| known.heard.iter().copied());
        all.filter(|at| *at < until).max().unwrap_or_default()
    };
    let restarts = recording.timeline.restarts();
    restarts.map(|(a, b)| (seconds(a.nanos.max(heard(b.nanos))), seconds(b.nanos))).collect()
}

/// When the surface learned that the program of a vehicle had begun again.
fn another_runs(log: &[(u64, Event)], vehicle: &str) -> Vec<f64> {
    let is_of_it = |event: &Event| event.vehicle == vehicle && event.text == words::ANOTHER_RUN;
    log.iter().filter(|(_, event)| is_of_it(event)).map(|(at, _)| seconds(*at)).collect()
}

pub(super) fn seconds(nanos: u64) -> f64 {
    nanos as f64 / 1e9
}

impl Dive {
    /// Reads the record of a surface, and of vehicles if they are given: files, or their folders.
    ///
    /// # Errors
    /// There is no record, or none of a surface.
    pub fn read(paths: &[PathBuf]) -> Result<Self, UserError> {
        let names: Vec<_> = paths.iter().map(|path| path.display().to_string()).collect();
        Self::of(&mut Recording::read(paths)?).map_err(|what| UserError::Input(format!("{}: {what}", names.join(", "))))
    }

    /// The same with the sums of the files that nobody writes meanwhile.
    ///
    /// # Errors
    /// As for [`Self::read`]; or a file cannot be read.
    pub fn read_ended(paths: &[PathBuf]) -> Result<Self, UserError> {
        let began = std::time::SystemTime::now();
        let dive = Self::read(paths)?;
        let mut files = paths.iter().map(|path| RecordFile::all(path, began)).collect::<Result<Vec<_>, _>>()?.concat();
        files.dedup();
        Ok(Self { files, ..dive })
    }

    /// The dive of a recording, of which the maps are at its end afterwards. The error is one line for people.
    pub(crate) fn of(recording: &mut Recording) -> Result<Self, DiveError> {
        let Some(last) = recording.timeline.states.last() else {
            return Err(DiveError::NoSurface);
        };
        let ended_s = seconds(last.nanos);
        let read = |json: &str| serde_json::from_str::<MissionState>(json);
        let mut state = read(&last.json)?;
        for (end, _) in recording.timeline.restarts() {
            let LinkSummary { up, down, .. } = read(&end.json)?.link;
            state.link.up = sum(&state.link.up, &up);
            state.link.down = sum(&state.link.down, &down);
        }
        let (first, last) = recording.timeline.span;
        let mission_speed = state.mission.speed;
        let mut vehicles = BTreeMap::new();
        for vehicle in &state.vehicles {
            let part = valid_part(&vehicle.name);
            vehicles.extend(DiveVehicle::of(recording, vehicle, &part, mission_speed).map(|known| (part, known)));
        }
        Ok(Self {
            span_s: (seconds(first), seconds(last)),
            surface_s: (seconds(first), ended_s),
            state,
            vehicles,
            events: events(recording, is_scaled(mission_speed)),
            gaps_s: gaps(recording),
            restarts_s: restarts_s(recording),
            frames: recording.frames.clone(),
            clock: recording.timeline.clock.clone(),
            settings: serde_json::from_str(&recording.settings).unwrap_or_default(),
            damage: (!recording.damage.is_empty()).then(|| recording.damage.join("; ")),
            files: Vec::new(),
        })
    }

    /// The events about the modes of a vehicle.
    pub(super) fn modes(&self, state: &VehicleState, vehicle: &DiveVehicle) -> impl Iterator<Item = (f64, &Event)> {
        let (of_modes, part) = (vehicle.mode_source(), valid_part(&state.name));
        let is_mode = move |event: &Event| event.source == of_modes && valid_part(&event.vehicle) == part;
        self.events.iter().filter(move |(_, event)| is_mode(event)).map(|(at_s, event)| (*at_s, event))
    }

    /// What the vehicle ran with, by its own record, or else the surface.
    pub(super) fn ran_with<'a>(&'a self, vehicle: &'a DiveVehicle) -> &'a SettingsRecord {
        if vehicle.own.settings.settings.is_empty() { &self.settings } else { &vehicle.own.settings }
    }

    /// Whether the record has what the vehicle ran with.
    pub(super) fn knows_settings(&self, vehicle: &DiveVehicle) -> bool {
        !vehicle.own.settings.program.is_empty() || self.settings.is_rehearsal()
    }

    /// The vehicles, as the page showed them last and as the record has them.
    pub(super) fn vehicles(&self) -> impl Iterator<Item = (&VehicleState, &DiveVehicle)> {
        let known = |state: &VehicleState| self.vehicles.get(&valid_part(&state.name));
        self.state.vehicles.iter().filter_map(move |state| Some((state, known(state)?)))
    }

    /// The map of a vehicle at the end as files have it, with what the operator has written on it.
    pub(super) fn map_cells(&self, state: &VehicleState, vehicle: &DiveVehicle) -> MapCells {
        let cells = vehicle.cells.clone().unwrap_or_else(|| MapCells::of_labels(&vehicle.labels, vehicle.cell_m));
        let caption = MapCaption {
            mission: self.state.mission.name.clone(),
            address: state.id,
            name: state.name.clone(),
            epoch: vehicle.epoch,
            utc: utc_text(self.span_s.1),
            side: ReplaySide::Operator,
        };
        let dated = |marker: &VehicleMarker| (marker.clone(), Some(utc_text(self.unix_s(marker.at_s))));
        MapCells {
            version: state.map.version,
            moved_m: state.map.shift_m(),
            book: state.label_book.clone(),
            tree: state.label_tree.as_ref().and_then(MapLabelTree::tree),
            markers: state.markers.iter().map(dated).collect(),
            caption: Some(caption),
            ..cells
        }
    }
}

impl DiveVehicle {
    /// What a recording says about a vehicle with this part of topics; `None` if it has nothing.
    fn of(recording: &mut Recording, state: &VehicleState, part: &str, mission_speed: f64) -> Option<Self> {
        let maps = maps_over_time(recording, state.id, part);
        let set_backs = set_backs(recording, part);
        let Recording { timeline, operator, vehicles, .. } = recording;
        let own = vehicles.get(part);
        let shift = state.map.shift_m();
        let moved = |(at, pose): &(u64, PoseWithCovarianceStamped)| {
            let point = TrackPoint::of(pose);
            let (east_m, north_m) = (point.east_m + shift.0, point.north_m + shift.1);
            TrackPoint { at_s: seconds(*at), east_m, north_m, ..point }
        };
        let known = operator.get_mut(part)?;
        known.map.seek(u64::MAX, |nanos| timeline.mission_time(nanos));
        let shown = known.map.shown();
        let mut vehicle = Self {
            labels: shown.labels.shown().clone(),
            cells: Some(shown.cells(0, timeline.mission_time(timeline.span.1))),
            layer_cells: shown
                .layers
                .iter()
                .map(|(name, layer)| (name.clone(), layer.levels().shown().explored()))
                .collect(),
            epoch: shown.epoch,
            heard_s: known.heard.iter().copied().map(seconds).collect(),
            cell_m: shown.cell_m,
            classes: areas(shown, |label| state.label_book.shown_as(label)),
            track: known.poses.iter().map(|(_, pose)| TrackPoint::of(pose)).filter(TrackPoint::is_known).collect(),
            own: own.map_or_else(OwnRecord::default, |own| OwnRecord {
                track: measured(own.poses.iter().map(moved).filter(TrackPoint::is_known).collect(), mission_speed),
                frames: own.frames.clone(),
                sent_bits: own.sent_bits.clone(),
                budgets_bps: budgets(own.link.iter().map(|(at, link)| (seconds(*at), link))),
                heard_s: own.heard.iter().copied().map(seconds).collect(),
                runs_s: own.runs.iter().map(|(from, to)| (seconds(*from), seconds(*to))).collect(),
                set_backs,
                decided_s: BTreeMap::new(),
                images: images(&own.events, &own.runs),
                settings: serde_json::from_str(&own.settings).unwrap_or_default(),
            }),
            restarts_s: another_runs(&recording.log, &state.name),
            mission_speed,
            had: known.map.labels_so_far(),
            link: known.link.iter().map(|(at, link)| (seconds(*at), link.clone())).collect(),
            maps,
            ..Self::default()
        };
        // Of an earlier epoch, their numbers mean something else.
        let is_current = |exemplar: &Exemplar| exemplar.epoch == u32::from(shown.epoch);
        let exemplars = known.exemplars.iter().filter(|(_, exemplar)| is_current(exemplar));
        for (at, exemplar) in exemplars {
            // A surface that was restarted has recorded again what it knew.
            let is_same = |other: &Exemplar| {
                (other.label, other.image, &other.data) == (exemplar.label, exemplar.image, &exemplar.data)
            };
            if !vehicle.exemplars.iter().any(|(_, other)| is_same(other)) {
                let received = exemplar.header.stamp.nanos().max(0) as u64;
                vehicle.exemplars.push((seconds(if received == 0 { *at } else { received }), exemplar.clone()));
            }
        }
        for order in &known.given {
            // A surface that was restarted may record it again, without what has been done of it.
            vehicle.given.entry((order.slot.clone(), order.version)).or_insert_with(|| order.clone());
        }
        known.orders.iter().for_each(|status| vehicle.take_order(status));
        own.iter().flat_map(|own| &own.orders).for_each(|status| vehicle.take_decision(status));
        Some(vehicle)
    }

    /// Why it was no real dive, in a clause; `None` if nothing says that it was not.
    pub(super) fn made_up(&self, dive: &Dive) -> Option<String> {
        if dive.settings.is_rehearsal() {
            let seed = dive.settings.rehearsal_seed.map_or_else(String::new, |seed| format!(" (seed {seed})"));
            return Some(format!("a rehearsal over a simulated sea floor{seed}"));
        }
        if self.is_played_back() {
            return Some("a playback of recorded images and poses".to_owned());
        }
        let is_simulated = self.own.settings.text("autopilot.kind") == Some("rehearsal");
        is_simulated.then(|| match self.own.settings.text("navigation.source") {
            Some(source) if source != "autopilot" => {
                format!(
                    "a test: the autopilot was simulated (autopilot.kind = rehearsal), and places came from {source}"
                )
            }
            _ => "a test in which the vehicle's motion was simulated (autopilot.kind = rehearsal)".to_owned(),
        })
    }

    /// Whether it has used position fixes.
    pub(super) fn has_fixes(&self) -> bool {
        let is_used = |way: &Vec<OrderStep>| way.iter().any(|step| step.status == OrderStatus::APPLIED);
        self.orders.iter().any(|((slot, _), way)| slot == SlotId::Fix.name() && is_used(way))
    }

    /// Whether its own record has about the same time as that of the surface, so that frames of the one can be looked for in the other.
    pub(super) fn covers(&self, dive: &Dive) -> bool {
        const MAX_APART_S: f64 = 15.0;
        let own = self.own.runs_s.first().zip(self.own.runs_s.last()).map(|(first, last)| (first.0, last.1));
        let is_near = |a: f64, b: f64| (a - b).abs() <= MAX_APART_S;
        let pauses = || self.own.pauses().chain(dive.restarts_s.iter().copied());
        own.is_some_and(|own| is_near(own.0, dive.surface_s.0) && is_near(own.1, dive.surface_s.1))
            && pauses().all(|(from_s, to_s)| to_s - from_s <= MAX_APART_S)
    }

    /// Whether its frames went through a modem, whose round trips are those of sound in water.
    pub(super) fn has_modem(&self, dive: &Dive) -> bool {
        // The default is a socket.
        let kind = dive.ran_with(self).text("modem.kind");
        dive.settings.is_rehearsal() || kind.is_some_and(|kind| !["tcp", "udp"].contains(&kind))
    }

    /// Whether recorded images stood for a camera.
    pub(super) fn is_played_back(&self) -> bool {
        let source = self.own.settings.text("camera.source");
        source.is_some_and(|source| ["frames:", "bag:", "tum:"].iter().any(|kind| source.starts_with(kind)))
    }

    /// Whether the record has all of its map, and no other one of it.
    pub(super) fn has_one_map(&self) -> bool {
        self.epoch == 0 && self.maps.first().is_none_or(|first| first.cells == 0)
    }

    /// The middle of a cell of its map, which lies `shift` from the world frame, metres.
    pub(super) fn middle_of(&self, cell: Cell, shift: (f64, f64)) -> (f64, f64) {
        let middle = |index: i32, shift_m: f64| (f64::from(index) + 0.5) * self.cell_m + shift_m;
        (middle(cell.x, shift.0), middle(cell.y, shift.1))
    }

    /// Whether the place of an image has the class of its label on the map at the end; true where its place is not known.
    pub(super) fn shows_class(&self, state: &VehicleState, image: &Exemplar) -> bool {
        let class = |label: u8| state.label_book.shown_as(label);
        let label = || self.label_at(state.map.shift_m(), image.middle.x, image.middle.y);
        image.width_m.is_nan() || class(label()) == class(image.label)
    }

    /// The label that a place in the world frame has on the map at the end; 0 without one.
    pub(super) fn label_at(&self, (shift_east_m, shift_north_m): (f64, f64), east_m: f64, north_m: f64) -> u8 {
        let index = |m: f64| (m / self.cell_m).floor() as i32;
        self.labels.get(Cell::new(index(east_m - shift_east_m), index(north_m - shift_north_m)))
    }
}

/// Two counts of one direction as one.
fn sum(a: &LinkDirection, b: &LinkDirection) -> LinkDirection {
    let (frames, lost) = (a.frames + b.frames, a.lost + b.lost);
    let mut bytes_by_class = a.bytes_by_class.clone();
    b.bytes_by_class.iter().for_each(|(class, bytes)| *bytes_by_class.entry(class.clone()).or_default() += bytes);
    let energy_j = a.energy_j.zip(b.energy_j).map(|(a, b)| a + b);
    LinkDirection { frames, lost, loss: lost as f64 / frames.max(1) as f64, bytes_by_class, energy_j, ..a.clone() }
}

/// The times in which a surface that records its state every ten seconds recorded none.
fn gaps(recording: &Recording) -> Vec<(f64, f64)> {
    const LONGEST: u64 = 30_000_000_000;
    let apart = |pair: &[StateText]| match pair {
        [a, b] if b.nanos.saturating_sub(a.nanos) > LONGEST => Some((seconds(a.nanos), seconds(b.nanos))),
        _ => None,
    };
    recording.timeline.states.windows(2).filter_map(apart).collect()
}
