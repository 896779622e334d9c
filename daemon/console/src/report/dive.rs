//! What a record says about a dive.

use crate::state::{MissionState, VehicleState};
use scenecast_core::UserError;
use scenecast_files::{RecordedMessage, read_record};
use scenecast_messages::contents::valid_part;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;
use scenecast_messages::scenecast_msgs::{Event, Exemplar, Frame, Link, MapCells, OrderStatus};
use scenecast_messages::std_msgs::Text;
use scenecast_protocol::directive::SlotId;
use scenecast_protocol::map::{Cell, LabelGrid};
use std::collections::BTreeMap;
use std::path::Path;

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
    pub(super) epoch: u32,
    pub(super) track: Vec<TrackPoint>,
    /// The way of each order, by slot and version.
    pub(super) orders: BTreeMap<(String, u32), Vec<OrderStep>>,
    pub(super) exemplars: Vec<(f64, Exemplar)>,
    pub(super) link: Vec<(f64, Link)>,
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

impl Dive {
    /// Reads the record of a surface: a file, or its folder.
    ///
    /// # Errors
    /// There is no record, or none of a surface.
    pub fn read(path: &Path) -> Result<Self, UserError> {
        let mut dive = Self { span_s: (f64::INFINITY, f64::NEG_INFINITY), ..Self::default() };
        let mut last_state = None;
        dive.damage = read_record(path, |message| dive.take(message, &mut last_state))?;
        let Some(state) = last_state else {
            let what = "it is no record of a surface: it has no topic /scenecast/state";
            return Err(UserError::file(path, what));
        };
        dive.state =
            serde_json::from_str(&state).map_err(|e| UserError::file(path, format!("/scenecast/state: {e}")))?;
        Ok(dive)
    }

    fn take(&mut self, message: RecordedMessage, last_state: &mut Option<String>) {
        let at_s = message.nanos() as f64 / 1e9;
        self.span_s = (self.span_s.0.min(at_s), self.span_s.1.max(at_s));
        let Some(topic) = message.topic().strip_prefix("/scenecast/") else { return };
        let Some((vehicle, topic)) = topic.split_once('/') else {
            match topic {
                "state" => *last_state = message.decode::<Text>().map(|text| text.data).or(last_state.take()),
                "settings" => {
                    let text = message.decode::<Text>();
                    self.settings = text.and_then(|text| serde_json::from_str(&text.data).ok()).unwrap_or_default();
                }
                "events" => self.events.extend(message.decode().map(|event| (at_s, event))),
                "frames" => {
                    let direction = message.decode::<Frame>().map(|frame| usize::from(frame.direction));
                    if let Some(count) = direction.and_then(|direction| self.frames.get_mut(direction)) {
                        *count += 1;
                    }
                }
                _ => {}
            }
            return;
        };
        let vehicle = self.vehicles.entry(vehicle.to_owned()).or_default();
        match topic {
            "map_cells" => message.decode().iter().for_each(|cells| vehicle.take_cells(cells)),
            "pose" => vehicle.track.extend(message.decode().map(|pose| TrackPoint::of(&pose))),
            "order_status" => message.decode().into_iter().for_each(|status| vehicle.take_order(status)),
            "exemplars" => vehicle.exemplars.extend(message.decode().map(|exemplar| (at_s, exemplar))),
            "link" => vehicle.link.extend(message.decode().map(|link| (at_s, link))),
            _ => {}
        }
    }

    /// The moment of a mission time, seconds since 1970.
    pub(super) fn unix_s(&self, at_s: f64) -> f64 {
        self.span_s.1 - (self.state.now_s - at_s) / self.state.mission.speed.max(1e-3)
    }

    /// The vehicles, as the page showed them last and as the record has them.
    pub(super) fn vehicles(&self) -> impl Iterator<Item = (&VehicleState, &DiveVehicle)> {
        let known = |state: &VehicleState| self.vehicles.get(&valid_part(&state.name));
        self.state.vehicles.iter().filter_map(move |state| Some((state, known(state)?)))
    }
}

impl DiveVehicle {
    fn take_cells(&mut self, cells: &MapCells) {
        if !cells.layer.is_empty() {
            return;
        }
        if !cells.whole && self.cell_m == 0.0 {
            // The first file of the record is gone; the whole map follows.
            return;
        }
        if cells.whole {
            self.labels.clear();
            if self.epoch != cells.epoch {
                // Their numbers mean something else now.
                self.exemplars.clear();
            }
        }
        (self.epoch, self.cell_m) = (cells.epoch, cells.cell_m);
        for ((&x, &y), &value) in cells.x.iter().zip(&cells.y).zip(&cells.value) {
            self.labels.set(Cell::new(x, y), value);
        }
    }

    fn take_order(&mut self, status: OrderStatus) {
        let seconds = |time: &scenecast_messages::builtin_interfaces::Time| time.nanos() as f64 / 1e9;
        let step = OrderStep {
            at_s: seconds(&status.header.stamp),
            given_s: seconds(&status.given),
            status: status.status,
            reason: status.reason,
        };
        let way = self.orders.entry((status.slot, status.version)).or_default();
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

    /// Cells of each label, the label that it is shown as a part of counted with it; the largest first.
    pub(super) fn classes(&self, state: &VehicleState) -> Vec<(u8, u64)> {
        let mut counts: BTreeMap<u8, u64> = BTreeMap::new();
        for (_, label) in self.labels.iter() {
            *counts.entry(state.label_book.shown_as(label)).or_default() += 1;
        }
        let mut classes: Vec<(u8, u64)> = counts.into_iter().collect();
        classes.sort_by_key(|&(label, cells)| (std::cmp::Reverse(cells), label));
        classes
    }
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
