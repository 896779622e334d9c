//! What an end ran with.

use super::Escaped;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The program that made a record, and its settings that differed from their defaults, by key.
#[derive(Debug, Default, PartialEq, serde::Deserialize)]
#[serde(default)]
pub(super) struct SettingsRecord {
    pub(super) program: String,
    pub(super) rehearsal_seed: Option<u64>,
    /// What records had before the seed.
    simulated: bool,
    pub(super) settings: BTreeMap<String, Value>,
}

impl SettingsRecord {
    pub(super) fn is_rehearsal(&self) -> bool {
        self.simulated || self.rehearsal_seed.is_some()
    }

    /// A text among the settings.
    pub(super) fn text(&self, key: &str) -> Option<&str> {
        self.settings.get(key).and_then(Value::as_str)
    }

    /// The settings that mean something away from the computer: addresses and paths are left out.
    pub(super) fn told(&self) -> BTreeMap<&str, Value> {
        self.settings.iter().filter_map(|(key, value)| Some((key.as_str(), told(key, value)?))).collect()
    }

    /// A section of the page; nothing if all had its default.
    pub(super) fn table(&self, page: &mut String, end: &str) {
        if self.settings.is_empty() {
            return;
        }
        let _ = write!(
            page,
            "<h2>Settings of {}</h2>\n<p>Those of the configuration that differ from their defaults, without files, folders, devices and \
             addresses of the computer.</p>\n<table>",
            Escaped(end)
        );
        for (key, value) in self.told() {
            let _ = write!(page, "<tr><td>{}</td><td>{}</td></tr>", Escaped(key), Escaped(&value.to_string()));
        }
        *page += "</table>\n";
    }
}

/// A setting without the address or the path in it; `None` if nothing else is left.
fn told(key: &str, value: &Value) -> Option<Value> {
    if [".host", ".origins", ".networks"].iter().any(|end| key.ends_with(end)) {
        return None;
    }
    let Some(text) = value.as_str().filter(|_| !key.ends_with(".name")) else { return Some(value.clone()) };
    let (kind, rest) = text.split_once(':').unwrap_or(("", text));
    let is_port = !kind.is_empty() && rest.parse::<u16>().is_ok();
    match kind {
        _ if is_port => None,
        "" => (!text.contains(['/', '\\'])).then(|| value.clone()),
        // As in "frames:FOLDER": what was played back is told by its last name.
        "frames" | "bag" | "tum" if key == "camera.source" => {
            let name = rest.trim_end_matches(['/', '\\']).rsplit(['/', '\\']).next().unwrap_or_default();
            Some(format!("{kind}:.../{name}").into())
        }
        kind => Some(format!("{kind}:...").into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn addresses_and_paths_are_left_out() {
        let settings = json!({ "settings": {
            "modem.connect": "127.0.0.1:9731", "camera.source": "frames:rec/C", "label.vocabulary": "/home/a/b.json",
            "console.host": "ship", "console.origins": ["http://a.b"], "modem.kind": "udp", "link.budget_bps": 4000, "vehicle.name": "a/b: c",
        }});
        let record: SettingsRecord = serde_json::from_value(settings).unwrap();
        let told: Vec<String> = record.told().iter().map(|(key, value)| format!("{key} {value}")).collect();
        let expected =
            ["camera.source \"frames:.../C\"", "link.budget_bps 4000", "modem.kind \"udp\"", "vehicle.name \"a/b: c\""];
        assert_eq!(told, expected);
    }
}
