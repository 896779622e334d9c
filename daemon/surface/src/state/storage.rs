//! The files of the surface: the state of their disk, archived maps, markers and notes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The folder in which the surface keeps its state.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct StorageInfo {
    /// The folder of the files, as in `runtime.state_dir`.
    pub folder: String,
    /// Free space of its disk in bytes; null if unknown.
    pub free_bytes: Option<u64>,
    /// Writes that failed since the start of the surface.
    pub write_errors: u64,
    /// Why the last write failed, until one succeeds again: meanwhile the state is in memory only.
    pub failing: Option<String>,
}

/// A map of a run that has ended. Its files are under `/api/v2/archive/{name}/`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ArchivedMap {
    /// The name of its file, without the ending.
    pub name: String,
    /// Acoustic address of the vehicle, 1 to 14.
    #[schemars(range(min = 1, max = 14))]
    pub vehicle: u8,
    /// The name of the vehicle that people use.
    pub vehicle_name: String,
    /// Counts the runs of the vehicle that this surface has met, from 1.
    pub run: u32,
    /// Labels have the same meaning within an epoch.
    pub epoch: u8,
    /// The number of its cells with a label.
    pub cells: u64,
    /// Mission time at which it was archived; negative before the start of this mission's clock.
    pub ended_s: f64,
}

/// A marker on a vehicle's map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleMarker {
    /// Its number among the markers of this vehicle's map.
    pub number: u32,
    /// Metres east of the origin in the world frame.
    pub x_m: f64,
    /// Metres north of the origin in the world frame.
    pub y_m: f64,
    /// Mission time at which it was set.
    pub at_s: f64,
    /// The name of the person or program that set it.
    pub author: String,
    /// The text of the marker, as written.
    pub text: String,
}

/// A note about a vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct VehicleNote {
    /// Mission time of the note.
    pub at_s: f64,
    /// The name of the person or program that wrote it.
    pub author: String,
    /// The text of the note, as written.
    pub text: String,
}
