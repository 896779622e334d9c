//! The table of renamed JSON members is applied to a report from before the renames, and the names are those of today.

use scenecast_protocol::map::BUILT_IN_LAYERS;
use scenecast_tests::{run, scratch, workspace};
use serde_json::{Map, Value};
use std::collections::BTreeSet;
use std::path::Path;

fn read(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).expect("the file can be read");
    serde_json::from_str(&text).expect("the file is JSON")
}

/// The new name of a member, by the old names of it and of the members around it.
fn name_of(path: &[String], renames: &Map<String, Value>) -> String {
    let matches = |old: &str| path.ends_with(&old.split('.').map(str::to_owned).collect::<Vec<_>>());
    let found = renames.iter().find(|(old, _)| matches(old)).and_then(|(_, new)| new.as_str());
    found.or(path.last().map(String::as_str)).unwrap_or_default().to_owned()
}

/// The path of each member, with the new names.
fn members(value: &Value, old: &[String], new: &str, renames: &Map<String, Value>, found: &mut BTreeSet<String>) {
    match value {
        Value::Object(inner) => {
            for (name, value) in inner {
                let old = [old, std::slice::from_ref(name)].concat();
                let new = format!("{new}.{}", name_of(&old, renames));
                found.insert(new.clone());
                members(value, &old, &new, renames, found);
            }
        }
        Value::Array(inner) => inner.iter().for_each(|value| members(value, old, new, renames, found)),
        _ => {}
    }
}

#[test]
fn reports_have_the_new_names_of_all_old_members() {
    let golden = workspace().join("tests/golden");
    let renames = read(&golden.join("renames.json"));
    let renames = renames.as_object().expect("an object of old and new names");
    let out = scratch("renames");
    let output = run(&["sim", "--duration", "60", "--seed", "1", "--out", &out.display().to_string()]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let (mut old, mut new) = (BTreeSet::new(), BTreeSet::new());
    members(&read(&golden.join("report_before_renames.json")), &[], "", renames, &mut old);
    members(&read(&out.join("report.json")), &[], "", &Map::new(), &mut new);
    // These members exist only where a frame was dropped.
    old.retain(|path| !path.contains(".dropped."));
    new.retain(|path| !path.contains(".dropped."));
    // The registration and the quality were added since then.
    new.retain(|path| !path.starts_with(".registration") && !path.starts_with(".quality"));
    // So were the energy, the repeats and the uses of the uplink.
    let is_later = |path: &str| ["energy_j", "energy_per_map_bit_j"].iter().any(|name| path.ends_with(name));
    new.retain(|path| !is_later(path) && !path.starts_with(".link.repeats") && !path.starts_with(".link.uplink_bytes"));
    // A layer that was added since then has its own member.
    let of_layers = BUILT_IN_LAYERS.iter().map(|layer| format!(".link.bytes_by_class.{}", layer.descriptor.name));
    let added: BTreeSet<String> = of_layers.filter(|path| !old.contains(path)).collect();
    assert_eq!(&old | &added, new);
}

#[test]
fn the_golden_link_table_has_no_old_name() {
    let golden = workspace().join("tests/golden");
    let renames = read(&golden.join("renames.json"));
    let renames = renames.as_object().expect("an object of old and new names");
    let mut names = BTreeSet::new();
    members(&read(&golden.join("link_table.json")), &[], "", &Map::new(), &mut names);
    for old in renames.keys() {
        assert!(!names.iter().any(|path| path.ends_with(&format!(".{old}"))), "{old}");
    }
}
