//! Orders of what a vehicle does and sends, which are given to it as they are.

use super::FenceOrder;
use super::LABEL;
use scenecast_protocol::directive::{Constraints, SlotId};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Weights of labels on the map. A label that is not listed gets the weight 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UtilityOrder {
    /// -1 to 1 by label, which must be on the map.
    #[schemars(extend("propertyNames" = { "pattern": LABEL }))]
    #[schemars(extend("additionalProperties" = { "type": "number", "minimum": -1, "maximum": 1 }))]
    pub weights: BTreeMap<String, f64>,
    /// The weight of unexplored cells, -1 to 1.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub exploration: f64,
    /// The weight of cells that the scene model explains badly, -1 to 1.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub curiosity: f64,
}

/// Weights, and a fence, to try without sending them.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DryRunOrder {
    /// -1 to 1 by label, which must be on the map.
    #[serde(default)]
    #[schemars(extend("propertyNames" = { "pattern": LABEL }))]
    #[schemars(extend("additionalProperties" = { "type": "number", "minimum": -1, "maximum": 1 }))]
    pub weights: BTreeMap<String, f64>,
    /// The weight of unexplored cells, -1 to 1.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub exploration: f64,
    /// The weight of cells that the scene model explains badly, -1 to 1.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub curiosity: f64,
    /// The whole fence in place of the one in force; null or absent: that one.
    #[serde(default)]
    pub fence: Option<FenceOrder>,
}

/// Requests an image of a label in place of an earlier request for that label, or cancels the request.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExemplarOrder {
    /// A label on the map.
    #[schemars(range(min = 1, max = 254))]
    pub label: u8,
    /// The request, or its cancellation.
    #[serde(default)]
    pub action: ExemplarAction,
    /// For `larger`: the number of the image; by default the latest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 63))]
    pub image: Option<u8>,
}

/// A request for an image of a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExemplarAction {
    /// The best image that the surface does not have: 64 x 64 pixels, at most 700 bytes.
    #[default]
    Another,
    /// A received image with twice its width: 128 x 128 pixels, at most 2800 bytes.
    Larger,
    /// Cancels the request: the vehicle stops sending the image.
    Cancel,
}

/// Orders the vehicle to hold, to resume or to abort.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintsOrder {
    pub action: ConstraintsAction,
}

/// Each ends the one before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ConstraintsAction {
    /// It holds its position until it is ordered to resume.
    Hold,
    /// It continues its survey, also after a breach.
    Resume,
    /// It ends its survey with the reaction of the limits.
    Abort,
}

impl From<ConstraintsAction> for Constraints {
    fn from(action: ConstraintsAction) -> Self {
        Self { hold: action == ConstraintsAction::Hold, abort: action == ConstraintsAction::Abort }
    }
}

/// The budget of the surface, which changes at once, and of each vehicle, which receives it in the directive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BudgetOrder {
    /// Bits on air a second.
    #[schemars(range(min = 10, max = 10_000_000))]
    pub budget_bps: u32,
    /// Minimum shares; by default those of the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<SharesOrder>,
    /// The background streams that use spare capacity, in this order and without repetition: finer (the cells between coarse
    /// ones), exemplars (images of new labels that nobody requested), floor (images of the sea floor), names of layers (layers without a share).
    /// A stream that is not listed is not sent, except finer cells, which then precede all others. By default as last sent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<Vec<String>>,
}

/// Minimum shares in percent while each class has data to send; their sum is at most 100.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SharesOrder {
    /// Minimum share of orders other than position fixes, percent.
    #[schemars(range(max = 100))]
    pub directive: u8,
    /// Minimum share of the vehicle's reports, percent.
    #[schemars(range(max = 100))]
    pub status: u8,
    /// Minimum share of position fixes, percent.
    #[schemars(range(max = 100))]
    pub fix: u8,
    /// Minimum share of the map's labels, percent.
    #[schemars(range(max = 100))]
    pub map: u8,
    /// Minimum share of exemplars, percent.
    #[schemars(range(max = 100))]
    pub exemplar: u8,
}

/// The names of orders in the slot constraints.
pub const CONSTRAINT_NAMES: [&str; 3] = ["hold", "resume", "abort"];

/// Gives a withdrawn order again, as a new one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AgainOrder {
    /// The slot of the order, whose state is `withdrawn`; hold, resume and abort share the slot constraints.
    #[schemars(extend("enum" = SlotId::ALL.map(SlotId::name).into_iter().chain(CONSTRAINT_NAMES).collect::<Vec<_>>()))]
    pub slot: String,
}

/// Sends the orders that the vehicle has lost again.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestoreOrder {}

/// Takes the vehicle over from another surface.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TakeOverOrder {}
