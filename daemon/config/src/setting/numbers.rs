//! Numbers, flags, lists of numbers, places.

use super::{Setting, unit};
use crate::rule::Rule;
use scenecast_core::{Area, LatLon};
use serde_json::json;
use toml::Value;

macro_rules! whole_number {
    ($($type:ty)*) => { $(
        impl Setting for $type {
            fn read(value: &Value, rule: &Rule) -> Option<Self> {
                let (low, high) = rule.range;
                let number = value.as_integer().filter(|&i| (low..=high).contains(&(i as f64)))?;
                Self::try_from(number).ok()
            }

            fn write(&self) -> Value {
                Value::Integer(*self as i64)
            }

            fn allowed(rule: &Rule) -> String {
                format!("a whole number from {} to {}{}", rule.range.0, rule.range.1, unit(rule))
            }

            fn schema(rule: &Rule) -> serde_json::Value {
                json!({ "type": "integer", "minimum": rule.range.0 as i64, "maximum": rule.range.1 as i64 })
            }
        }
    )* };
}
whole_number!(u8 u16 u32 u64);

impl Setting for f64 {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let (low, high) = rule.range;
        let number = value.as_float().or_else(|| value.as_integer().map(|i| i as Self));
        number.filter(|x| (low..=high).contains(x))
    }

    fn write(&self) -> Value {
        Value::Float(*self)
    }

    fn allowed(rule: &Rule) -> String {
        format!("a number from {} to {}{}", rule.range.0, rule.range.1, unit(rule))
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        json!({ "type": "number", "minimum": rule.range.0, "maximum": rule.range.1 })
    }
}

impl<const N: usize> Setting for [f64; N] {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let numbers: Option<Vec<f64>> = value.as_array()?.iter().map(|v| f64::read(v, rule)).collect();
        numbers?.try_into().ok()
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(f64::write).collect())
    }

    fn allowed(rule: &Rule) -> String {
        format!("a list of {N} numbers from {} to {}{}", rule.range.0, rule.range.1, unit(rule))
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        json!({ "type": "array", "minItems": N, "maxItems": N, "items": f64::schema(rule) })
    }
}

impl Setting for bool {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        value.as_bool()
    }

    fn write(&self) -> Value {
        Value::Boolean(*self)
    }

    fn allowed(_: &Rule) -> String {
        "true or false".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "boolean" })
    }
}

/// `[latitude, longitude]` in degrees; `[0.0, 0.0]` stands for none.
impl Setting for Option<LatLon> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let [lat_deg, lon_deg] = <[f64; 2]>::read(value, rule)?;
        if [lat_deg, lon_deg] == [0.0; 2] {
            return Some(None);
        }
        LatLon::new(lat_deg, lon_deg).map(Some)
    }

    fn write(&self) -> Value {
        self.map_or([0.0; 2], |p| [p.lat_deg, p.lon_deg]).write()
    }

    fn allowed(_: &Rule) -> String {
        "latitude from -90 to 90 and longitude from -180 to 180 degrees in a list, or [0.0, 0.0]".to_owned()
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        <[f64; 2]>::schema(rule)
    }
}

/// `[west, south, east, north]` in metres; all 0 stands for none.
impl Setting for Option<Area> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let [west, south, east, north] = <[f64; 4]>::read(value, rule)?;
        if [west, south, east, north] == [0.0; 4] {
            return Some(None);
        }
        let has_room = east - west >= 1.0 && north - south >= 1.0;
        has_room.then_some(Some(Area { west, south, east, north }))
    }

    fn write(&self) -> Value {
        self.map_or([0.0; 4], |a| [a.west, a.south, a.east, a.north]).write()
    }

    fn allowed(rule: &Rule) -> String {
        let numbers = <[f64; 4]>::allowed(rule);
        format!("{numbers}: west, south, east, north, with east and north at least 1 m above west and south, or all 0")
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        <[f64; 4]>::schema(rule)
    }
}
