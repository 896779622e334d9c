//! Definitions of messages as data, as text (`.msg` files, and the `ros2msg` schemas of MCAP) and as the type hash RIHS01: SHA-256
//! of the type description as JSON.
//!
//! Source: REP 2016, type description distribution; `rosidl_generator_type_description`.

use sha2::{Digest, Sha256};
use std::fmt::Write;

/// A message's package, name, constants and fields.
#[derive(Debug, PartialEq)]
pub struct Definition {
    /// The package, such as `std_msgs`.
    pub package: &'static str,
    /// The name within the package, such as `Header`.
    pub name: &'static str,
    /// Lines of text for people.
    pub text: &'static [&'static str],
    pub constants: &'static [Constant],
    pub fields: &'static [Field],
}

/// A constant of a message. It is not part of the bytes, nor of the type hash.
#[derive(Debug, PartialEq)]
pub struct Constant {
    /// Its type in a `.msg` file, such as `uint8`.
    pub kind: &'static str,
    pub name: &'static str,
    pub value: i64,
}

/// A field of a message.
#[derive(Debug, PartialEq)]
pub struct Field {
    pub name: &'static str,
    pub kind: Kind,
    /// Lines of text for people.
    pub text: &'static [&'static str],
}

/// The type of a field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    Primitive(Primitive),
    Message(&'static Definition),
    /// A fixed number of elements, without a length in the bytes.
    Array(&'static Kind, usize),
    /// Any number of elements, after their number as `uint32`.
    Sequence(&'static Kind),
}

/// The types of ROS 2 that are not messages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Primitive {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float32,
    Float64,
    Bool,
    Byte,
    String,
}

impl Primitive {
    /// Its name in a `.msg` file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Int8 => "int8",
            Self::Uint8 => "uint8",
            Self::Int16 => "int16",
            Self::Uint16 => "uint16",
            Self::Int32 => "int32",
            Self::Uint32 => "uint32",
            Self::Int64 => "int64",
            Self::Uint64 => "uint64",
            Self::Float32 => "float32",
            Self::Float64 => "float64",
            Self::Bool => "bool",
            Self::Byte => "byte",
            Self::String => "string",
        }
    }

    /// Its number in `type_description_interfaces/msg/FieldType`, from which type hashes are made.
    pub(crate) fn type_id(self) -> u32 {
        match self {
            Self::Int8 => 2,
            Self::Uint8 => 3,
            Self::Int16 => 4,
            Self::Uint16 => 5,
            Self::Int32 => 6,
            Self::Uint32 => 7,
            Self::Int64 => 8,
            Self::Uint64 => 9,
            Self::Float32 => 10,
            Self::Float64 => 11,
            Self::Bool => 15,
            Self::Byte => 16,
            Self::String => 17,
        }
    }
}

impl Definition {
    /// The name in ROS 2, such as `std_msgs/msg/Header`.
    pub fn full_name(&self) -> String {
        format!("{}/msg/{}", self.package, self.name)
    }

    /// The name on DDS, such as `std_msgs::msg::dds_::Header_`.
    pub fn dds_name(&self) -> String {
        format!("{}::msg::dds_::{}_", self.package, self.name)
    }

    /// The definitions that this one refers to, directly and through others, each once, in the order of their first use.
    pub fn dependencies(&self) -> Vec<&'static Definition> {
        let mut found = Vec::new();
        self.collect(&mut found);
        found
    }

    fn collect(&self, found: &mut Vec<&'static Definition>) {
        for field in self.fields {
            let Some(message) = field.kind.message() else { continue };
            if !found.contains(&message) {
                found.push(message);
                message.collect(found);
            }
        }
    }
}

impl Kind {
    /// The definition of the message that it is or consists of.
    pub(crate) fn message(self) -> Option<&'static Definition> {
        match self {
            Self::Primitive(_) => None,
            Self::Message(message) => Some(message),
            Self::Array(element, _) | Self::Sequence(element) => element.message(),
        }
    }
}

impl Definition {
    /// The content of its `.msg` file.
    pub fn msg(&self) -> String {
        let mut text = String::new();
        comment(&mut text, self.text);
        for constant in self.constants {
            let _ = writeln!(text, "{} {}={}", constant.kind, constant.name, constant.value);
        }
        for Field { name, kind, text: lines } in self.fields {
            comment(&mut text, lines);
            let _ = writeln!(text, "{} {name}", type_name(*kind));
        }
        text
    }

    /// The schema of the encoding `ros2msg`: its definition and those of its dependencies, between lines of 80 `=`.
    ///
    /// Source: MCAP format registry, `ros2msg`.
    pub fn ros2msg(&self) -> String {
        let mut text = self.msg();
        for dependency in self.dependencies() {
            let Definition { package, name, .. } = dependency;
            let _ = writeln!(text, "{}\nMSG: {package}/{name}", "=".repeat(80));
            text += &dependency.msg();
        }
        text
    }
}

fn comment(text: &mut String, lines: &[&str]) {
    for line in lines {
        let _ = writeln!(text, "#{line}");
    }
}

fn type_name(kind: Kind) -> String {
    match kind {
        Kind::Primitive(primitive) => primitive.name().to_owned(),
        Kind::Message(Definition { package, name, .. }) => format!("{package}/{name}"),
        Kind::Array(element, length) => format!("{}[{length}]", type_name(*element)),
        Kind::Sequence(element) => format!("{}[]", type_name(*element)),
    }
}

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
