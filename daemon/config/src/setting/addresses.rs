//! Lists of vehicles' addresses.

use super::{Setting, different, read_different, unit};
use crate::rule::Rule;
use toml::Value;

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
