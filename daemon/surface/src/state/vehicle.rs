//! A vehicle as the surface knows it.

use super::labels::{MapLabel, MapLabelTree};
use super::link::VehicleChannel;
use super::map::MapSummary;
use super::plan::{FavouredTime, PlanAims};
use super::storage::{VehicleMarker, VehicleNote};
use crate::{AreasOrder, DestinationOrder, FenceOrder, LabelBook, LimitsOrder, SettingsOrder};
use scenecast_protocol::wire::VehicleMode;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A vehicle as the surface knows it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VehicleState {
    /// Acoustic address of the vehicle, 1 to 14.
    #[schemars(range(min = 1, max = 14))]
    pub id: u8,
    /// The name that people use.
    pub name: String,
    /// When the last valid frame was received; null before the first.
    pub last_received_s: Option<f64>,
    /// The longest usual pause between two frames, a duration. A vehicle is silent after three times this pause.
    pub expected_interval_s: f64,
    /// When the surface grants the next turn at the latest.
    pub next_contact_s: Option<f64>,
    /// Another surface with the same key that holds the vehicle, or has called it in the last minutes; null if there is none.
    #[serde(default)]
    pub other_surface: Option<OtherSurface>,
    /// The last report of the vehicle; null before the first.
    pub status: Option<StatusReport>,
    /// What its reported plan is for, by the map at the surface; null without a plan.
    #[serde(default)]
    pub aims: Option<PlanAims>,
    /// How much of its time it is over floor of favoured labels; null without weights that favour any.
    #[serde(default)]
    pub favoured_time: Option<FavouredTime>,
    /// Mission time, metres east and metres north on the vehicle's map of the last 500 reports.
    pub track: Vec<(f64, f64, f64)>,
    /// How its last camera frames were placed on the map; null if the vehicle never reported it.
    #[serde(default)]
    pub registration: Option<ReportedRegistration>,
    /// Mission time, metres east and metres north on the vehicle's map of the last 500 reports from a place at which a frame
    /// overlapped with an earlier track.
    #[serde(default)]
    pub closed_loops: Vec<(f64, f64, f64)>,
    /// The map without its cells.
    pub map: MapSummary,
    /// The labels on the map.
    pub labels: Vec<MapLabel>,
    /// What the operator says of labels, also of those that have no cells.
    #[serde(default)]
    pub label_book: LabelBook,
    /// Which of them become one at coarser cuts; null if the vehicle has not sent it.
    #[serde(default)]
    pub label_tree: Option<MapLabelTree>,
    /// The images of the sea floor itself, which the vehicle sends with spare capacity.
    #[serde(default)]
    pub floor: FloorSummary,
    /// Measurements of the channel to this vehicle.
    pub link: VehicleChannel,
    /// The last USBL measurement of the vehicle; null before the first.
    pub usbl: Option<UsblMeasurement>,
    /// Notes about the vehicle, the newest last; at most 200.
    #[serde(default)]
    pub notes: Vec<VehicleNote>,
    /// Markers on the map, in the order of their numbers; at most 200.
    #[serde(default)]
    pub markers: Vec<VehicleMarker>,
    /// The weights that an operator has set and not sent.
    #[serde(default)]
    pub draft: WeightDraft,
    /// The orders to the vehicle.
    #[serde(flatten)]
    pub orders: VehicleOrders,
}

/// The images of the sea floor without their addresses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FloorSummary {
    /// How many there are; at most 4096.
    pub images: usize,
    /// The bytes of all.
    pub bytes: usize,
    /// The number of the last image that arrived: microseconds of mission time.
    pub version: u64,
    /// The epoch of the map that they lie on; of another one there are none any more.
    pub epoch: u8,
}

/// The images of the sea floor that have arrived, or those after a version.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct FloorList {
    /// The number of the last image.
    pub version: u64,
    /// In the order of arrival.
    pub images: Vec<FloorImage>,
}

/// A square image of the sea floor, north up. It replaces an earlier one with the same middle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FloorImage {
    /// Path of the image on this server.
    pub url: String,
    /// Its middle on the vehicle's map, metres east.
    pub x_m: f64,
    /// Its middle on the vehicle's map, metres north.
    pub y_m: f64,
    /// How wide it is on the sea floor, metres.
    pub width_m: f64,
    /// Mission time of its arrival, seconds.
    pub at_s: f64,
    /// Mission time of the latest camera frame in it, seconds; null where it is not known.
    pub taken_s: Option<f64>,
}

/// Another surface with the same key.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OtherSurface {
    /// Its name; empty if it has none.
    pub name: String,
    /// Whether the vehicle obeys it, and refuses this surface. Otherwise it has called the vehicle that this surface holds.
    pub holds: bool,
    /// When the vehicle last heard it, as far as this surface knows.
    pub heard_s: f64,
    /// Whether the vehicle has not heard it for so long that every operator may take the vehicle over.
    pub is_silent: bool,
    /// Whether this surface takes the vehicle over, and the vehicle has not followed yet.
    pub is_taken_over: bool,
}

/// Weights that an operator has set and not sent. Those that are not listed are as last sent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct WeightDraft {
    /// Grows with each change; 0 before the first.
    pub number: u32,
    /// -1 to 1 by label.
    pub weights: BTreeMap<u8, f64>,
    /// The weight of unexplored cells.
    pub exploration: Option<f64>,
    /// The weight of cells that the scene model explains badly.
    pub curiosity: Option<f64>,
    /// Mission time of the last change.
    pub at_s: f64,
    /// The name of the person or program that made it.
    pub author: String,
}

/// The orders to a vehicle: last sent, in force, and on their way.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VehicleOrders {
    /// The last utility sent, without the weights of the labels.
    pub utility: UtilityTerms,
    /// The last fence sent, or the one in force if this surface sent none; null before the first.
    pub fence: Option<FenceOrder>,
    /// The last limits sent, or those in force if this surface sent none; null before the first.
    pub limits: Option<LimitsOrder>,
    /// The fence that the vehicle reported last as in force, with version 0 if another surface has sent it; null if it is
    /// unknown.
    pub fence_in_force: Option<AppliedOrder<FenceOrder>>,
    /// The limits that the vehicle reported last as in force, with version 0 if another surface has sent them; null if they
    /// are unknown.
    pub limits_in_force: Option<AppliedOrder<LimitsOrder>>,
    /// The last weighted areas sent, or those in force if this surface sent none; null before the first.
    pub areas: Option<AreasOrder>,
    /// The areas that the vehicle reported last as in force, with version 0 if another surface has sent them; null if they
    /// are unknown.
    pub areas_in_force: Option<AppliedOrder<AreasOrder>>,
    /// The last destination sent, or the one in force if this surface sent none; null before the first.
    pub destination: Option<DestinationOrder>,
    /// The destination to which the vehicle has yet to go, with version 0 if another surface has sent it; null if there is
    /// none, or if it is unknown.
    pub destination_in_force: Option<AppliedOrder<DestinationOrder>>,
    /// The last planner sent; null means as configured on the vehicle.
    pub planner: Option<String>,
    /// Settings requested and in force.
    pub settings: VehicleSettings,
    /// What the surface knows of the content in force, by slot: utility, settings, budget, limits, fence, destination and
    /// areas.
    pub in_force: BTreeMap<String, InForceKnowledge>,
    /// The status of each order.
    pub directive: DirectiveSlots,
}

/// What the surface knows of the content in force of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InForceKnowledge {
    /// The vehicle has not reported it since the surface or the vehicle started.
    NotReported,
    /// The vehicle reports that there is none.
    None,
    /// The surface has the content that the vehicle reports.
    Known,
    /// The vehicle reports a content that the surface does not have; the surface asks for it.
    Unknown,
}

/// Settings of a vehicle. A null member is one that this surface has not set; 0 or an empty text means
/// as configured on the vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VehicleSettings {
    /// All that this surface has requested.
    pub requested: SettingsOrder,
    /// The part that the vehicle has applied; null while it is unknown, since an order was replaced on its way.
    pub in_force: Option<SettingsOrder>,
}

/// A measurement of a vehicle by the modem of the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UsblMeasurement {
    /// Mission time of the measurement.
    pub at_s: f64,
    /// Slant range; null if only the direction was measured.
    pub range_m: Option<f64>,
    /// Clockwise from north; null if only the range is valid.
    pub bearing_rad: Option<f64>,
    /// Above the horizontal; null if only the range is valid.
    pub elevation_rad: Option<f64>,
    /// Metres; radians if only the direction was measured.
    pub accuracy: f64,
}

/// A report of a vehicle. Places are on its own map; the map's placement moves them into the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StatusReport {
    /// When the report was received.
    pub at_s: f64,
    /// Position and heading in the reported pose.
    #[serde(flatten)]
    pub pose: ReportedPose,
    /// The mode of the vehicle.
    pub mode: ReportedMode,
    /// Whether its autopilot does not answer, so that the mode is not carried out.
    pub autopilot_silent: bool,
    /// The reason for the mode, unless it is the survey: order, fence, distance, time, silence, depth or altitude, no path.
    pub reason: Option<String>,
    /// Mode with its reason or purpose as a text, such as "holding: fence", "surveying: looking for label 5" or, at the end of the
    /// plan, "holding: nothing of interest is left".
    pub activity: String,
    /// The planned path of the vehicle, where reported.
    #[serde(flatten)]
    pub plan: PlannedPath,
    /// Cells that it has explored.
    pub cells: u32,
    /// Labels that it has found.
    pub labels: u32,
    /// Its own budget in force, bit/s, with 12 bits of precision.
    pub budget_bps: u32,
    /// Frames that it rejected since they were not authentic; 255 stands for 255 or more.
    pub refused_frames: u32,
    /// The disk with its files; null if it has not reported one.
    #[serde(default)]
    pub disk: Option<ReportedDisk>,
    /// The equipment that fails, the gravest first.
    #[serde(default)]
    pub faults: Vec<ReportedFault>,
}

/// A fault of a vehicle's equipment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReportedFault {
    /// The fault in a few words, such as "no image comes in".
    pub text: String,
    /// Whether the survey does not proceed with it as planned.
    pub is_grave: bool,
}

/// How a vehicle's last camera frames were placed on its map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReportedRegistration {
    /// When the report came in.
    pub at_s: f64,
    /// What placed the last frame.
    pub tie: ReportedTie,
    /// The part of the last 32 frames that images placed, 0 to 1.
    pub share: f64,
    /// Standard deviation of the last frame's place against earlier parts of the map, metres; at most 5.1.
    pub sigma_m: f64,
    /// Frames that closed a loop since the start of the mission; at most 65535.
    pub closed: u16,
}

/// What placed a camera frame on the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportedTie {
    /// Odometry and compass alone: the image shows no overlap with an earlier one.
    Odometry,
    /// The overlap with the frame before.
    FrameBefore,
    /// The overlap with a frame of an earlier track.
    EarlierTrack,
    /// Odometry and compass alone: the registration of frames is off.
    Off,
}

/// The disk with a vehicle's files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ReportedDisk {
    /// Whether its journal cannot be written: it obeys hold and abort from memory and refuses other orders.
    pub journal_refused: bool,
    /// Whether the checkpoint of its scene model cannot be written: a restart would lose the part since the last one.
    pub checkpoint_refused: bool,
    /// Free space is at least this and less than twice this, bytes; 0 is less than 1048576. Null if unknown.
    pub free_bytes: Option<u64>,
}

/// The position and the heading of a vehicle by its own estimate, on its own map.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ReportedPose {
    /// Metres east in the vehicle's map frame.
    pub x_m: f64,
    /// Metres north in the vehicle's map frame.
    pub y_m: f64,
    /// Metres up, so the depth is negative.
    pub z_m: f64,
    /// Heading in degrees clockwise from north.
    pub heading_deg: f64,
    /// Standard deviation of the position, metres.
    pub sigma_m: f64,
    /// Seconds since its last position fix, a duration.
    pub fix_age_s: Option<f64>,
}

/// The waypoints that a vehicle plans, on its own map.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct PlannedPath {
    /// The next waypoint, metres east and north.
    pub waypoint: Option<(f64, f64)>,
    /// The waypoints that it plans after the next one, at most 7, with straight legs between them, metres east and north. Empty
    /// if the plan ends or the report has no room.
    pub path: Vec<(f64, f64)>,
    /// Whether the plan has more waypoints than these.
    pub path_continues: bool,
}

/// The mode of a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportedMode {
    /// The vehicle follows its survey plan.
    Survey,
    /// The vehicle holds its position.
    Hold,
    /// It returns to the return point.
    Return,
    /// The vehicle ascends to the surface.
    Surface,
    /// It has aborted the mission.
    Abort,
    /// The survey of the vehicle is complete.
    Done,
}

impl From<VehicleMode> for ReportedMode {
    fn from(mode: VehicleMode) -> Self {
        match mode {
            VehicleMode::Survey => Self::Survey,
            VehicleMode::Hold => Self::Hold,
            VehicleMode::Return => Self::Return,
            VehicleMode::Surface => Self::Surface,
            VehicleMode::Abort => Self::Abort,
            VehicleMode::Done => Self::Done,
        }
    }
}

/// The utility; in the API without the weights of labels.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct UtilityTerms {
    /// Weight of unexplored cells, -1 to 1.
    pub exploration: f64,
    /// Weight of cells that the scene model explains badly, -1 to 1.
    pub curiosity: f64,
    /// The weights of labels as they were sent, for the record; the API has those of labels on the map, at the labels.
    #[serde(skip)]
    pub weights: BTreeMap<u8, f64>,
}

/// The orders of a vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct DirectiveSlots {
    /// The latest version of each slot with an order.
    pub slots: Vec<OrderProgress>,
}

/// An order that the vehicle has applied. It stays in force while a newer one is on its way, and after a newer one was refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AppliedOrder<T> {
    /// Version of the order, which the vehicle acknowledges.
    pub version: u16,
    /// The order as the operator gave it.
    pub order: T,
}

/// The progress of the latest order in a slot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OrderProgress {
    /// The slot: utility, requests, constraints, fix, budget and others.
    pub slot: String,
    /// What is ordered: hold, resume or abort in the slot constraints, which they share; else as the slot.
    pub name: String,
    /// A number that grows with each order.
    pub version: u16,
    /// The status of the order.
    pub state: OrderStatus,
    /// Why the vehicle refused it, or why it was withdrawn.
    pub reason: Option<String>,
    /// Whether the operator has to decide if a withdrawn order is given again.
    #[serde(default)]
    pub asks: bool,
    /// Mission time of the order, seconds.
    pub issued_s: f64,
    /// Mission time of the last change of `state`, seconds.
    pub changed_s: f64,
}

/// How far an order has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OrderStatus {
    /// It waits for its turn on the link.
    Queued,
    /// The order was sent and is not yet acknowledged.
    OnAir,
    /// The vehicle has received it.
    Received,
    /// The vehicle reports that it is in force.
    Applied,
    /// The vehicle refused the order; `reason` is why.
    Refused,
    /// The surface sends it no more; `reason` is why.
    Withdrawn,
}

impl OrderStatus {
    /// Whether the vehicle's decision is not known yet.
    pub fn is_pending(self) -> bool {
        matches!(self, Self::Queued | Self::OnAir | Self::Received)
    }
}
