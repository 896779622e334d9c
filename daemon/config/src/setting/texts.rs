//! Names, files, and lists of vehicles' addresses.

use super::{Setting, different, read_different, unit};
use crate::rule::Rule;
use serde_json::json;
use std::path::PathBuf;
use toml::Value;

impl Setting for String {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        value.as_str().map(str::to_owned)
    }

    fn write(&self) -> Value {
        Value::String(self.clone())
    }

    fn allowed(_: &Rule) -> String {
        "text in quotes".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

impl Setting for PathBuf {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        value.as_str().map(Self::from)
    }

    fn write(&self) -> Value {
        Value::String(self.to_string_lossy().into_owned())
    }

    fn allowed(_: &Rule) -> String {
        "a path in quotes".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

/// An empty text stands for none.
impl Setting for Option<PathBuf> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let path = PathBuf::read(value, rule)?;
        Some((!path.as_os_str().is_empty()).then_some(path))
    }

    fn write(&self) -> Value {
        self.as_ref().map_or(Value::String(String::new()), PathBuf::write)
    }

    fn allowed(_: &Rule) -> String {
        "a path in quotes, or \"\"".to_owned()
    }

    fn schema(_: &Rule) -> serde_json::Value {
        json!({ "type": "string" })
    }
}

impl Setting for Vec<u8> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        read_different(value, |v| u8::read(v, rule))
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(u8::write).collect())
    }

    fn allowed(rule: &Rule) -> String {
        format!("a list of different whole numbers from {} to {}{}", rule.range.0, rule.range.1, unit(rule))
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        different(u8::schema(rule))
    }
}
