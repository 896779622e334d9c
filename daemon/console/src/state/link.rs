//! What is told of the link.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The link as a whole.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Link {
    /// Bits on air a second that the surface may send.
    pub budget_bps: u32,
    /// Window of the budget, a duration.
    pub budget_window_s: f64,
    /// Least shares of the classes in percent.
    pub shares: BTreeMap<String, u8>,
    /// What bits that nobody else needs are spent on, in this order: finer, depth, exemplars, confidence,
    /// curiosity.
    #[serde(default)]
    pub background: Vec<String>,
    /// Frames of no known vehicle, or unreadable.
    pub strangers: u64,
    /// From the vehicles, as the surface heard it.
    pub up: Direction,
    /// To the vehicles, as the surface sent it.
    pub down: Direction,
    /// Two-way travel time to the first vehicle that has one, a duration.
    pub round_trip_s: Option<f64>,
    /// Bits that wait at the vehicles; null where nobody knows.
    pub backlog_bits: Option<u64>,
    /// Rates on air, every 5 s, the last 20 minutes.
    pub history: Vec<Rates>,
}

/// One direction of the link, since the surface began.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Direction {
    /// Bits on air a second, over a minute.
    pub bps_1min: f64,
    /// Most bits on air a second over any window of the budget.
    pub worst_window_bps: f64,
    /// Share of frames that was lost, 0 to 1.
    pub loss: f64,
    /// Frames.
    pub frames: u64,
    /// Frames that were lost.
    pub lost: u64,
    /// Useful bits a second.
    pub goodput_bps: f64,
    /// Bytes by class: directive, status, fix, map, exemplar, confidence, depth, curiosity, overhead.
    pub bytes_by_class: BTreeMap<String, u64>,
}

/// Rates on air.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rates {
    /// When.
    pub t_s: u64,
    /// From the vehicles, bits a second.
    pub up_bps: f64,
    /// To the vehicles, bits a second.
    pub down_bps: f64,
}

/// What was measured of the water to one vehicle lately.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleLink {
    /// From the vehicle.
    pub up: Water,
    /// To the vehicle.
    pub down: Water,
    /// Two-way travel time, a duration.
    pub round_trip_s: Option<f64>,
    /// One-way travel time, a duration.
    pub one_way_s: Option<f64>,
    /// The vehicle's clock minus the surface's.
    pub clock_ahead_s: Option<f64>,
    /// Frames from it that the surface dropped, by reason: truncated, version, not_for_us, checksum, malformed,
    /// old_session, duplicate, late, no_base, stranger, unauthenticated (no proof of the key), keyed (under a key, and
    /// here is none).
    pub dropped: BTreeMap<String, u64>,
    /// What the vehicle has still to send; null before it has said so.
    pub backlog: Option<Backlog>,
}

/// One direction of the water.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Water {
    /// Share of the last 64 frames that was lost, 0 to 1.
    pub loss: f64,
    /// Useful bits a second, over a minute.
    pub goodput_bps: f64,
}

/// What a vehicle has still to send: what it said last, less what has come in since.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Backlog {
    /// When it said so.
    pub at_s: f64,
    /// Bits that wait, about.
    pub bits: u64,
    /// When all of it will be here at the goodput of the last minute; null while nothing comes in.
    pub empty_s: Option<f64>,
    /// Of these bits, labels of the map: by so much the map here lags behind the vehicle's.
    pub map_bits: u64,
    /// About how old the map here is against the vehicle's, a duration: the age of what the vehicle said, and what `map_bits`
    /// take at the goodput; null while nothing comes in.
    pub map_lag_s: Option<f64>,
}
