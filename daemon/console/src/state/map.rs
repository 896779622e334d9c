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

/// The JSON index of the tiles of a map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapIndex {
    /// Names this map. With `since` set to it, the next request gets only the tiles that have changed.
    pub tag: String,
    /// The tag to which these tiles are added; null if they are the whole map and replace every tile before.
    pub since: Option<String>,
    /// A number that grows with each change of a label or a layer.
    pub version: u64,
    /// Mission time of this map.
    pub at_s: f64,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Column of the south-west explored cell. Its west side is `x0 * cell_m` metres east of the map's origin.
    pub x0: i32,
    /// Row of the south-west explored cell.
    pub y0: i32,
    /// Number of columns, from west to east.
    pub width: u32,
    /// Number of rows, from south to north.
    pub height: u32,
    /// The layers beside the labels; in the tiles, the first has the number 1.
    pub layers: Vec<TileLayer>,
    /// Column and row of each tile that follows, in tiles of 64 cells from the map's origin.
    pub tiles: Vec<(i32, i32)>,
}

/// The meaning of a layer's levels in tiles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TileLayer {
    /// Its name, as in the list of layers of the state.
    pub name: String,
    /// The unit of its values; empty if they have none.
    pub unit: String,
    /// Whether the values are depths of the sea floor below the surface of the water, metres.
    pub is_depth: bool,
    /// The colours: cividis or inferno.
    pub palette: String,
    /// The spread, as in a [`LayerBody`].
    pub spread: String,
    /// The level whose bounds are the first two of `edges`.
    pub lowest: u8,
    /// The bounds of levels in units: level n lies from `edges[n - lowest]` to the next one.
    pub edges: Vec<f64>,
}

/// A map or a region of it with its cells, row by row from the south-west.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapBody {
    /// A number that grows with each change of a label or a layer.
    pub version: u64,
    /// Mission time to which the ages refer.
    pub at_s: f64,
    /// Column of the south-west cell. Its west side is `x0 * cell_m` metres east of the map's origin.
    pub x0: i32,
    /// Row of the south-west cell.
    pub y0: i32,
    /// Number of columns, from west to east.
    pub width: u32,
    /// Number of rows, from south to north.
    pub height: u32,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Base64: one byte a cell, 0 = unexplored.
    pub labels: String,
    /// Base64: two bytes a cell, little-endian: seconds since the cell was received, 65535 = never.
    pub age_s: String,
    /// The other layers of which values were received.
    pub layers: Vec<LayerBody>,
}

/// A quantity of each cell that the vehicle sends in addition to the labels. A value may be older than the label of its cell, and
/// then refers to an earlier label. The value of a cell without a label has no meaning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LayerBody {
    /// Its name, as in the list of layers of the state.
    pub name: String,
    /// The unit of its values; empty if they have none.
    pub unit: String,
    /// Whether the values are depths of the sea floor below the surface of the water, metres.
    pub is_depth: bool,
    /// The colours: cividis or inferno.
    pub palette: String,
    /// The colours are spread over: scale, all of `edges`; present, likewise; common, these without the lowest and the
    /// highest fiftieth of the cells.
    pub spread: String,
    /// The level whose bounds are the first two of `edges`.
    pub lowest: u8,
    /// The bounds of levels in units: level n lies from `edges[n - lowest]` to the next one. A cell may stay in its level while its
    /// value lies outside by a fifth of the level's width.
    pub edges: Vec<f64>,
    /// Base64: one byte a cell in the order of `labels`: its level; 0 = unknown.
    pub data: String,
    /// Base64, as for the labels: seconds since the value of the cell was received.
    pub age_s: String,
}

/// The labels that a cell had before its present one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CellHistory {
    /// The newest first.
    pub former: Vec<FormerLabel>,
}

/// A label that a cell had before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FormerLabel {
    pub label: u8,
    /// Mission time at which the label that replaced it was received.
    pub until_s: f64,
}

/// A label or a layer of a map has changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MapEvent {
    /// Acoustic address of the vehicle, 1 to 14.
    pub vehicle: u8,
    /// Version of the vehicle's map at the surface.
    pub version: u64,
}
