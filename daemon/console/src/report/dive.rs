//! What a record says about a dive.

use super::areas::ClassArea;
use super::maps::MapsAt;
use super::order_step::{OrderKey, OrderStep};
use super::settings::SettingsRecord;
use super::track_point::TrackPoint;
use crate::recording::FrameCounts;
use scenecast_core::utc_text;
use scenecast_files::{MissionClock, RecordFile};
use scenecast_messages::contents::valid_part;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Link, Order, OrderStatus};
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_surface::state::{MapLabelTree, MissionState, ReplaySide, VehicleMarker, VehicleState};
use scenecast_surface::{MapCaption, MapCells};
use std::collections::{BTreeMap, BTreeSet};

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
    /// The operator's map at the end.
    pub(super) map: EndMap,
    /// When frames of it were received, seconds since 1970.
    pub(super) heard_s: Vec<f64>,
    /// The places that it has reported.
    pub(super) track: Vec<TrackPoint>,
    /// What its own record says.
    pub(super) own: OwnRecord,
    /// When the surface learned that its program had begun again.
    pub(super) restarts_s: Vec<f64>,
    /// How many times as fast as the clock the mission was.
    pub(super) mission_speed: f64,
    /// The way of each order, by slot and version.
    pub(super) orders: BTreeMap<OrderKey, Vec<OrderStep>>,
    pub(super) given: BTreeMap<OrderKey, Order>,
    pub(super) exemplars: Vec<(f64, Exemplar)>,
    pub(super) link: Vec<(f64, Link)>,
    pub(super) maps: Vec<MapsAt>,
    /// Whether the surface knew it to go to a place that was ordered, at each state that it recorded.
    pub(super) goes_to_place: Vec<(f64, bool)>,
    /// The images of the sea floor that it has sent on this map, the latest of each place.
    pub(super) floor: Vec<Exemplar>,
}

/// The operator's map of a vehicle at the end.
#[derive(Debug, Default)]
pub(super) struct EndMap {
    pub(super) labels: LabelGrid,
    /// The same with its layers, as files have it.
    pub(super) cells: Option<MapCells>,
    pub(super) epoch: u8,
    /// Cells of each layer, by its name.
    pub(super) layer_cells: BTreeMap<String, usize>,
    /// The edge of a cell, metres.
    pub(super) cell_m: f64,
    /// The areas of the classes, the largest first.
    pub(super) classes: Vec<ClassArea>,
    /// All labels that were on it in this epoch.
    pub(super) had: BTreeSet<u8>,
}

/// The map of a vehicle before a restart of its program and after it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SetBack {
    /// Cells before, and those that had the same label after.
    pub(super) cells: u64,
    pub(super) kept: u64,
    /// The age of the oldest change that was lost, when the record stops, mission seconds.
    pub(super) lost_s: f64,
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

/// The names of a vehicle's modes, without their reasons, each since a time in seconds since 1970.
pub(super) struct ModeChanges<'a>(Vec<(f64, &'a str)>);

impl ModeChanges<'_> {
    /// The mode at a moment; `None` before the first that is known.
    pub(super) fn at(&self, at_s: f64) -> Option<&str> {
        self.0.iter().rev().find(|(since_s, _)| *since_s <= at_s).map(|(_, mode)| *mode)
    }
}

impl OwnRecord {
    /// The times between its runs.
    pub(super) fn pauses(&self) -> impl Iterator<Item = (f64, f64)> {
        self.runs_s.iter().zip(self.runs_s.iter().skip(1)).map(|(before, after)| (before.1, after.0))
    }
}

impl Dive {
    /// The events about the modes of a vehicle.
    pub(super) fn modes<'a>(
        &'a self,
        state: &VehicleState,
        vehicle: &DiveVehicle,
    ) -> impl Iterator<Item = (f64, &'a Event)> + use<'a> {
        let (of_modes, part) = (vehicle.mode_source(), valid_part(&state.name));
        let is_mode = move |event: &Event| event.source == of_modes && valid_part(&event.vehicle) == part;
        self.events.iter().filter(move |(_, event)| is_mode(event)).map(|(at_s, event)| (*at_s, event))
    }

    /// The modes of a vehicle over time.
    pub(super) fn mode_changes<'a>(&'a self, state: &VehicleState, vehicle: &DiveVehicle) -> ModeChanges<'a> {
        let mode = |text: &'a str| text.split(": ").next().unwrap_or_default();
        ModeChanges(self.modes(state, vehicle).map(|(at_s, event)| (at_s, mode(&event.text))).collect())
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
        let cells =
            vehicle.map.cells.clone().unwrap_or_else(|| MapCells::of_labels(&vehicle.map.labels, vehicle.map.cell_m));
        let caption = MapCaption {
            mission: self.state.mission.name.clone(),
            address: state.id,
            name: state.name.clone(),
            epoch: vehicle.map.epoch,
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
        self.map.epoch == 0 && self.maps.first().is_none_or(|first| first.cells == 0)
    }

    /// The middle of a cell of its map, which lies `shift` from the world frame, metres.
    pub(super) fn middle_of(&self, cell: Cell, shift: (f64, f64)) -> (f64, f64) {
        let middle = |index: i32, shift_m: f64| (f64::from(index) + 0.5) * self.map.cell_m + shift_m;
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
        let index = |m: f64| (m / self.map.cell_m).floor() as i32;
        self.map.labels.get(Cell::new(index(east_m - shift_east_m), index(north_m - shift_north_m)))
    }
}
