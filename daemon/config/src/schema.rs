//! The JSON Schema of configuration files.

use crate::Config;
use crate::key::{Key, Section};
use serde_json::{Map, Value, json};

/// JSON Schema, draft 2020-12. It does not express the conditions that several keys must satisfy together.
pub fn schema() -> String {
    let defaults = Config::default();
    let sections: Map<String, Value> =
        Section::ALL.iter().map(|section| (section.name.to_owned(), section_schema(section, &defaults))).collect();
    let schema = json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "scenecast configuration",
        "type": "object",
        "additionalProperties": false,
        "properties": sections,
    });
    format!("{schema:#}\n")
}

fn section_schema(section: &Section, defaults: &Config) -> Value {
    let keys: Map<String, Value> =
        section.keys.iter().map(|key| (key.leaf().to_owned(), key_schema(key, defaults))).collect();
    json!({
        "type": "object",
        "description": section.doc.trim_start(),
        "additionalProperties": false,
        "properties": keys,
    })
}

fn key_schema(key: &Key, defaults: &Config) -> Value {
    let mut schema = (key.operations.schema)(&key.rule);
    schema["description"] = json!(format!("{} Allowed: {}.", key.doc(), key.allowed()));
    schema["default"] = json!(key.value(defaults));
    schema
}
