//! Records of missions: read by another program, cut by a kill, the same for the same seed.

use scenecast_tests::{
    LIGHT, Process, assert_refused, free_port, python, run, run_script, scenecast, scratch, state, wait_until,
    workspace,
};
use std::path::{Path, PathBuf};

/// What `tests/read_record.py` found in a record.
fn read(folder: &Path) -> Option<serde_json::Value> {
    let python = python("rosbags.rosbag2")?;
    let said = run_script(&python, "tests/read_record.py", &[folder.to_str().unwrap()]);
    Some(serde_json::from_str(&said).unwrap())
}

fn simulate(out: &Path) {
    let out = out.to_str().unwrap();
    let said =
        run(&[&["sim", "--duration", "60", "--seed", "3", "--set", "channel.loss=0.2", "--out", out][..], &LIGHT]
            .concat());
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
}

#[test]
fn both_records_of_a_rehearsal_end_with_the_same_map() {
    let dir = scratch("record-sim");
    simulate(&dir.join("a"));
    let Some(surface) = read(&dir.join("a/record_surface")) else { return };
    let vehicle = read(&dir.join("a/record_vehicle")).unwrap();
    assert!(surface["cells"].as_u64() > Some(100), "{surface}");
    assert_eq!((&surface["cells"], &surface["digest"]), (&vehicle["cells"], &vehicle["digest"]));
    let report: serde_json::Value = serde_json::from_slice(&std::fs::read(dir.join("a/report.json")).unwrap()).unwrap();
    assert_eq!(surface["cells"], report["survey"]["explored_cells"], "the map at the end");
    assert!(surface["versions"].as_u64() > Some(3) && vehicle["versions"].as_u64() > Some(3));
    for topic in [
        "state",
        "frames",
        "events",
        "auv_1/map_cells",
        "auv_1/label_tree",
        "auv_1/order_status",
        "auv_1/pose",
        "auv_1/link",
    ] {
        assert!(surface["topics"][format!("/scenecast/{topic}")].as_u64() > Some(0), "{topic}: {surface}");
    }
    for topic in ["frames", "auv_1/map_cells", "auv_1/order_status", "auv_1/pose", "auv_1/link", "auv_1/events"] {
        assert!(vehicle["topics"][format!("/scenecast/{topic}")].as_u64() > Some(0), "{topic}: {vehicle}");
    }
    let decoded = run(&["wire", "decode", dir.join("a/record_surface").to_str().unwrap(), "--mission", "1"]);
    let lines = String::from_utf8_lossy(&decoded.stdout).lines().count() as u64;
    assert_eq!(Some(lines), surface["topics"]["/scenecast/frames"].as_u64(), "{decoded:?}");
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_report_says_what_the_record_has() {
    let dir = scratch("record-report");
    simulate(&dir);
    let record = dir.join("record_surface");
    let report = |more: &[&str]| {
        let output = run(&[&["report", record.to_str().unwrap()][..], more].concat());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    let figures: serde_json::Value = serde_json::from_str(&report(&["--json"])).unwrap();
    let vehicle = &figures["vehicles"][0];
    let cells: u64 = vehicle["classes"].as_array().unwrap().iter().filter_map(|class| class["cells"].as_u64()).sum();
    let page = dir.join("dive.html");
    report(&["--out", page.to_str().unwrap()]);
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains(&format!("The map that arrived has {cells} cells")), "{vehicle}");
    for sentence in vehicle["summary"].as_array().unwrap() {
        assert!(page.contains(sentence.as_str().unwrap()), "{sentence}");
    }
    for part in [
        "<svg",
        "class=\"track\"",
        "data:image/webp;base64,",
        "<h3>Orders</h3>",
        "<h2>Events</h2>",
        "2000-01-01T00:0",
        "channel.loss</td><td>0.2",
        "<h2>How to cite</h2>",
        "rehearsal over a simulated sea floor",
        "have arrived by the end",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org/2000/svg").count()
    );
    assert_refused(&["report", dir.join("record_vehicle").to_str().unwrap()], &["no record of a surface"]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn the_same_seed_gives_the_same_record() {
    let dir = scratch("record-seed");
    let out = ["a", "b"].map(|name| dir.join(name));
    out.iter().for_each(|out| simulate(out));
    for file in
        ["record_surface/record_surface_0.mcap", "record_vehicle/record_vehicle_0.mcap", "record_surface/metadata.yaml"]
    {
        let [a, b] = [0, 1].map(|at| std::fs::read(out[at].join(file)).unwrap());
        assert!(a == b, "{file}: {} and {} bytes", a.len(), b.len());
    }
    std::fs::remove_dir_all(dir).unwrap();
}

/// The only record in a folder.
fn only(folder: &Path) -> Option<PathBuf> {
    std::fs::read_dir(folder).ok()?.next()?.ok().map(|entry| entry.path())
}

#[test]
fn a_killed_surface_leaves_a_record_that_is_made_whole() {
    let (dir, port) = (scratch("record-killed"), free_port());
    let records = dir.join("records");
    let sets = [
        format!("console.listen=127.0.0.1:{port}"),
        format!("runtime.state_dir={}", dir.join("state").display()),
        format!("record.folder={}", records.display()),
        format!("modem.listen=127.0.0.1:{}", free_port()),
    ];
    let config = workspace().join("config/asv.toml");
    let mut arguments = vec!["asv", "--config", config.to_str().unwrap()];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    let mut surface = Process::start(&arguments);
    let size = || only(&records).and_then(|record| Some(std::fs::metadata(part(&record)).ok()?.len()));
    wait_until("the page is there", || state(port).is_some());
    wait_until("a first chunk is on the disk", || size() > Some(500));
    surface.kill();
    let record = only(&records).unwrap();
    let recovered = scenecast().args(["record", "recover", record.to_str().unwrap()]).output().unwrap();
    let said = String::from_utf8_lossy(&recovered.stdout).into_owned();
    assert!(recovered.status.success() && said.contains(" messages"), "{said}{recovered:?}");
    let again = run(&["record", "recover", record.to_str().unwrap()]);
    assert!(String::from_utf8_lossy(&again.stdout).contains("whole, as it was"), "{again:?}");
    std::fs::remove_dir_all(dir).unwrap();
}

fn part(record: &Path) -> PathBuf {
    record.join(format!("{}_0.mcap", record.file_name().unwrap().to_str().unwrap()))
}
