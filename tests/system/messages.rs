//! The messages against `rosbags`, which nobody here wrote: definitions, type hashes and bytes.

use scenecast_messages::CATALOGUE;
use std::io::Write;
use std::process::Command;

/// A Python with rosbags; without one the test is skipped, which CI takes for a failure.
fn python() -> Option<String> {
    let python = std::env::var("SCENECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python).args(["-c", "import rosbags.typesys"]).output();
    if output.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let line = format!("SKIPPED: {python} has no rosbags (tests/python/requirements.txt; SCENECAST_PYTHON)\n");
    assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{line}");
    // The harness hides the captured output of a test that passes.
    let _ = std::io::stderr().write_all(line.as_bytes());
    None
}

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap()).collect()
}

#[test]
fn definitions_hashes_and_bytes_are_those_of_rosbags() {
    let Some(python) = python() else { return };
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
    scenecast_tests::run_script(&python, "tests/messages_peer.py", &paths);
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
