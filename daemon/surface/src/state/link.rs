//! The acoustic link.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The link to all vehicles together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct LinkSummary {
    /// The bit budget of the surface on air, bit/s.
    pub budget_bps: u32,
    /// The window of the budget, a duration.
    pub budget_window_s: f64,
    /// The minimum share of each class, percent.
    pub shares: BTreeMap<String, u8>,
    /// The background streams that use spare capacity, in this order: finer, exemplars, floor and names of layers.
    #[serde(default)]
    pub background: Vec<String>,
    /// Frames that could not be read or came from an unknown vehicle.
    pub unknown_senders: u64,
    /// From the vehicles, as received by the surface.
    pub up: LinkDirection,
    /// To the vehicles, as sent by the surface.
    pub down: LinkDirection,
    /// Two-way travel time to the first vehicle with a measurement, a duration.
    pub round_trip_s: Option<f64>,
    /// Energy of the vehicles' frames divided by the bits of the map in those received, joules; null without any, or if energy
    /// is not counted.
    #[serde(default)]
    pub energy_per_map_bit_j: Option<f64>,
    /// Bits that wait at the vehicles; null while it is unknown.
    pub backlog_bits: Option<u64>,
    /// Rates on air, one every 5 s for the last 20 minutes.
    pub history: Vec<LinkRates>,
}

/// One direction of the link since the start of the surface.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct LinkDirection {
    /// The mean rate on air of the last minute, bit/s.
    pub bps_1min: f64,
    /// The highest rate on air in any window of the budget, bit/s.
    pub max_window_bps: f64,
    /// The share of frames that were lost, 0 to 1.
    pub loss: f64,
    /// Number of frames, lost ones included.
    pub frames: u64,
    /// The number of lost frames.
    pub lost: u64,
    /// The mean rate of useful payload, bit/s.
    pub goodput_bps: f64,
    /// Energy of the senders' modems for all frames, joules, by modem.tx_watts of the surface. For the frames of the vehicles
    /// it is an estimate: that of the received frames, divided by the share of frames that arrive. Null if it is not counted.
    #[serde(default)]
    pub energy_j: Option<f64>,
    /// Bytes by class: directive, status, fix, map, exemplar, overhead, and each layer by its name.
    pub bytes_by_class: BTreeMap<String, u64>,
}

/// The rates on air at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinkRates {
    /// Mission time at the end of the interval, seconds.
    pub t_s: u64,
    /// Rate on air from the vehicles, bit/s.
    pub up_bps: f64,
    /// Rate on air to the vehicles, bit/s.
    pub down_bps: f64,
}

/// Recent measurements of the channel to one vehicle.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct VehicleChannel {
    /// The channel from the vehicle to the surface.
    pub up: ChannelQuality,
    /// The channel from the surface to the vehicle.
    pub down: ChannelQuality,
    /// Two-way travel time, a duration.
    pub round_trip_s: Option<f64>,
    /// One-way travel time, a duration.
    pub one_way_s: Option<f64>,
    /// The clock of the vehicle minus that of the surface, a duration.
    pub clock_offset_s: Option<f64>,
    /// Its frames that the surface dropped, by reason: truncated, version, not_for_us, checksum, malformed, old_session,
    /// duplicate, late, base_missing, unknown_sender, unauthenticated (without a proof of the key), key_missing (under a key
    /// that the surface does not have).
    pub dropped: BTreeMap<String, u64>,
    /// A setting of the vehicle that does not fit that of the surface, or the address of two vehicles. Null if none is known.
    pub mismatch: Option<String>,
    /// The backlog of the vehicle; null before its first report.
    pub backlog: Option<ReportedBacklog>,
}

/// The quality of the channel in one direction.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ChannelQuality {
    /// The share of the last 64 frames that were lost, 0 to 1.
    pub loss: f64,
    /// The mean rate of useful payload in the last minute, bit/s.
    pub goodput_bps: f64,
}

/// The backlog by the last report of the vehicle, less the bits received since.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ReportedBacklog {
    /// When the report was received.
    pub at_s: f64,
    /// Approximate bits that the vehicle still has to send.
    pub bits: u64,
    /// When all of them will have arrived at the goodput of the last minute; null while the goodput is 0.
    pub empty_s: Option<f64>,
    /// The part of these bits that are labels of the map.
    pub map_bits: u64,
    /// The approximate lag of this map behind the vehicle's, a duration: the age of the report plus the time for `map_bits` at the
    /// goodput of the last minute; null while the goodput is 0.
    pub map_lag_s: Option<f64>,
}
