//! Changes of an order that stays in force.

use crate::refusal::OrderRefusal;
use serde::de::{DeserializeOwned, Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};
use std::marker::PhantomData;

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
    use crate::orders::{FenceOrder, LimitsOrder};
    use scenecast_protocol::directive::SlotId;

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
