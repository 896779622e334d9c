//! What is told of a map.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A map without its cells.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct MapSummary {
    /// Counts up whenever a label or a layer changes.
    pub version: u64,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Column of the south-west cell; its west edge is at `x0 * cell_m` metres east.
    pub x0: i32,
    /// Row of the south-west cell.
    pub y0: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Cells with a label.
    pub explored_cells: u32,
    /// When the vehicle last confirmed or changed the map.
    pub updated_s: Option<f64>,
    /// Counts up when labels begin to mean something else.
    pub epoch: u8,
    /// Where it lies in the world; null while no fix has moved it.
    pub placement: Option<Placement>,
}

/// By how much a vehicle's map must be moved to lie where it belongs in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Placement {
    /// Counts the moves.
    pub version: u8,
    /// Add to its places, metres east.
    pub east_m: f64,
    /// Add to its places, metres north.
    pub north_m: f64,
}

/// A map with its cells, row by row from the south-west.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Map {
    /// Counts up whenever a label or a layer changes.
    pub version: u64,
    /// When the ages were true.
    pub at_s: f64,
    /// Column of the south-west cell; its west edge is at `x0 * cell_m` metres east.
    pub x0: i32,
    /// Row of the south-west cell.
    pub y0: i32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Base64: one byte a cell, 0 = unexplored.
    pub labels: String,
    /// Base64: two bytes a cell, little-endian: seconds since the cell was heard of, 65535 = never.
    pub age_s: String,
    /// What else was heard of the cells.
    pub layers: Vec<Layer>,
}

/// A quantity of each cell that a vehicle tells of where labels leave room. It may be older than the label of its cell, and
/// then speaks of an earlier one; where a cell has no label it does not count.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Layer {
    /// `confidence`: how sure the vehicle's model is of the label, 0 to 1; `depth`: of the sea floor;
    /// `curiosity`: how badly the model explains what the cell shows, the mean surprise of a word in bits (the binary
    /// logarithm of the perplexity).
    pub name: String,
    /// `m`, `bit`, or empty.
    pub unit: String,
    /// The middle of the lowest level.
    pub min: f64,
    /// The middle of the highest level.
    pub max: f64,
    /// What a level spans: the true value lies half of it at most from the one in `data`, and a fifth of it more where a
    /// cell stays in its level at the edge.
    pub step: f64,
    /// Base64: one byte a cell in the order of `labels`, 0 to 254 for `min` to `max`, in between linear; 255 = not known.
    pub data: String,
    /// Base64, as of the labels: seconds since the level of the cell was heard of.
    pub age_s: String,
}

/// A map, or a layer of it, has changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MapEvent {
    /// Address of the vehicle.
    pub vehicle: u8,
    /// Version of its map.
    pub version: u64,
}
