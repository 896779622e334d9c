//! The bodies of orders, and changes of an order that stays in force.

use scenecast_protocol::directive::{Constraints, SlotId};
use scenecast_surface::OrderRefusal;
use schemars::JsonSchema;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::marker::PhantomData;

/// The number of a label as the name of a member: 1 to 254, without a sign or a leading zero.
const LABEL: &str = "^([1-9][0-9]?|1[0-9]{2}|2[0-4][0-9]|25[0-4])$";

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
    /// It holds its position.
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
    /// ones), exemplars (images of new labels that nobody requested), names of layers (layers without a share).
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

/// Removes a marker.
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

/// The names of orders in the slot constraints.
pub(crate) const CONSTRAINTS: [&str; 3] = ["hold", "resume", "abort"];

/// Gives a withdrawn order again, as a new one.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AgainOrder {
    /// The slot of the order, whose state is `withdrawn`; hold, resume and abort share the slot constraints.
    #[schemars(extend("enum" = SlotId::ALL.map(SlotId::name).into_iter().chain(CONSTRAINTS).collect::<Vec<_>>()))]
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

/// The members of an order that a client names: each replaces the present one, and null removes it. A member that is absent
/// stays as it is, so that nothing that keeps the vehicle safe is removed without being named.
#[derive(Debug, Clone, PartialEq)]
pub struct OrderChanges<T> {
    named: Map<String, Value>,
    order: PhantomData<T>,
}

impl<T: Serialize + DeserializeOwned + Default> OrderChanges<T> {
    /// Names every member, so the present order does not matter.
    pub fn whole(order: &T) -> Self {
        Self { named: members(order), order: PhantomData }
    }

    /// The members that are named.
    pub fn named(&self) -> &Map<String, Value> {
        &self.named
    }

    /// Whether every member is named.
    pub fn is_whole(&self) -> bool {
        members(&T::default()).keys().all(|name| self.named.contains_key(name))
    }

    /// The order after the changes. `present` is the order before them, which is needed only if a member is absent.
    ///
    /// # Errors
    /// No member is named, or the present order is not known.
    pub fn applied_to(&self, present: impl FnOnce() -> Result<T, OrderRefusal>) -> Result<T, OrderRefusal> {
        let all = members(&T::default());
        if self.named.is_empty() {
            let names: Vec<&str> = all.keys().map(String::as_str).collect();
            return Err(OrderRefusal::NamesNothing { allowed: names.join(", ") });
        }
        let before = if self.is_whole() { all } else { members(&present()?) };
        merged(before, &self.named).map_err(|error| OrderRefusal::Members { why: error.to_string() })
    }
}

impl<'de, T: Serialize + DeserializeOwned + Default> Deserialize<'de> for OrderChanges<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let named = deserializer.deserialize_map(EachOnce)?;
        merged::<T>(Map::new(), &named).map_err(D::Error::custom)?;
        Ok(Self { named, order: PhantomData })
    }
}

/// Reads an object that names each member once: of two values, one would be lost silently.
struct EachOnce;

impl<'de> Visitor<'de> for EachOnce {
    type Value = Map<String, Value>;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut access: A) -> Result<Self::Value, A::Error> {
        let mut members = Map::new();
        while let Some((name, value)) = access.next_entry::<String, Value>()? {
            if members.contains_key(&name) {
                return Err(A::Error::custom(format!("{name} is named twice")));
            }
            members.insert(name, value);
        }
        Ok(members)
    }
}

impl<T> Serialize for OrderChanges<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.named.serialize(serializer)
    }
}

fn members(order: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(order) {
        Ok(Value::Object(members)) => members,
        _ => Map::new(),
    }
}

fn merged<T: DeserializeOwned>(mut members: Map<String, Value>, named: &Map<String, Value>) -> serde_json::Result<T> {
    members.extend(named.clone());
    serde_json::from_value(Value::Object(members))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::{FenceOrder, LimitsOrder};

    fn read<T: Serialize + DeserializeOwned + Default>(json: &str) -> Result<OrderChanges<T>, String> {
        serde_json::from_str(json).map_err(|error| error.to_string())
    }

    #[test]
    fn an_absent_member_stays_and_null_removes() {
        let square = vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0]];
        let present =
            FenceOrder { fence: Some(square.clone()), keep_outs: vec![square.clone()], return_point: Some([1.0, 1.0]) };
        let after = |json: &str| read::<FenceOrder>(json).unwrap().applied_to(|| Ok(present.clone()));
        let moved = after(r#"{"return_point": [2, 1]}"#).unwrap();
        assert_eq!(moved, FenceOrder { return_point: Some([2.0, 1.0]), ..present.clone() });
        assert_eq!(after(r#"{"keep_outs": []}"#).unwrap().keep_outs.len(), 0);
        assert_eq!(after(r#"{"keep_outs": null}"#).unwrap().fence, Some(square));
        assert_eq!(after(r#"{"fence": null}"#).unwrap().fence, None);
        assert!(after("{}").unwrap_err().to_string().starts_with("the order names nothing: it takes fence"));
    }

    #[test]
    fn an_unknown_order_matters_only_where_a_member_is_absent() {
        let unknown = || Err(OrderRefusal::RestUnknown(SlotId::Limits));
        let one = read::<LimitsOrder>(r#"{"time_s": 60}"#).unwrap();
        assert_eq!(one.applied_to(unknown), unknown());
        let none = OrderChanges::whole(&LimitsOrder::default());
        assert_eq!(none.applied_to(unknown), Ok(LimitsOrder::default()));
    }

    #[test]
    fn unknown_members_and_other_types_are_refused_when_read() {
        assert!(read::<FenceOrder>(r#"{"fenze": null}"#).unwrap_err().contains("unknown field"));
        assert!(read::<LimitsOrder>(r#"{"time_s": "long"}"#).is_err());
        assert!(read::<LimitsOrder>("[]").is_err());
        let twice = r#"{"fence": [[0, 0], [9, 0], [9, 9]], "fence": null}"#;
        assert!(read::<FenceOrder>(twice).unwrap_err().contains("fence is named twice"));
    }
}
