//! How values of each type are read from TOML, written and described.

mod choices;
mod labels;
mod numbers;
mod ports;
mod ros2;
mod sources;
mod tables;
mod texts;

pub use choices::{
    Authenticate, AutopilotKind, BirthRule, CameraStamps, LegDirection, MapCells, ModemKind, OperatorScript,
    RestoreOrders, RosTransport, S2cMode, SceneLabels, StartMode, WorldKind,
};
pub use labels::{BandRange, Debounce, LabelMessage, LabelSource, Votes};
pub use ports::{GpsPort, HostPort, PageOrigin};
pub use ros2::{Remap, RosName, ZenohEndpoint};
pub use sources::{CalibrationSource, CameraSource, DepthSource, NavigationSource};
pub use tables::LayerName;

use crate::rule::Rule;
use serde_json::json;
use toml::Value;

/// A type of configuration values.
pub(crate) trait Setting: Sized {
    /// The value of `value`; `None` if it is not allowed.
    fn read(value: &Value, rule: &Rule) -> Option<Self>;

    /// The value in TOML; [`Setting::read`] gives the same again.
    fn write(&self) -> Value;

    /// The allowed values, for operators; stands after "allowed:".
    fn allowed(rule: &Rule) -> String;

    /// The allowed values as JSON Schema, draft 2020-12.
    fn schema(rule: &Rule) -> serde_json::Value;

    /// Names of the members, if it is a table.
    fn members() -> Vec<&'static str> {
        Vec::new()
    }

    /// Replaces the value, or one member of a table; `None`, and no change, if that is not allowed.
    fn set(&mut self, member: Option<&str>, value: &Value, rule: &Rule) -> Option<()> {
        if member.is_some() {
            return None;
        }
        *self = Self::read(value, rule)?;
        Some(())
    }
}

/// The unit of a rule with a blank before it.
fn unit(rule: &Rule) -> String {
    if rule.unit.is_empty() { String::new() } else { format!(" {}", rule.unit) }
}

/// JSON Schema of one of some words.
fn one_of(words: &[&str]) -> serde_json::Value {
    json!({ "enum": words })
}

/// JSON Schema of a list of different values.
fn different(items: serde_json::Value) -> serde_json::Value {
    json!({ "type": "array", "uniqueItems": true, "items": items })
}

/// Reads a list of values that are all different.
fn read_different<T: PartialEq>(value: &Value, read: impl Fn(&Value) -> Option<T>) -> Option<Vec<T>> {
    let values = value.as_array()?.iter().map(read).collect::<Option<Vec<T>>>()?;
    let differ = (1..values.len()).all(|i| !values[..i].contains(&values[i]));
    differ.then_some(values)
}
