//! A map.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A map without its cells.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MapSummary {
    /// A number that grows with each change of a label or a layer.
    pub version: u64,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Column of the south-west cell. Its west side is `x0 * cell_m` metres east of the map's origin.
    pub x0: i32,
    /// Row of the south-west cell.
    pub y0: i32,
    /// Number of columns, from west to east.
    pub width: u32,
    /// Number of rows, from south to north.
    pub height: u32,
    /// Number of cells with a label.
    pub explored_cells: u32,
    /// When the vehicle last confirmed or changed the map.
    pub updated_s: Option<f64>,
    /// A number that grows when the labels change their meaning: that of the map in view.
    pub epoch: u8,
    /// The map in view, if it is not the current one: it was received in an earlier run of the vehicle or of the surface,
    /// and stays in view until the current one has as many cells. The other members describe the map in view.
    #[serde(default)]
    pub earlier: Option<EarlierMap>,
    /// The place of the map in the world; null while no fix has moved it.
    pub placement: Option<MapPlacement>,
}

/// A map of an earlier run that is in view.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EarlierMap {
    /// Counts the runs of the vehicle that this surface has met, from 1.
    pub run: u32,
    /// The run that the vehicle is in.
    pub current_run: u32,
    /// The epoch of the labels in the run that the vehicle is in.
    pub current_epoch: u8,
    /// Cells with a label that were received in the run that the vehicle is in.
    pub current_cells: u32,
}

impl MapSummary {
    /// The shift from the map to the world frame, metres east and north.
    pub fn shift_m(&self) -> (f64, f64) {
        self.placement.as_ref().map_or((0.0, 0.0), |p| (p.east_m, p.north_m))
    }
}

/// The shift from a vehicle's map to the world frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapPlacement {
    /// Number of changes of the placement so far.
    pub version: u8,
    /// Metres to add to the east.
    pub east_m: f64,
    /// Metres to add to the north.
    pub north_m: f64,
}

/// The labels that a cell had before its present one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CellHistory {
    /// The former labels, the newest first.
    pub former: Vec<FormerLabel>,
}

/// A label that a cell had before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FormerLabel {
    pub label: u8,
    /// Mission time at which the label that replaced it was received.
    pub until_s: f64,
}
