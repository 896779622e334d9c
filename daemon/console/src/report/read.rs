//! Reads a dive from a record.

use super::areas::areas;
use super::dive::{Dive, DiveVehicle, EndMap, OwnRecord};
use super::link::budgets;
use super::log::{events, images};
use super::maps::maps_over_time;
use super::restart::set_backs;
use super::times::is_scaled;
use super::track_point::{TrackPoint, measured};
use super::{seconds, words};
use crate::recording::{Recording, StateText};
use scenecast_core::UserError;
use scenecast_files::RecordFile;
use scenecast_messages::contents::valid_part;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::scenecast_msgs::{Event, Exemplar};
use scenecast_surface::state::{LinkDirection, LinkSummary, MissionState, VehicleState};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Why a record is not told as a dive.
#[derive(Debug, thiserror::Error)]
pub(crate) enum DiveError {
    #[error("no record of a surface: it has no topic /scenecast/state")]
    NoSurface,
    #[error("/scenecast/state of the record: {0}")]
    State(#[from] serde_json::Error),
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
        // Where the clock is not the mission's, that of the whole record tells more than the last state.
        if is_scaled(state.mission.speed) {
            state.mission.speed = recording.timeline.clock.mean_speed().unwrap_or(state.mission.speed);
        }
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
        let goes_to_place = timeline.states.iter().filter_map(|text| goes_to_place(text, state.id)).collect();
        let known = operator.get_mut(part)?;
        known.map.seek(u64::MAX, |nanos| timeline.mission_time(nanos));
        let shown = known.map.shown();
        let map = EndMap {
            labels: shown.labels.shown().clone(),
            cells: Some(shown.cells(0, timeline.mission_time(timeline.span.1))),
            epoch: shown.epoch,
            layer_cells: shown
                .layers
                .iter()
                .map(|(name, layer)| (name.clone(), layer.levels().shown().explored()))
                .collect(),
            cell_m: shown.cell_m,
            classes: areas(shown, |label| state.label_book.shown_as(label)),
            had: known.map.labels_so_far(),
        };
        let mut vehicle = Self {
            map,
            heard_s: known.heard.iter().copied().map(seconds).collect(),
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
            goes_to_place,
            link: known.link.iter().map(|(at, link)| (seconds(*at), link.clone())).collect(),
            maps,
            ..Self::default()
        };
        vehicle.floor = known.floor_until(u64::MAX).into_values().map(|(_, view)| view.clone()).collect();
        // Of an earlier epoch, their numbers mean something else.
        let is_current = |exemplar: &Exemplar| exemplar.epoch == u32::from(shown.epoch);
        let exemplars = known.exemplars.iter().filter(|(_, exemplar)| is_current(exemplar));
        for (at, exemplar) in exemplars {
            let received = exemplar.header.stamp.nanos().max(0) as u64;
            let arrived = (seconds(if received == 0 { *at } else { received }), exemplar.clone());
            let number = |of: &Exemplar| (of.label, of.image);
            match vehicle.exemplars.iter_mut().find(|(_, other)| number(other) == number(exemplar)) {
                // A larger one takes the place of a smaller one, and the same one when somebody asked for it. A surface that was
                // restarted has recorded again what it knew.
                Some(known) if known.1.data.len() < exemplar.data.len() => *known = arrived,
                Some(known) if exemplar.requested && !known.1.requested => {
                    (known.0, known.1.requested) = (arrived.0, true);
                }
                Some(_) => {}
                None => vehicle.exemplars.push(arrived),
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
}

/// When a state was recorded, and whether a vehicle goes to a place that was ordered by it.
fn goes_to_place(text: &StateText, id: u8) -> Option<(f64, bool)> {
    #[derive(serde::Deserialize)]
    struct State {
        vehicles: Vec<Vehicle>,
    }
    #[derive(serde::Deserialize)]
    struct Vehicle {
        id: u8,
        destination_in_force: Option<serde::de::IgnoredAny>,
    }
    let state: State = serde_json::from_str(&text.json).ok()?;
    let vehicle = state.vehicles.into_iter().find(|vehicle| vehicle.id == id)?;
    Some((seconds(text.nanos), vehicle.destination_in_force.is_some()))
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
