//! The reference of every key, as Markdown.

use crate::Config;
use crate::key::{Key, Role, Section};

/// Every section as a heading and a table.
pub fn reference() -> String {
    let defaults = Config::default();
    let mut out = String::from("The column *read by* names `auv`, `asv` and the rehearsals `sim` and `demo`.\n");
    for section in Section::ALL {
        out.push_str(&format!("\n### {}\n\n{}\n\n", section.name, section.doc.trim_start()));
        out.push_str("| key | default | allowed | read by | meaning |\n|---|---|---|---|---|\n");
        section.keys.iter().for_each(|key| out.push_str(&row(key, &defaults)));
    }
    out
}

fn row(key: &Key, defaults: &Config) -> String {
    let roles: Vec<&str> = key.roles.iter().map(|role| reader(*role)).collect();
    let cell = |text: &str| text.replace('|', "\\|");
    format!(
        "| `{}` | `{}` | {} | {} | {} |\n",
        key.name,
        key.value(defaults),
        cell(&key.allowed()),
        roles.join(", "),
        cell(key.doc())
    )
}

fn reader(role: Role) -> &'static str {
    match role {
        Role::Auv => "auv",
        Role::Asv => "asv",
        Role::Scenario => "sim",
    }
}
