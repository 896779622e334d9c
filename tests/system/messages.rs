//! The messages against `rosbags`, which nobody here wrote: definitions, type hashes and bytes.

use scenecast_messages::CATALOGUE;
use scenecast_tests::{python, run_script};

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

#[test]
fn definitions_hashes_and_bytes_are_those_of_rosbags() {
    let Some(python) = python("rosbags.typesys") else { return };
    let folder = std::env::temp_dir().join(format!("scenecast-messages-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let [definitions, samples] = ["definitions.json", "samples"].map(|name| folder.join(name));
    let list: Vec<serde_json::Value> = CATALOGUE
        .iter()
        .map(|entry| entry.definition)
        .map(|d| serde_json::json!({ "name": d.full_name(), "hash": d.type_hash(), "msg": d.msg(), "schema": d.ros2msg() }))
        .collect();
    std::fs::write(&definitions, serde_json::to_vec(&list).unwrap()).unwrap();
    let paths = [&definitions, &samples].map(|path| path.to_str().unwrap());
    run_script(&python, "tests/messages_peer.py", &paths);
    let samples = std::fs::read_to_string(&samples).unwrap();
    let mut compared = 0;
    for line in samples.lines() {
        let (name, hex) = line.split_once(' ').unwrap();
        let entry = CATALOGUE.iter().find(|entry| entry.definition.full_name() == name).unwrap();
        let bytes = bytes(hex);
        let again = (entry.recode)(&bytes).unwrap_or_else(|e| panic!("{name}: {e}: {hex}"));
        assert_eq!(again, bytes, "{name}");
        compared += 1;
    }
    assert!(compared >= 10 * CATALOGUE.len(), "{compared} samples");
    std::fs::remove_dir_all(&folder).unwrap();
}
