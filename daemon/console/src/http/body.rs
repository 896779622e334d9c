//! Reads the body of an order.

use super::response::error;
use axum::Json;
use axum::extract::{FromRequest, Request};
use axum::response::Response;
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt::Formatter;
use std::marker::PhantomData;

/// The body of an order: a JSON object. Serde would also accept a list of the members in their order.
pub(super) struct JsonOrder<T>(pub(super) T);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for JsonOrder<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Members(PhantomData))
    }
}

struct Members<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
    type Value = JsonOrder<T>;

    fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, members: A) -> Result<JsonOrder<T>, A::Error> {
        T::deserialize(MapAccessDeserializer::new(members)).map(JsonOrder)
    }
}

impl<T: DeserializeOwned, S: Send + Sync> FromRequest<S> for JsonOrder<T> {
    type Rejection = Response;

    async fn from_request(request: Request, state: &S) -> Result<Self, Response> {
        let body = Json::<Self>::from_request(request, state).await;
        body.map(|Json(order)| order).map_err(|e| error(e.status(), &e.body_text()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_surface::SettingsOrder;

    #[test]
    fn an_order_is_an_object_and_not_a_list() {
        let read = |json: &str| serde_json::from_str::<JsonOrder<SettingsOrder>>(json).map(|JsonOrder(o)| o.planner);
        assert_eq!(read(r#"{"planner": "greedy"}"#).unwrap().as_deref(), Some("greedy"));
        assert!(read("[null, null]").unwrap_err().to_string().contains("an object"));
        assert!(read(r#"{"plan": 1}"#).unwrap_err().to_string().contains("unknown field"));
    }
}
