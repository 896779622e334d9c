//! Names of layers and tables by these names; shares by class, and the order of the background streams.

use super::{Setting, different, one_of, read_different, unit};
use crate::rule::Rule;
use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerId, LayerSet};
use scenecast_protocol::schedule::{BackgroundOrder, BackgroundStream, Class, Shares};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt;
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

/// The streams that vehicles have, by their names.
fn streams() -> Vec<(BackgroundStream, String)> {
    let layers = LayerSet::default();
    BackgroundStream::all(&layers).map(|stream| (stream, stream.name_in(&layers))).collect()
}

fn stream_names() -> Vec<String> {
    streams().into_iter().map(|(_, name)| name).collect()
}

impl Setting for BackgroundOrder {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        let streams = streams();
        let stream = |v: &Value| streams.iter().find(|(_, name)| Some(name.as_str()) == v.as_str()).map(|&(s, _)| s);
        Self::new(&read_different(value, stream)?)
    }

    fn write(&self) -> Value {
        Value::Array(self.names(&LayerSet::default()).into_iter().map(Value::String).collect())
    }

    fn allowed(_: &Rule) -> String {
        let layers = LayerSet::default();
        let is_layer = |stream: &BackgroundStream| matches!(stream, BackgroundStream::Layer(_));
        let others = BackgroundStream::all(&layers).filter(|stream| !is_layer(stream));
        let names: Vec<String> = others.map(|stream| stream.name_in(&layers)).collect();
        format!("a list of different words of {} and the layers of map.layers", names.join(", "))
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(json!({ "enum": stream_names() }))
    }
}

/// The name of a built-in layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct LayerName {
    id: LayerId,
    name: &'static str,
}

impl LayerName {
    /// The layer of this name, if it is built in.
    pub fn new(name: &str) -> Option<Self> {
        Self::all().find(|layer| layer.name == name)
    }

    /// Every built-in layer, in the order of the files.
    pub fn all() -> impl Iterator<Item = Self> {
        BUILT_IN_LAYERS.iter().map(|layer| Self { id: layer.id, name: &layer.descriptor.name })
    }

    /// The index, the same on every vehicle.
    pub fn id(self) -> LayerId {
        self.id
    }

    /// The name, as in files and reports.
    pub fn as_str(self) -> &'static str {
        self.name
    }
}

impl fmt::Display for LayerName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

fn names() -> Vec<&'static str> {
    LayerName::all().map(LayerName::as_str).collect()
}

impl Setting for Vec<LayerName> {
    fn read(value: &Value, _: &Rule) -> Option<Self> {
        read_different(value, |v| LayerName::new(v.as_str()?))
    }

    fn write(&self) -> Value {
        Value::Array(self.iter().map(|layer| Value::String(layer.name.to_owned())).collect())
    }

    fn allowed(_: &Rule) -> String {
        format!("a list of different words of {}", names().join(", "))
    }

    fn schema(_: &Rule) -> serde_json::Value {
        different(one_of(&names()))
    }
}

/// A layer that is not in the table has 0.
impl Setting for BTreeMap<LayerName, u8> {
    fn read(value: &Value, rule: &Rule) -> Option<Self> {
        let table = value.as_table()?;
        table.iter().map(|(name, percent)| Some((LayerName::new(name)?, u8::read(percent, rule)?))).collect()
    }

    fn write(&self) -> Value {
        let percent = |layer: LayerName| self.get(&layer).copied().unwrap_or(0);
        write(LayerName::all().map(|layer| (layer.name, percent(layer))))
    }

    fn allowed(rule: &Rule) -> String {
        allowed(&names(), rule)
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        schema(&names(), rule)
    }

    fn members() -> Vec<&'static str> {
        names()
    }

    fn set(&mut self, member: Option<&str>, value: &Value, rule: &Rule) -> Option<()> {
        match member {
            Some(name) => {
                self.insert(LayerName::new(name)?, u8::read(value, rule)?);
            }
            None => *self = Self::read(value, rule)?,
        }
        Some(())
    }
}
