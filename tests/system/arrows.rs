//! The crates depend on each other as the block `arrows` of ARCHITECTURE.md draws it, and on nothing that a sans-IO crate must not have.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Crates that would give a core a clock, a socket, a disk or a runtime.
const IO_CRATES: [&str; 14] = [
    "axum",
    "hyper",
    "nix",
    "ros2-client",
    "rustdds",
    "serialport",
    "scenecast-files",
    "scenecast-ros2",
    "scenecast-sources",
    "tokio",
    "tokio-serial",
    "tracing-subscriber",
    "zenoh",
    "zenoh-ext",
];

/// Crates that do no IO.
const SANS_IO: [&str; 13] = [
    "scenecast-core",
    "scenecast-drivers",
    "scenecast-host",
    "scenecast-labels",
    "scenecast-messages",
    "scenecast-sensors",
    "scenecast-protocol",
    "scenecast-registration",
    "scenecast-surface",
    "scenecast-vehicle",
    "scenecast-worlds",
    "scene-model",
    "sim-channel",
];

/// Crates that no vehicle carries.
const ASHORE: [&str; 9] = [
    "scenecast-bench",
    "scenecast-console",
    "scenecast-modem-sim",
    "scenecast-rehearsal",
    "scenecast-tests",
    "scenecast-tools",
    "scenecast-training",
    "scenecast-worlds",
    "sim-channel",
];

/// Dependencies of tests alone that no arrow allows, each with its reason. None runs back up: the second crate does not need the first.
const TEST_SUPPORT: [(&str, &str, &str); 4] = [
    ("scenecast", "scenecast-tests", "what the tests of the whole system share"),
    ("scenecast", "scenecast-training", "drawn label maps for the tests of `scenecast map`"),
    ("scenecast-bench", "scenecast-tests", "what the tests of the whole system share"),
    ("scenecast-vehicle", "scenecast-worlds", "drawn sea floors and true motion, under planners and orders"),
];

type Arrows = BTreeMap<String, BTreeSet<String>>;

fn metadata(arguments: &[&str]) -> Value {
    let mut cargo = std::process::Command::new(env!("CARGO"));
    cargo.args(["metadata", "--format-version", "1", "--locked"]).args(arguments);
    let output = cargo.current_dir(scenecast_tests::workspace()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn text(value: &Value) -> String {
    value.as_str().unwrap().to_owned()
}

/// The dependencies of each crate of the workspace, by name: those of its tests, or all others.
fn dependencies(of_tests: bool) -> Arrows {
    let metadata = metadata(&["--no-deps"]);
    let packages = metadata["packages"].as_array().unwrap().iter();
    let names = |p: &Value| {
        let some = p["dependencies"].as_array().unwrap().iter().filter(|d| (d["kind"] == "dev") == of_tests);
        some.map(|d| text(&d["name"])).collect()
    };
    packages.map(|p| (text(&p["name"]), names(p))).collect()
}

/// The arrows between crates of ours.
fn ours(all: &Arrows) -> Arrows {
    let is_ours = |name: &&String| all.contains_key(*name);
    all.iter().map(|(name, to)| (name.clone(), to.iter().filter(is_ours).cloned().collect())).collect()
}

/// All crates that a crate needs, directly or not.
fn needed_by(name: &str, arrows: &Arrows) -> BTreeSet<String> {
    let (mut all, mut open) = (BTreeSet::new(), vec![name.to_owned()]);
    while let Some(next) = open.pop() {
        open.extend(arrows[&next].iter().filter(|to| all.insert((*to).clone())).cloned());
    }
    all
}

/// The lines `crate -> crate crate` of the block `arrows` of ARCHITECTURE.md.
fn drawn() -> Arrows {
    let page = std::fs::read_to_string(scenecast_tests::workspace().join("ARCHITECTURE.md")).unwrap();
    let (_, rest) = page.split_once("```arrows\n").expect("ARCHITECTURE.md has a block `arrows`");
    let (block, _) = rest.split_once("```").unwrap();
    let line = |line: &str| {
        let (from, to) = line.split_once("->").unwrap_or_else(|| panic!("no arrow in `{line}`"));
        (from.trim().to_owned(), to.split_whitespace().map(str::to_owned).collect())
    };
    block.lines().filter(|l| !l.trim().is_empty()).map(line).collect()
}

#[test]
fn crates_depend_on_each_other_as_architecture_draws() {
    let (drawn, built) = (drawn(), ours(&dependencies(false)));
    for (name, to) in &built {
        let page = drawn.get(name).unwrap_or_else(|| panic!("ARCHITECTURE.md does not draw {name}"));
        assert_eq!(to, page, "arrows of {name}: left as in its Cargo.toml, right as in ARCHITECTURE.md");
    }
    let unknown: Vec<_> = drawn.keys().filter(|name| !built.contains_key(*name)).collect();
    assert!(unknown.is_empty(), "ARCHITECTURE.md draws crates that do not exist: {unknown:?}");
}

#[test]
fn dependencies_of_tests_follow_the_arrows() {
    let (arrows, of_tests) = (drawn(), ours(&dependencies(true)));
    let outside: BTreeSet<(&str, &str)> = of_tests
        .iter()
        .flat_map(|(name, to)| to.iter().map(move |to| (name.as_str(), to.as_str())))
        .filter(|(name, to)| !needed_by(name, &arrows).contains(*to))
        .collect();
    let support = TEST_SUPPORT.map(|(name, to, _)| (name, to));
    assert_eq!(outside, BTreeSet::from(support), "left against the arrows, right allowed as support of tests");
    let up: Vec<_> = support.into_iter().filter(|(name, to)| needed_by(to, &arrows).contains(*name)).collect();
    assert!(up.is_empty(), "arrows back up: {up:?}");
}

#[test]
fn sans_io_crates_depend_on_no_io_crate() {
    let all = dependencies(false);
    for name in SANS_IO {
        let found: Vec<_> = all[name].iter().filter(|d| IO_CRATES.contains(&d.as_str())).collect();
        assert!(found.is_empty(), "{name} depends on {found:?}");
        let folder = ["", "daemon/"].map(|above| format!("{above}{}", name.trim_start_matches("scenecast-")));
        let guard =
            folder.iter().map(|f| scenecast_tests::workspace().join(f).join("clippy.toml")).find(|f| f.exists());
        let guard = std::fs::read_to_string(guard.unwrap_or_else(|| panic!("{name} has no clippy.toml"))).unwrap();
        for banned in ["Instant::now", "SystemTime::now", "thread::sleep", "HashMap", "fs::", "net::"] {
            assert!(guard.contains(banned), "clippy.toml of {name} does not ban {banned}");
        }
    }
}

#[test]
fn the_vehicle_build_carries_no_page_simulator_or_tools() {
    let tree = std::process::Command::new(env!("CARGO"))
        .args(["tree", "-p", "scenecast", "--no-default-features", "--features", "vehicle", "--edges", "normal"])
        .args(["--prefix", "none", "--locked", "--offline"])
        .current_dir(scenecast_tests::workspace())
        .output()
        .unwrap();
    assert!(tree.status.success(), "{}", String::from_utf8_lossy(&tree.stderr));
    let tree = String::from_utf8(tree.stdout).unwrap();
    let crates: BTreeSet<&str> = tree.lines().filter_map(|l| l.split_whitespace().next()).collect();
    assert!(crates.contains("scenecast-vehicle"), "{tree}");
    let found: Vec<_> = ASHORE.into_iter().chain(["axum", "hyper"]).filter(|name| crates.contains(name)).collect();
    assert!(found.is_empty(), "the vehicle build carries {found:?}");
}
