//! The type hash RIHS01: SHA-256 of the type description as JSON.
//!
//! Source: REP 2016, type description distribution; `rosidl_generator_type_description`.

use crate::definition::{Definition, Field, Kind};
use sha2::{Digest, Sha256};
use std::fmt::Write;

/// What an array adds to the number of its element's type.
const ARRAY: u32 = 48;
/// What an unbounded sequence adds to the number of its element's type.
const SEQUENCE: u32 = 144;
/// The number of a nested message.
const NESTED: u32 = 1;

impl Definition {
    /// The type hash, such as `RIHS01_f49f...`.
    pub fn type_hash(&self) -> String {
        let digest = Sha256::digest(self.type_description());
        digest.iter().fold("RIHS01_".to_owned(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        })
    }

    /// The canonical JSON of its type description. Names are ASCII letters, digits and underscores: none needs an escape.
    fn type_description(&self) -> String {
        let mut referenced = self.dependencies();
        referenced.sort_by_key(|definition| definition.full_name());
        let referenced: Vec<String> = referenced.into_iter().map(struct_json).collect();
        format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            struct_json(self),
            referenced.join(", ")
        )
    }
}

fn struct_json(definition: &Definition) -> String {
    let fields: Vec<String> = definition.fields.iter().map(field_json).collect();
    format!(r#"{{"type_name": "{}", "fields": [{}]}}"#, definition.full_name(), fields.join(", "))
}

fn field_json(Field { name, kind, .. }: &Field) -> String {
    let (added, capacity, element) = match kind {
        Kind::Array(element, length) => (ARRAY, *length, **element),
        Kind::Sequence(element) => (SEQUENCE, 0, **element),
        kind => (0, 0, *kind),
    };
    let (id, nested) = match element {
        Kind::Primitive(primitive) => (primitive.type_id(), String::new()),
        kind => (NESTED, kind.message().map(Definition::full_name).unwrap_or_default()),
    };
    let id = added + id;
    format!(
        r#"{{"name": "{name}", "type": {{"type_id": {id}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#
    )
}
