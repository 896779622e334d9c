//! The bodies of replies that are neither the state of the surface nor a part of it.

use scenecast_surface::state::ArchivedMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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

/// A label or a layer of a map has changed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MapEvent {
    /// Acoustic address of the vehicle, 1 to 14.
    pub vehicle: u8,
    /// Version of the vehicle's map at the surface.
    pub version: u64,
}

/// The maps of runs and label epochs that have ended.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct ArchiveList {
    /// The archived maps, the newest first.
    pub maps: Vec<ArchivedMap>,
}

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
    /// Mission time of the entry, seconds.
    pub at_s: f64,
    /// The same time in UTC by the clock of the surface's computer (RFC 3339).
    pub utc: String,
    /// The address of the vehicle; null if the entry concerns the surface or all vehicles.
    pub vehicle: Option<u8>,
    /// order, answer, contact, mode, label, image, record, command, fault or refused.
    pub kind: String,
    /// The principal who caused it; null for the surface and the vehicle.
    pub by: Option<String>,
    /// The entry in one line, for people.
    pub text: String,
}

/// The reason why a request failed.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ErrorBody {
    /// The reason in one line, for people.
    pub error: String,
}
