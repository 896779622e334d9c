//! The maps of both ends over the time of a dive, and how far the operator's was behind.

use super::seconds;
use crate::recording::{Known, Recording, ShownMap};
use scenecast_protocol::map::Cell;
use scenecast_protocol::time::Instant;
use scenecast_surface::state::VehicleChannel;

/// Moments of a record at which its maps are looked at.
const MOMENTS: u64 = 60;

/// The maps of both sides at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct MapsAt {
    pub(super) at_s: f64,
    /// Cells of the operator's map.
    pub(super) cells: u64,
    /// Of the cells that the vehicle had to send, the share that the operator's map has with the same label; NaN without its record.
    pub(super) agreement: f64,
    /// How far the operator's map was behind that of the vehicle, mission seconds: by the vehicle's record, the age of the oldest change
    /// that had not arrived; else as the page said; NaN where it is not known.
    pub(super) lag_s: f64,
}

/// The maps at moments of the record.
pub(super) fn maps_over_time(recording: &mut Recording, id: u8, part: &str) -> Vec<MapsAt> {
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
        let lag_s = match &vehicle {
            Some(vehicle) => missing_for_s(vehicle.map.shown(), held, timeline.mission_time(nanos)),
            None => timeline.state_at(nanos).and_then(|state| lag_s(&state.json, id)).unwrap_or(f64::NAN),
        };
        MapsAt { at_s: seconds(nanos), cells: held.labels.shown().explored() as u64, agreement, lag_s }
    };
    (0..=MOMENTS).map(maps).collect()
}

/// Of the vehicle's cells the share that the operator's map has with the same label; NaN without cells.
fn agreement(vehicle: &ShownMap, operator: &ShownMap) -> f64 {
    let (cells, held) = (vehicle.labels.shown(), operator.labels.shown());
    let is_same = |&(cell, label): &(Cell, u8)| vehicle.epoch == operator.epoch && held.get(cell) == label;
    cells.iter().filter(is_same).count() as f64 / cells.explored() as f64
}

/// The age of the oldest change of a vehicle's map that the operator's has not, mission seconds.
fn missing_for_s(vehicle: &ShownMap, operator: &ShownMap, now: Instant) -> f64 {
    let missing = vehicle.difference(operator);
    let changed = missing.iter().filter_map(|(cell, _)| vehicle.labels.received_at(cell));
    changed.map(|at| now.since(at).as_secs_f64()).fold(0.0, f64::max)
}

/// How far the map of a vehicle is behind, by a state of the page.
fn lag_s(json: &str, id: u8) -> Option<f64> {
    #[derive(serde::Deserialize)]
    struct State {
        vehicles: Vec<Lags>,
    }
    #[derive(serde::Deserialize)]
    struct Lags {
        id: u8,
        link: VehicleChannel,
    }
    let state: State = serde_json::from_str(json).ok()?;
    state.vehicles.iter().find(|vehicle| vehicle.id == id)?.link.backlog.as_ref()?.map_lag_s
}
