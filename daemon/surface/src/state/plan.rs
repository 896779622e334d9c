//! What a vehicle's plan is for: its legs by their reason, and what it leads to first.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Why a vehicle takes a leg of its plan, as far as the surface knows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LegReason {
    /// A favoured label lies there, by the surface's map.
    Label,
    /// A favoured label is expected on floor that was not seen.
    Expected,
    /// Floor that the camera has not seen.
    Unseen,
    /// Cells that the scene model explains badly.
    Unusual,
    /// A weighted area.
    Area,
    /// The place to which the operator has ordered the vehicle.
    Destination,
    /// The vehicle returns.
    Return,
    /// The legs of the survey, before the first weights.
    Survey,
}

/// A leg of a plan, from the end of the one before.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanLeg {
    /// Its end on the vehicle's map, metres east and north.
    pub to: (f64, f64),
    /// What it is for; a leg without a gain of its own has the reason of the one that it leads to.
    pub reason: LegReason,
    /// The label, for the reasons `label` and `expected`.
    pub label: Option<u8>,
}

/// What a plan leads to first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FirstTarget {
    /// What lies there.
    pub reason: LegReason,
    /// The label, for the reasons `label` and `expected`.
    pub label: Option<u8>,
    /// Where the vehicle gets to it, metres east and north on the vehicle's map.
    pub at: (f64, f64),
    /// Metres from the vehicle to there along the plan.
    pub along_m: f64,
    /// Mission time of the arrival at the vehicle's speed.
    pub arrival_s: f64,
}

/// What a plan is for.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct PlanAims {
    /// The legs, the first one from the vehicle.
    pub legs: Vec<PlanLeg>,
    /// What it leads to first; null if there is nothing on the way.
    pub first: Option<FirstTarget>,
    /// The cells of the label that it leads to first: row, first column, last column; at most 256.
    pub targets: Vec<(i32, i32, i32)>,
}

/// The part of its time that a vehicle is over floor that its weights favour, by its reported track and the map as it is now.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FavouredTime {
    /// Mission time at which the surface learned that the weights are applied.
    pub since_s: f64,
    /// The part of the time since then, 0 to 1.
    pub share: f64,
    /// The part of the time before, as far as the track goes back; null if that is less than half a minute.
    pub before: Option<f64>,
}

/// What a vehicle would do by weights that are not sent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DryRun {
    /// Where it begins on the vehicle's map, metres east and north: the last known place of the vehicle.
    pub from: (f64, f64),
    /// What the path of the vehicle's planner is for.
    #[serde(flatten)]
    pub aims: PlanAims,
    /// Length of the path, metres.
    pub metres: f64,
    /// Mission time at which it was planned.
    pub at_s: f64,
    /// The plan in a sentence.
    pub text: String,
    /// What the plan rests on, in a sentence.
    pub rests_on: String,
    /// One pass of the area in straight legs within the fence; null where the fence leaves no legs.
    pub pass: Option<SurveyPass>,
}

/// One pass of a survey area in straight legs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SurveyPass {
    /// Length of the path, metres.
    pub metres: f64,
    /// Time that it takes at the vehicle's speed, seconds.
    pub time_s: f64,
}
