//! The log of the mission.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The log of the mission: its last 2000 entries at most.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct LogList {
    /// The entries, the oldest first.
    pub entries: Vec<LogLine>,
}

/// An entry of the log.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LogLine {
    /// One more than that of the entry before.
    pub number: u64,
    /// Mission time.
    pub at_s: f64,
    /// The same time in UTC by the clock of the surface's computer (RFC 3339).
    pub utc: String,
    /// The address of the vehicle; null if the entry concerns the surface or all vehicles.
    pub vehicle: Option<u8>,
    /// order, answer, contact, mode, label, image, record or command.
    pub kind: String,
    /// The principal who caused it; null for the surface and the vehicle.
    pub by: Option<String>,
    /// One line for people.
    pub text: String,
}
