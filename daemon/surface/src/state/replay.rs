//! The replay of a record.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The moment of a record that is shown. Times are in seconds since 1970, UTC.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplayState {
    /// The first moment of the record.
    pub from_utc_s: f64,
    /// The last moment of the record.
    pub to_utc_s: f64,
    /// The moment that is shown.
    pub at_utc_s: f64,
    /// Whether the record is played.
    pub is_playing: bool,
    /// Recorded seconds for each second.
    pub speed: f64,
    /// Seconds of mission time for each recorded second.
    pub mission_speed: f64,
    /// The end of the link whose knowledge is shown.
    pub side: ReplaySide,
    /// What the given records can show.
    pub sides: Vec<ReplaySide>,
    /// In how many cells the maps of both sides differ at this moment, where both are known.
    pub differing_cells: Vec<DifferingCells>,
    /// Why parts of the records could not be read; a line for people each.
    #[serde(default)]
    pub damage: Vec<String>,
}

/// Whose knowledge a replay shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReplaySide {
    /// What the operator knew at that moment.
    Operator,
    /// What the vehicle knew at that moment.
    Vehicle,
    /// What the operator knew, and on the map the cells alone in which the vehicle's map differs: with its label, or with the
    /// operator's where the vehicle has none.
    Difference,
}

impl ReplaySide {
    /// The name in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Operator => "operator",
            Self::Vehicle => "vehicle",
            Self::Difference => "difference",
        }
    }
}

/// The cells in which two maps of a vehicle differ.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DifferingCells {
    /// Acoustic address of the vehicle, 1 to 14.
    pub vehicle: u8,
    pub cells: u32,
}

/// The events of a record.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ReplayEventList {
    /// In the order of their times; at most 5000.
    pub events: Vec<ReplayEvent>,
}

/// An event of a record.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReplayEvent {
    /// The time of the event, seconds since 1970, UTC.
    pub at_utc_s: f64,
    /// order, silence, mode, label, image, record, command, fault, refused, loop or vehicle.
    pub kind: String,
    /// The address of the vehicle; null if the event concerns the surface or all vehicles.
    pub vehicle: Option<u8>,
    /// The event in one line, for people.
    pub text: String,
}

/// A change of the replay. An absent member stays as it is.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReplayOrder {
    /// The moment to show, seconds since 1970, UTC.
    pub at_utc_s: Option<f64>,
    /// Whether to play the record; otherwise its moment stands.
    pub is_playing: Option<bool>,
    /// Recorded seconds for each second.
    #[schemars(range(min = 0.1, max = 1000))]
    pub speed: Option<f64>,
    /// The end of the link whose knowledge to show.
    pub side: Option<ReplaySide>,
}
