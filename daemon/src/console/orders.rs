//! What the API takes: the bodies of orders.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Weights of labels on the map; labels that are not named weigh 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UtilityOrder {
    /// -1 to 1 by label, which must be on the map.
    #[schemars(extend("propertyNames" = { "pattern": "^[1-9][0-9]{0,2}$" }))]
    #[schemars(extend("additionalProperties" = { "type": "number", "minimum": -1, "maximum": 1 }))]
    pub weights: BTreeMap<String, f64>,
    /// -1 to 1 for unseen cells.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub exploration: f64,
    /// -1 to 1 for cells that the scene model explains badly.
    #[serde(default)]
    #[schemars(range(min = -1.0, max = 1.0))]
    pub curiosity: f64,
}

/// Asks for an image of a label, or for a further one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExemplarOrder {
    /// A label on the map.
    #[schemars(range(min = 1, max = 254))]
    pub label: u8,
}

/// Tells the vehicle to stay, to abort, or with both false to go on, also after a breach.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConstraintsOrder {
    /// Whether it stays.
    pub hold: bool,
    /// Whether it aborts; goes before `hold`.
    #[serde(default)]
    pub abort: bool,
}

/// Changes planner and refinement; what is left out stays as it was sent last.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SettingsOrder {
    /// lawnmower, greedy, horizon, or empty: as configured on the vehicle.
    #[serde(default)]
    pub planner: Option<String>,
    /// Words resampled a second; 0: as configured on the vehicle.
    #[serde(default)]
    pub refine_words_per_s: Option<u32>,
}

/// Budget of the surface, at once, and of each vehicle, by the directive.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BudgetOrder {
    /// Bits on air a second.
    #[schemars(range(min = 10, max = 10_000_000))]
    pub budget_bps: u32,
    /// Least shares; left out: those of the surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shares: Option<SharesOrder>,
}

/// Least shares in percent while each class has something to send; together at most 100.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SharesOrder {
    /// Orders but for fixes.
    #[schemars(range(max = 100))]
    pub directive: u8,
    /// Statuses.
    #[schemars(range(max = 100))]
    pub status: u8,
    /// Position fixes.
    #[schemars(range(max = 100))]
    pub fix: u8,
    /// The map.
    #[schemars(range(max = 100))]
    pub map: u8,
    /// Images.
    #[schemars(range(max = 100))]
    pub exemplar: u8,
}
