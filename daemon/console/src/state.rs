//! What the API tells: the answers as types, from which the OpenAPI document is made.

mod link;
mod map;

pub use link::{Backlog, Direction, Link, Rates, VehicleLink, Water};
pub use map::{Layer, Map, MapEvent, MapSummary, Placement};

use scenecast_surface::{FenceOrder, LimitsOrder, SettingsOrder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Everything that the page shows but the maps and images themselves. Times end in `_s`: seconds of mission time.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct State {
    /// Mission time now.
    pub now_s: f64,
    /// The mission.
    pub mission: Mission,
    /// The vehicles that the surface speaks with.
    pub vehicles: Vec<Vehicle>,
    /// The surface's GPS; null without one.
    pub position: Option<Position>,
    /// The link as a whole, of all vehicles.
    pub link: Link,
}

/// The surface's GPS, and what became of what it and the USBL head told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Position {
    /// Whether it knows where it is.
    pub is_good: bool,
    /// Metres east in the world.
    pub x_m: Option<f64>,
    /// Metres north in the world.
    pub y_m: Option<f64>,
    /// Standard deviation, metres.
    pub sigma_m: Option<f64>,
    /// Latitude of the last good position.
    pub lat_deg: Option<f64>,
    /// Longitude of the last good position.
    pub lon_deg: Option<f64>,
    /// When that was.
    pub at_s: Option<f64>,
    /// Clockwise from north.
    pub heading_deg: Option<f64>,
    /// What the GPS said and was not used, by reason: checksum, unreadable, overlong, no_position, frozen, jump.
    pub refused: BTreeMap<String, u64>,
    /// Positions beyond its way.
    pub outliers: u64,
    /// Fixes sent to vehicles.
    pub fixes: u64,
    /// What the USBL head saw and was not sent, by reason: unreadable, range_only, depth, no_heading, no_gps, outlier,
    /// too_vague, too_old.
    pub sightings_unused: BTreeMap<String, u64>,
}

/// The mission.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Mission {
    /// Name for people.
    pub name: String,
    /// Another one each run.
    pub id: String,
    /// Mission seconds a second.
    pub speed: f64,
    /// Whether the survey is over.
    pub ended: bool,
    /// Where x = y = 0 lies on the Earth; null if nobody has said so.
    pub origin: Option<Origin>,
}

/// A place on the Earth, WGS 84.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Origin {
    /// Latitude, north positive.
    pub lat_deg: f64,
    /// Longitude, east positive.
    pub lon_deg: f64,
}

/// A vehicle as the surface knows it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Vehicle {
    /// Acoustic address.
    #[schemars(range(min = 1, max = 14))]
    pub id: u8,
    /// Name for people.
    pub name: String,
    /// When a frame was last taken.
    pub heard_s: Option<f64>,
    /// The longest pause between two frames that is usual, a duration: three times that is silence.
    pub expected_interval_s: f64,
    /// When the next turn is granted at the latest.
    pub next_contact_s: Option<f64>,
    /// What the vehicle said last; null before the first.
    pub status: Option<Status>,
    /// Time, metres east and north of each status, the last 500.
    pub track: Vec<(f64, f64, f64)>,
    /// The map, without its cells.
    pub map: MapSummary,
    /// The utility that was sent last, besides the weights of the labels.
    pub utility: Utility,
    /// The fence that was sent last; null before.
    pub fence: Option<FenceOrder>,
    /// The limits that were sent last; null before.
    pub limits: Option<LimitsOrder>,
    /// The fence that the vehicle said last to have in force, of those that this surface sent; null before.
    pub fence_in_force: Option<InForce<FenceOrder>>,
    /// The limits that the vehicle said last to have in force, of those that this surface sent; null before.
    pub limits_in_force: Option<InForce<LimitsOrder>>,
    /// The planner that was sent last; null: as configured on the vehicle.
    pub planner: Option<String>,
    /// Settings that were asked for, and those in force.
    pub settings: VehicleSettings,
    /// The labels on the map.
    pub labels: Vec<Label>,
    /// What was measured of the water to this vehicle.
    pub link: VehicleLink,
    /// Where the surface's modem found the vehicle last; null before the first.
    pub usbl: Option<Usbl>,
    /// What was ordered and how far that has come.
    pub directive: Directive,
}

/// Settings of a vehicle. Null members stay as this surface found them; 0 or an empty text is as the vehicle is configured.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VehicleSettings {
    /// All that this surface has asked for.
    pub asked: SettingsOrder,
    /// What of that the vehicle has said to follow; null while nobody knows, since an order was overtaken on its way.
    pub in_force: Option<SettingsOrder>,
}

/// Where the surface's modem found a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Usbl {
    /// When.
    pub at_s: f64,
    /// Slant range; null if only directions are known.
    pub range_m: Option<f64>,
    /// Clockwise from north; null if only the range is good.
    pub bearing_rad: Option<f64>,
    /// Above the horizontal; null if only the range is good.
    pub elevation_rad: Option<f64>,
    /// Metres, of directions alone radians.
    pub accuracy: f64,
}

/// What a vehicle said of itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Status {
    /// When it came in.
    pub at_s: f64,
    /// Metres east on its own map, as all places that it tells: the map's placement moves them into the world.
    pub x_m: f64,
    /// Metres north.
    pub y_m: f64,
    /// Metres up: the depth with a minus.
    pub z_m: f64,
    /// Heading, clockwise from north.
    pub heading_deg: f64,
    /// Standard deviation of the position, metres.
    pub sigma_m: f64,
    /// What it does.
    pub mode: Mode,
    /// Whether its autopilot does not answer, so that nobody carries out what the mode says.
    pub autopilot_silent: bool,
    /// Why, if not because the survey asks for it: order, fence, distance, time, silence, depth or altitude, no way.
    pub reason: Option<String>,
    /// Mode and reason in words, as in "holding: fence".
    pub doing: String,
    /// Where it is going, metres east and north on its own map.
    pub waypoint: Option<(f64, f64)>,
    /// Where it plans to go from the waypoint, each at the end of a straight leg, metres east and north on its own map; at
    /// most 7. Empty if it plans no further, or if its bits tell no more.
    pub path: Vec<(f64, f64)>,
    /// Whether its plan has more waypoints than these.
    pub path_goes_on: bool,
    /// Cells that it has explored.
    pub cells: u32,
    /// Labels that it knows.
    pub labels: u32,
    /// Seconds since its last position fix.
    pub fix_age_s: Option<f64>,
    /// Its own budget in force, bits a second, with 12 bits of precision.
    pub budget_bps: u32,
    /// Frames that it refused for want of authenticity; 255 is that or more.
    pub refused_frames: u32,
}

/// What a vehicle does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// It surveys.
    Survey,
    /// It stays.
    Hold,
    /// It returns.
    Return,
    /// It surfaces.
    Surface,
    /// It has aborted.
    Abort,
    /// Its survey is over.
    Done,
}

/// The utility beside the weights.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Utility {
    /// Weight of unseen cells, -1 to 1.
    pub exploration: f64,
    /// Weight of cells that the scene model explains badly, -1 to 1.
    pub curiosity: f64,
}

/// A label on the map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Label {
    /// Label id.
    #[schemars(range(min = 1, max = 254))]
    pub id: u8,
    /// Cells that have it.
    pub cells: u32,
    /// Their area, square metres.
    pub area_m2: f64,
    /// Weight that was sent last, -1 to 1.
    pub weight: f64,
    /// The image of it.
    pub exemplar: Exemplar,
}

/// How far the image of a label has come.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Exemplar {
    /// How far what is asked for is; without a request whether there is one.
    pub state: ExemplarState,
    /// Of what is asked for, 0 to 1.
    pub progress: f64,
    /// Bytes of what is coming, or of the newest image that is here.
    pub bytes: Option<usize>,
    /// Where the newest image is, if there is one.
    pub url: Option<String>,
    /// When this last changed.
    pub at_s: Option<f64>,
    /// The images that are here, the newest last; at most 8.
    pub pictures: Vec<Picture>,
}

/// An image of a label that is here.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Picture {
    /// Its number among those of the label.
    #[schemars(range(min = 1, max = 63))]
    pub picture: u8,
    /// Edge, pixels.
    pub edge_px: u32,
    /// Whether a larger one can be asked for.
    pub can_grow: bool,
    /// Bytes that came over the water.
    pub bytes: usize,
    /// Where it is.
    pub url: String,
    /// When it came.
    pub at_s: f64,
    /// Whether somebody had asked for it; else the vehicle had bits left over.
    pub asked: bool,
}

/// How far an image has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExemplarState {
    /// Nobody has asked.
    None,
    /// The request waits for its turn.
    Queued,
    /// The request is under way.
    OnAir,
    /// The vehicle has no such image yet, and sends it when it has.
    NoneYet,
    /// The image is coming.
    Coming,
    /// The image is here.
    Here,
    /// The vehicle refused the request.
    Refused,
}

/// What was ordered.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Directive {
    /// The newest version of each slot that was issued.
    pub slots: Vec<Slot>,
}

/// An order that the vehicle obeys, also while a newer one is on its way or after one was refused.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InForce<T> {
    /// Its version.
    pub version: u16,
    /// The order.
    pub order: T,
}

/// A slot of the directive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Slot {
    /// Name: utility, requests, constraints, fix, budget and so on.
    pub slot: String,
    /// Counts up with each order.
    pub version: u16,
    /// How far it has come.
    pub state: LifeLine,
    /// Why the vehicle refused it.
    pub reason: Option<String>,
    /// When it was ordered.
    pub issued_s: f64,
    /// When `state` last changed.
    pub changed_s: f64,
}

/// How far an order has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LifeLine {
    /// It waits for its turn on the link.
    Queued,
    /// It was sent.
    OnAir,
    /// The vehicle has it.
    Heard,
    /// The vehicle says that it is in force.
    Applied,
    /// The vehicle refused it.
    Refused,
}

/// An order was taken and waits for its turn on the link; what becomes of it is in `directive.slots` of the state.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Accepted {
    /// The slot of the directive that carries it.
    pub slot: String,
    /// Its version, if it goes to one vehicle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub version: Option<u16>,
    /// Its version at each vehicle that it goes to, by address.
    pub versions: BTreeMap<u8, u16>,
}

/// Why not.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Refusal {
    /// One line for people.
    pub error: String,
}
