//! The crates depend on each other as ARCHITECTURE.md says.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

#[test]
fn the_leaf_crates_know_nothing_of_each_other_and_of_tokio() {
    let mut cargo = std::process::Command::new(env!("CARGO"));
    let output =
        cargo.args(["metadata", "--format-version", "1", "--no-deps"]).current_dir(scenecast_tests::workspace());
    let metadata: Value = serde_json::from_slice(&output.output().unwrap().stdout).unwrap();
    let mut arrows: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for package in metadata["packages"].as_array().unwrap() {
        let normal = package["dependencies"].as_array().unwrap().iter().filter(|d| d["kind"] != "dev");
        let names = normal.map(|d| d["name"].as_str().unwrap().to_owned()).collect();
        arrows.insert(package["name"].as_str().unwrap().to_owned(), names);
    }
    let ours = ["scenecast", "scenecast-protocol", "scene-model", "sim-channel", "scenecast-tests"];
    for leaf in ["scenecast-protocol", "scene-model", "sim-channel"] {
        let banned: BTreeSet<&str> = ours.into_iter().chain(["tokio", "serialport", "tokio-serial", "axum"]).collect();
        let found: Vec<_> = arrows[leaf].iter().filter(|d| banned.contains(d.as_str())).collect();
        assert!(found.is_empty(), "{leaf} depends on {found:?}");
    }
    assert!(!arrows["scenecast"].contains("scenecast-tests"));
}
