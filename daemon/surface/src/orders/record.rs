//! What stays at the surface: drafts, labels, notes and markers, and who has command.

use super::LABEL;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The weights that an operator has set and not sent, in place of the draft before; without any, there is no draft. It stays
/// at the surface, where the pages of all operators show it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DraftOrder {
    /// -1 to 1 by label.
    #[schemars(extend("propertyNames" = { "pattern": LABEL }))]
    #[schemars(extend("additionalProperties" = { "type": "number", "minimum": -1, "maximum": 1 }))]
    pub weights: BTreeMap<String, f64>,
    /// The weight of unexplored cells, -1 to 1; by default as last sent.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub exploration: Option<f64>,
    /// The weight of cells that the scene model explains badly, -1 to 1; by default as last sent.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub curiosity: Option<f64>,
}

/// The operator's name, colour and merging of a label in the current epoch. They stay at the surface; a member that is missing
/// or null takes the operator's earlier one away.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LabelOrder {
    /// The number of the label, 1 to 254.
    #[schemars(range(min = 1, max = 254))]
    pub label: u8,
    /// Its name, at most 60 characters.
    #[serde(default)]
    #[schemars(length(min = 1, max = 60))]
    pub name: Option<String>,
    /// Its colour, as in `#a0b1c2`.
    #[serde(default)]
    #[schemars(regex(pattern = "^#[0-9a-fA-F]{6}$"))]
    pub colour: Option<String>,
    /// Another label, which it is shown as a part of.
    #[serde(default)]
    #[schemars(range(min = 1, max = 254))]
    pub merged_into: Option<u8>,
}

/// A note about a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoteOrder {
    /// The text of the note, at most 1000 characters.
    #[schemars(length(min = 1, max = 1000), regex(pattern = r"\S"))]
    pub text: String,
}

/// A marker on the map; it stays at the surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkerOrder {
    /// Metres east of the origin in the world frame.
    pub x_m: f64,
    /// Metres north of the origin in the world frame.
    pub y_m: f64,
    /// The text of the marker, at most 200 characters.
    #[schemars(length(min = 1, max = 200), regex(pattern = r"\S"))]
    pub text: String,
}

/// Removes a marker from the map.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RemoveMarkerOrder {
    /// The number of the marker, as the state has it.
    #[schemars(range(min = 1))]
    pub number: u32,
}

/// Takes the map of an earlier run out of view. It stays in the archive.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DismissOrder {}

/// Requests command, hands it over, takes it or gives it up.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandOrder {
    /// The change of command that is ordered.
    pub action: CommandOrderAction,
    /// For `hand_over`: the name of the principal; by default the one whose request is the oldest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub to: Option<String>,
}

/// A change of command, with its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CommandOrderAction {
    /// Asks the holder for command, for 120 s; takes it if nobody has it.
    Request,
    /// Withdraws the own request for command.
    Withdraw,
    /// Takes command if nobody has it, if its holder was silent for 120 s, or from another client of the same principal.
    Take,
    /// Hands command over to `to`.
    HandOver,
    /// Gives command up; the next order takes it.
    Release,
    /// A sign that the holder is present; ignored from others.
    Keep,
}
