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

/// Asks for an image of a label, in place of what was asked of the label before, or takes that back.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExemplarOrder {
    /// A label on the map.
    #[schemars(range(min = 1, max = 254))]
    pub label: u8,
    /// What of it.
    #[serde(default)]
    pub what: ExemplarWish,
    /// For `larger`: which picture; left out: the newest.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 63))]
    pub picture: Option<u8>,
}

/// Which image of a label is wanted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ExemplarWish {
    /// The best one that is not here: 64 x 64 pixels, at most 700 bytes.
    #[default]
    Another,
    /// One that is here with twice its edge: 128 x 128 pixels, at most 2800 bytes.
    Larger,
    /// None: what was asked for is not sent to its end.
    Cancel,
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
    /// What bits that nobody else needs are spent on, in this order: different ones of finer (the cells between those of a
    /// coarse map), depth, confidence and curiosity (layers without a share), exemplars (images of new labels that nobody
    /// asked for). What is not named gets none, but for finer cells, which then go before all others. Left out: as it was
    /// sent last.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<Vec<String>>,
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
