//! Configuration files with every key explained, the reference of every key as Markdown, and the JSON Schema of configuration
//! files.

use crate::sections::key::{Key, Role, Section};
use crate::{Config, load};
use scenecast_core::UserError;
use serde_json::{Map, Value, json};

/// Columns after which comments are wrapped.
const WIDTH: usize = 100;

/// A file that ships with the program.
struct Shipped {
    path: &'static str,
    role: Role,
    head: &'static str,
    /// Values that differ from the defaults.
    sets: &'static [&'static str],
}

const SHIPPED: [Shipped; 6] = [
    Shipped {
        path: "config/auv.toml",
        role: Role::Auv,
        head: "# The vehicle. Every key may be left out. The values are the defaults, except modem.connect, survey.area_m\n\
               # and runtime.state_dir.\n\
               # A rehearsal on one machine: scenecast asv --config config/asv.toml, then in another terminal\n\
               # scenecast auv --config config/auv.toml --set camera.source=frames:DIR, where DIR is a recording.\n",
        sets: &["modem.connect=127.0.0.1:8461", "survey.area_m=[0, 0, 100, 60]", "runtime.state_dir=state/auv"],
    },
    Shipped {
        path: "config/asv.toml",
        role: Role::Asv,
        head: "# The surface. Every key may be left out. The values are the defaults, except modem.listen and\n\
               # runtime.state_dir.\n",
        sets: &["modem.listen=127.0.0.1:8461", "runtime.state_dir=state/asv"],
    },
    Shipped {
        path: "config/scenarios/default.toml",
        role: Role::Scenario,
        head: "# A rehearsal with every key at its default.\n\
               # scenecast sim --scenario config/scenarios/default.toml --out run\n",
        sets: &[],
    },
    Shipped {
        path: "config/radio-auv.toml",
        role: Role::Auv,
        head: "# A vehicle at the surface with a radio or a network of 200 kbit/s in both directions at once, over UDP, which sends\n\
               # labels of another program (dir:labels). For another rate, set modem.bit_rate and link.budget_bps alike, from 10 000\n\
               # to 1 000 000; below 50 000, frames of 500 bytes keep orders and status prompt.\n\
               # The other end: config/radio-asv.toml.\n",
        sets: &[
            "modem.kind=udp",
            "modem.full_duplex=true",
            "modem.listen=0.0.0.0:8461",
            "modem.bit_rate=200000",
            "modem.tx_watts=0",
            "link.budget_bps=200000",
            "link.frame_bytes=1000",
            "link.status_period_s=1",
            "labels.source=dir:labels",
            "survey.area_m=[0, 0, 100, 60]",
            "runtime.state_dir=state/auv",
        ],
    },
    Shipped {
        path: "config/radio-asv.toml",
        role: Role::Asv,
        head: "# The operator's end of the radio of config/radio-auv.toml. Set modem.connect to the vehicle's address.\n",
        sets: &[
            "modem.kind=udp",
            "modem.full_duplex=true",
            "modem.connect=127.0.0.1:8461",
            "modem.bit_rate=200000",
            "modem.tx_watts=0",
            "link.budget_bps=200000",
            "link.frame_bytes=1000",
            "runtime.state_dir=state/asv",
        ],
    },
    Shipped {
        path: "config/scenarios/radio.toml",
        role: Role::Scenario,
        head: "# A rehearsal of the radio of config/radio-auv.toml, with a fifth of the frames lost.\n\
               # scenecast sim --scenario config/scenarios/radio.toml --set labels.source=dir:FOLDER --out run\n",
        sets: &[
            "modem.kind=udp",
            "modem.full_duplex=true",
            "modem.tx_watts=0",
            "link.budget_bps=200000",
            "link.frame_bytes=1000",
            "link.status_period_s=1",
            "channel.bit_rate=200000",
            "channel.range_m=10",
            "channel.loss=0.2",
            "channel.half_duplex=false",
        ],
    },
];

/// The files that ship with the program: path in the repository and text.
///
/// # Errors
/// A value that is not allowed; a test rules that out.
pub fn shipped_files() -> Result<Vec<(&'static str, String)>, UserError> {
    let text = |file: &Shipped| {
        let sets: Vec<String> = file.sets.iter().map(|set| (*set).to_owned()).collect();
        Ok((file.path, format!("{}\n{}", file.head, print_values(file.role, &load(None, &sets)?))))
    };
    SHIPPED.iter().map(text).collect()
}

/// A program, the seed of a rehearsal, and the keys that differ from their defaults, as JSON. Commands, which may hold passwords, are
/// not told.
pub fn changed_settings(program: &str, rehearsal_seed: Option<u64>, config: &Config) -> String {
    let defaults = Config::default();
    let differs = |key: &&Key| key.value(config) != key.value(&defaults);
    let told = |key: &Key| {
        let value = key.value(config);
        let is_command = value.as_str().is_some_and(|text| text.starts_with("command:"));
        (key.name.to_owned(), if is_command { json!("command:...") } else { json!(value) })
    };
    // Files, devices and ports of a computer say nothing about the mission.
    let is_of_computer = |key: &&Key| {
        ["_file", "_dir", ".folder", ".listen", ".device", ".port"].iter().any(|end| key.name.ends_with(end))
    };
    let differs = |key: &&Key| differs(key) && !is_of_computer(key);
    let settings: Map<String, Value> = Key::all().filter(differs).map(told).collect();
    json!({ "program": program, "rehearsal_seed": rehearsal_seed, "settings": settings }).to_string()
}

/// A file with the defaults of every key that a role reads.
pub fn print(role: Role) -> String {
    print_values(role, &Config::default())
}

fn print_values(role: Role, config: &Config) -> String {
    let mut out = String::new();
    for section in Section::ALL {
        let keys: Vec<&Key> = section.keys.iter().filter(|key| key.roles.contains(&role)).collect();
        if keys.is_empty() {
            continue;
        }
        let gap = if out.is_empty() { "" } else { "\n" };
        out.push_str(&format!("{gap}[{}]\n", section.name));
        for key in keys {
            let allowed = format!("Allowed: {}.", key.allowed());
            let value = key.value(config);
            out.push_str(&format!("{}{}{} = {value}\n", comment(key.doc()), comment(&allowed), key.leaf()));
        }
    }
    out
}

/// A text as lines of a comment.
fn comment(text: &str) -> String {
    let mut lines = vec![String::from("#")];
    for word in text.split_whitespace() {
        if lines.last().is_some_and(|line| line.len() + 1 + word.len() > WIDTH) {
            lines.push(String::from("#"));
        }
        if let Some(line) = lines.last_mut() {
            line.push(' ');
            line.push_str(word);
        }
    }
    lines.iter().map(|line| format!("{line}\n")).collect()
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CameraSource;

    #[test]
    fn changed_settings_tell_no_command() {
        let mut config = Config::default();
        config.camera.source = CameraSource::Command("ffmpeg -i rtsp://anna:secret@camera".to_owned());
        config.channel.loss = 0.2;
        config.link.key_file = Some("secret.key".into());
        let text = changed_settings("scenecast 1", Some(7), &config);
        assert!(text.starts_with(r#"{"program":"scenecast 1","#) && !text.contains("secret"), "{text}");
        assert!(text.contains(r#""camera.source":"command:...""#) && text.contains(r#""channel.loss":0.2"#), "{text}");
        assert!(text.contains(r#""rehearsal_seed":7"#), "{text}");
    }
}
