//! The state of the surface as others see it: the types of what the API replies, from which the OpenAPI document is made.

mod command;
mod labels;
mod link;
mod map;
mod plan;
mod replay;
mod storage;
mod vehicle;

pub use command::{
    CommandChangeName, CommandChangeState, CommandHolderState, CommandRequestState, CommandState, PrincipalInfo,
    PrincipalRole,
};
pub use labels::{ExemplarImage, ExemplarProgress, ExemplarStage, MapLabel, MapLabelTree};
pub use link::{ChannelQuality, LinkDirection, LinkRates, LinkSummary, ReportedBacklog, VehicleChannel};
pub use map::{CellHistory, EarlierMap, FormerLabel, MapPlacement, MapSummary};
pub use plan::{DryRun, FavouredTime, FirstTarget, LegReason, PlanAims, PlanLeg, SurveyPass};
pub use replay::{DifferingCells, ReplayEvent, ReplayEventList, ReplayOrder, ReplaySide, ReplayState};
pub use storage::{ArchivedMap, StorageInfo, VehicleMarker, VehicleNote};
pub use vehicle::{
    AppliedOrder, DirectiveSlots, InForceKnowledge, OrderProgress, OrderStatus, OtherSurface, PlannedPath,
    ReportedDisk, ReportedFault, ReportedMode, ReportedPose, ReportedRegistration, ReportedTie, StatusReport,
    UsblMeasurement, UtilityTerms, VehicleOrders, VehicleSettings, VehicleState, WeightDraft,
};
pub use vehicle::{FloorImage, FloorList, FloorSummary};

use scenecast_protocol::time::Instant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Mission time in the API, rounded to a hundredth of a second.
pub fn seconds(at: Instant) -> f64 {
    (at.as_secs_f64() * 100.0).round() / 100.0
}

/// Everything that the page shows, except maps and images. A member that ends in `_s` is a mission time in seconds,
/// unless it is called a duration.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MissionState {
    /// The mission time of this state.
    pub now_s: f64,
    /// The time of day at that moment by the surface's clock, seconds since 1970; null before it is known.
    #[serde(default)]
    pub utc_s: Option<f64>,
    /// Name, origin and end of the mission.
    pub mission: MissionInfo,
    /// The vehicles that the surface exchanges frames with, by address.
    pub vehicles: Vec<VehicleState>,
    /// The position of the surface; null without a GPS.
    pub position: Option<SurfacePosition>,
    /// The link to all vehicles together.
    pub link: LinkSummary,
    /// Who has command, who requests it, and its last changes.
    #[serde(default)]
    pub command: CommandState,
    /// The layers that an operator can name in settings and in the order of the background streams.
    #[serde(default)]
    pub layers: Vec<LayerInfo>,
    /// The folder in which the surface keeps its state; null in a rehearsal.
    #[serde(default)]
    pub storage: Option<StorageInfo>,
    /// The number of the last entry of the log; 0 before the first.
    #[serde(default)]
    pub log: u64,
    /// The true classes of a simulated sea floor; null where they are not known, and so in each real mission.
    #[serde(default)]
    pub truth: Option<TruthInfo>,
    /// The moment of the record that is shown; null for a live surface.
    #[serde(default)]
    pub replay: Option<ReplayState>,
}

/// The true classes of a part of a simulated sea floor, of which `/api/v2/truth.png` is the picture. No vehicle knows them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TruthInfo {
    /// The western edge of the picture in the world frame, metres.
    pub west_m: f64,
    /// The southern edge in the world frame, metres.
    pub south_m: f64,
    /// The eastern edge in the world frame, metres.
    pub east_m: f64,
    /// The northern edge in the world frame, metres.
    pub north_m: f64,
    /// The classes in the picture.
    pub classes: Vec<TrueClass>,
}

/// A true class of a simulated sea floor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct TrueClass {
    /// The value of its pixels.
    pub value: u8,
    /// Its name, such as "seagrass".
    pub name: String,
    /// The colour of its pixels, such as "#e69f00".
    pub colour: String,
}

/// A layer of the map that vehicles can send in addition to the labels.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct LayerInfo {
    /// The name of the layer, from its descriptor.
    pub name: String,
    /// The unit of its values; empty if they have none.
    pub unit: String,
    /// One sentence on its meaning; empty for a layer that only a vehicle knows.
    pub summary: String,
}

/// The position of the surface by GPS, and counts of GPS and USBL measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurfacePosition {
    /// Whether the position is recent and plausible.
    pub is_valid: bool,
    /// Metres east in the world frame.
    pub x_m: Option<f64>,
    /// Metres north in the world frame.
    pub y_m: Option<f64>,
    /// Standard deviation of the position, metres.
    pub sigma_m: Option<f64>,
    /// Latitude of the last valid position.
    pub lat_deg: Option<f64>,
    /// Longitude of the last valid position.
    pub lon_deg: Option<f64>,
    /// Mission time of the last valid position.
    pub at_s: Option<f64>,
    /// Heading in degrees clockwise from north.
    pub heading_deg: Option<f64>,
    /// GPS sentences that were not used, by reason: checksum, malformed, too_long, no_position, frozen, jump.
    pub rejected: BTreeMap<String, u64>,
    /// Positions that contradict the surface's own motion.
    pub outliers: u64,
    /// Position fixes sent to vehicles.
    pub fixes_sent: u64,
    /// USBL measurements that were not used, by reason: malformed, range_only, depth,
    /// no_heading, no_gps, outlier, too_uncertain, too_old.
    pub usbl_rejected: BTreeMap<String, u64>,
}

/// Facts of the mission that stay the same while it runs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MissionInfo {
    /// The name that people use.
    pub name: String,
    /// A random name of this run of the surface.
    pub id: String,
    /// Seconds of mission time for each second of the clock.
    pub speed: f64,
    /// Whether the survey has ended.
    pub ended: bool,
    /// Mission time at which it ended, seconds; null before.
    pub ended_s: Option<f64>,
    /// The place of x = y = 0 on the Earth; null while it is unknown.
    pub origin: Option<Origin>,
}

/// A place on the Earth, WGS 84.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Origin {
    /// Latitude in degrees, WGS 84, north positive.
    pub lat_deg: f64,
    /// Longitude in degrees, WGS 84, east positive.
    pub lon_deg: f64,
}

/// The receipt of an order that waits for its turn on the link. `directive.slots` of the state shows its progress.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct AcceptedOrder {
    /// The slot of the directive that carries it.
    pub slot: String,
    /// What is ordered: hold, resume or abort in the slot constraints, which they share; else as the slot.
    pub name: String,
    /// Its version, if it goes to one vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Its version at each vehicle that it goes to, by address.
    pub versions: BTreeMap<u8, u16>,
}
