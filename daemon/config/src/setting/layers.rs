//! Names of layers, and tables by these names.

use super::{Setting, different, one_of, read_different};
use crate::rule::Rule;
use crate::setting::tables;
use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerId};
use std::collections::BTreeMap;
use std::fmt;
use toml::Value;

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
        tables::write(LayerName::all().map(|layer| (layer.name, percent(layer))))
    }

    fn allowed(rule: &Rule) -> String {
        tables::allowed(&names(), rule)
    }

    fn schema(rule: &Rule) -> serde_json::Value {
        tables::schema(&names(), rule)
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
