//! What a record says about a dive.

use super::areas::{ClassArea, areas};
use super::words;
use crate::replay::{Known, Recording, ShownMap};
use crate::state::{MissionState, VehicleState};
use scenecast_core::UserError;
use scenecast_files::MissionClock;
use scenecast_messages::contents::valid_part;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Link, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, LabelGrid};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Moments of a record at which its maps are looked at.
const MOMENTS: u64 = 60;
/// The longest content of an order that is told whole, bytes.
const MAX_CONTENT: usize = 200;

/// The dive of a record of the surface.
#[derive(Debug, Default)]
pub struct Dive {
    /// The times of its first and its last message, seconds since 1970.
    pub span_s: (f64, f64),
    /// The last state that the page showed.
    pub state: MissionState,
    /// What is known of each vehicle, by the part of its topics.
    pub(super) vehicles: BTreeMap<String, DiveVehicle>,
    pub(super) events: Vec<(f64, Event)>,
    /// Frames sent, received and dropped.
    pub(super) frames: [u64; 3],
    /// The mission times.
    clock: MissionClock,
    /// What the surface ran with.
    pub(super) settings: SettingsRecord,
    /// Why some of the record could not be read.
    pub damage: Option<String>,
}

/// The program that made a record, and its settings that differed from their defaults, by key.
#[derive(Debug, Default, serde::Deserialize)]
#[serde(default)]
pub(super) struct SettingsRecord {
    pub(super) program: String,
    pub(super) simulated: bool,
    pub(super) settings: BTreeMap<String, serde_json::Value>,
}

/// What a record says about a vehicle.
#[derive(Debug, Default)]
pub(super) struct DiveVehicle {
    /// The labels of the operator's map at the end.
    pub(super) labels: LabelGrid,
    /// The edge of a cell, metres.
    pub(super) cell_m: f64,
    /// The areas of the classes, the largest first.
    pub(super) classes: Vec<ClassArea>,
    pub(super) track: Vec<TrackPoint>,
    /// The way of each order, by slot and version.
    pub(super) orders: BTreeMap<(String, u32), Vec<OrderStep>>,
    pub(super) given: BTreeMap<(String, u32), Order>,
    pub(super) exemplars: Vec<(f64, Exemplar)>,
    pub(super) link: Vec<(f64, Link)>,
    pub(super) maps: Vec<MapsAt>,
}

/// The maps of both sides at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct MapsAt {
    pub(super) at_s: f64,
    /// Cells of the operator's map.
    pub(super) cells: u64,
    /// Of the vehicle's cells the share that the operator's map has with the same label; NaN without the vehicle's record.
    pub(super) agreement: f64,
}

/// A reported place, metres in the world frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackPoint {
    pub(super) at_s: f64,
    pub(super) east_m: f64,
    pub(super) north_m: f64,
    pub(super) depth_m: f64,
    pub(super) sigma_m: f64,
}

/// A status of an order.
#[derive(Debug, Clone)]
pub(super) struct OrderStep {
    pub(super) at_s: f64,
    pub(super) given_s: f64,
    pub(super) status: u8,
    pub(super) reason: String,
}

fn seconds(nanos: u64) -> f64 {
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

    /// The dive of a recording, of which the maps are at its end afterwards. The error is one line for people.
    pub(crate) fn of(recording: &mut Recording) -> Result<Self, String> {
        let Some(last) = recording.timeline.states.last() else {
            return Err("no record of a surface: it has no topic /scenecast/state".to_owned());
        };
        let state: MissionState =
            serde_json::from_str(&last.json).map_err(|e| format!("/scenecast/state of the record: {e}"))?;
        let (first, last) = recording.timeline.span;
        let mut vehicles = BTreeMap::new();
        for vehicle in &state.vehicles {
            let part = valid_part(&vehicle.name);
            vehicles.extend(DiveVehicle::of(recording, vehicle, &part).map(|known| (part, known)));
        }
        Ok(Self {
            span_s: (seconds(first), seconds(last)),
            state,
            vehicles,
            events: recording.log.iter().map(|(at, event)| (seconds(*at), event.clone())).collect(),
            frames: recording.frames,
            clock: recording.timeline.clock.clone(),
            settings: serde_json::from_str(&recording.settings).unwrap_or_default(),
            damage: (!recording.damage.is_empty()).then(|| recording.damage.join("; ")),
        })
    }

    /// The moment of a mission time, seconds since 1970.
    pub(super) fn unix_s(&self, at_s: f64) -> f64 {
        self.clock.nanos(at_s).map_or(self.span_s.1, seconds)
    }

    /// The vehicles, as the page showed them last and as the record has them.
    pub(super) fn vehicles(&self) -> impl Iterator<Item = (&VehicleState, &DiveVehicle)> {
        let known = |state: &VehicleState| self.vehicles.get(&valid_part(&state.name));
        self.state.vehicles.iter().filter_map(move |state| Some((state, known(state)?)))
    }

    /// Who gave an order to a vehicle, and what it was: by the log, which has the words of the page, or else by its content.
    pub(super) fn ordered(
        &self,
        state: &VehicleState,
        vehicle: &DiveVehicle,
        order: &(String, u32),
    ) -> (String, String) {
        let Some(given) = vehicle.given.get(order) else { return (String::new(), "not recorded".to_owned()) };
        let given_s = given.header.stamp.nanos() as f64 / 1e9;
        let content = words::content(&state.label_book, given);
        // Several orders may be given within a second: the words are those of the nearest one in this slot.
        let logged = self.events.iter().filter_map(|(at_s, event)| {
            let is_of_it = event.vehicle == state.name || event.vehicle.is_empty();
            let (by, words) = said(&event.text, |words| words.starts_with(&given.slot) || words == content)?;
            (event.source == "order" && is_of_it).then_some(((at_s - given_s).abs(), by, words))
        });
        let nearest = logged.filter(|(away_s, ..)| *away_s < 0.5).min_by(|a, b| a.0.total_cmp(&b.0));
        let (by, words) = nearest.map_or((String::new(), content.clone()), |(_, by, words)| (by, words));
        // The log has places in a few words.
        let words = if content.len() > MAX_CONTENT { words } else { content };
        (if given.principal.is_empty() { by } else { given.principal.clone() }, words)
    }
}

/// The author and the words of an entry of the log, of which the words are to be recognised.
fn said(text: &str, is_it: impl Fn(&str) -> bool) -> Option<(String, String)> {
    let (by, words) = text.split_once(": ").filter(|(_, words)| is_it(words)).unwrap_or(("", text));
    is_it(words).then(|| (by.to_owned(), words.to_owned()))
}

impl DiveVehicle {
    /// What a recording says about a vehicle with this part of topics; `None` if it has nothing.
    fn of(recording: &mut Recording, state: &VehicleState, part: &str) -> Option<Self> {
        let maps = maps_over_time(recording, part);
        let Recording { timeline, operator, .. } = recording;
        let known = operator.get_mut(part)?;
        known.map.seek(u64::MAX, |nanos| timeline.mission_time(nanos));
        let shown = known.map.shown();
        let mut vehicle = Self {
            labels: shown.labels.shown().clone(),
            cell_m: shown.cell_m,
            classes: areas(shown, |label| state.label_book.shown_as(label)),
            track: known.poses.iter().map(|(_, pose)| TrackPoint::of(pose)).collect(),
            link: known.link.iter().map(|(at, link)| (seconds(*at), link.clone())).collect(),
            maps,
            ..Self::default()
        };
        // Of an earlier epoch, their numbers mean something else.
        let is_current = |exemplar: &Exemplar| exemplar.epoch == u32::from(shown.epoch);
        let exemplars = known.exemplars.iter().filter(|(_, exemplar)| is_current(exemplar));
        vehicle.exemplars = exemplars.map(|(at, exemplar)| (seconds(*at), exemplar.clone())).collect();
        vehicle.given = known.given.iter().map(|order| ((order.slot.clone(), order.version), order.clone())).collect();
        known.orders.iter().for_each(|status| vehicle.take_order(status));
        Some(vehicle)
    }

    fn take_order(&mut self, status: &OrderStatus) {
        let seconds = |time: &scenecast_messages::builtin_interfaces::Time| time.nanos() as f64 / 1e9;
        let step = OrderStep {
            at_s: seconds(&status.header.stamp),
            given_s: seconds(&status.given),
            status: status.status,
            reason: status.reason.clone(),
        };
        let way = self.orders.entry((status.slot.clone(), status.version)).or_default();
        // The next file of a record repeats the last status.
        if way.last().is_none_or(|last| last.status != step.status) {
            way.push(step);
        }
    }

    /// The orders but for position fixes, which the surface gives by itself.
    pub(super) fn orders_of_people(&self) -> impl Iterator<Item = (&(String, u32), &Vec<OrderStep>)> {
        self.orders.iter().filter(|((slot, _), _)| slot != SlotId::Fix.name())
    }

    /// Length of the reported track, metres.
    pub(super) fn distance_m(&self) -> f64 {
        let step = |pair: &[TrackPoint]| match pair {
            [a, b] => (b.east_m - a.east_m).hypot(b.north_m - a.north_m),
            _ => 0.0,
        };
        self.track.windows(2).map(step).sum()
    }
}

/// The maps at moments of the record.
fn maps_over_time(recording: &mut Recording, part: &str) -> Vec<MapsAt> {
    let Recording { timeline, operator, vehicles, .. } = recording;
    let Some(operator) = operator.get_mut(part) else { return Vec::new() };
    let mut vehicle = vehicles.get_mut(part);
    let (first, last) = timeline.span;
    let maps = |number| {
        let nanos = first + (last - first) / MOMENTS * number;
        let seek = |known: &mut Known| known.map.seek(nanos, |nanos| timeline.mission_time(nanos));
        seek(operator);
        vehicle.iter_mut().for_each(|vehicle| seek(vehicle));
        let held = operator.map.shown();
        let agreement = vehicle.as_ref().map_or(f64::NAN, |vehicle| agreement(vehicle.map.shown(), held));
        MapsAt { at_s: seconds(nanos), cells: held.labels.shown().explored() as u64, agreement }
    };
    (0..=MOMENTS).map(maps).collect()
}

/// Of the vehicle's cells the share that the operator's map has with the same label; NaN without cells.
fn agreement(vehicle: &ShownMap, operator: &ShownMap) -> f64 {
    let (cells, held) = (vehicle.labels.shown(), operator.labels.shown());
    let is_same = |&(cell, label): &(Cell, u8)| vehicle.epoch == operator.epoch && held.get(cell) == label;
    cells.iter().filter(is_same).count() as f64 / cells.explored() as f64
}

impl TrackPoint {
    fn of(message: &PoseWithCovarianceStamped) -> Self {
        let position = &message.pose.pose.position;
        Self {
            at_s: message.header.stamp.nanos() as f64 / 1e9,
            east_m: position.x,
            north_m: position.y,
            depth_m: -position.z,
            sigma_m: message.pose.covariance.first().map_or(f64::NAN, |variance| variance.sqrt()),
        }
    }
}
