//! Shares by class, and the order of the background streams.

use super::{Setting, different, one_of, read_different, unit};
use crate::key::Rule;
use scenecast_protocol::schedule::{Class, Extra, Shares, SpendOrder};
use serde_json::json;
use toml::{Table, Value};

pub(super) fn write<'a>(members: impl Iterator<Item = (&'a str, u8)>) -> Value {
    Value::Table(members.map(|(name, percent)| (name.to_owned(), percent.write())).collect::<Table>())
}

pub(super) fn allowed(names: &[&str], rule: &Rule) -> String {
    let (low, high) = rule.range;
    format!("a whole number from {low} to {high}{} for each of {}", unit(rule), names.join(", "))
}

pub(super) fn schema(names: &[&str], rule: &Rule) -> serde_json::Value {
    let members: serde_json::Map<String, serde_json::Value> =
        names.iter().map(|name| ((*name).to_owned(), u8::schema(rule))).collect();
    json!({ "type": "object", "properties": members, "additionalProperties": false })
}

/// A class that is not in the table keeps its share.
impl Setting for Shares {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let mut shares = Self::default();
        for (name, percent) in value.as_table()? {
            shares.set(Some(name), percent, rule)?;
        }
        Some(shares)
    }

    fn write(&self) -> Value {
        write(Class::SHARED.map(Class::name).into_iter().zip(self.0))
    }

    fn allowed(rule: &Rule) -> String {
        allowed(&Self::members(), rule)
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        schema(&Self::members(), rule)
    }

    fn members() -> Vec<&'static str> {
        Class::SHARED.map(Class::name).to_vec()
    }

    fn set(&mut self, member: Option<&str>, value: &Value, rule: &Rule) -> Option<()> {
        match member {
            Some(name) => {
                let at = Class::SHARED.iter().position(|class| class.name() == name)?;
                *self.0.get_mut(at)? = u8::read(value, rule)?;
            }
            None => *self = Self::read(value, rule)?,
        }
        Some(())
    }
}

impl Setting for SpendOrder {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        let stream = |v: &Value| Extra::ALL.into_iter().find(|stream| Some(stream.name()) == v.as_str());
        Self::new(&read_different(value, stream)?)
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(|stream| Value::String(stream.name().to_owned())).collect())
    }

    fn allowed(_: &Rule) -> String {
        format!("a list of different words of {}", Extra::ALL.map(Extra::name).join(", "))
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(one_of(&Extra::ALL.map(Extra::name)))
    }
}
