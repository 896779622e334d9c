//! Message definitions as text: `.msg` files, and the `ros2msg` schemas of MCAP.

use crate::definition::{Definition, Field, Kind};
use std::fmt::Write;

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
