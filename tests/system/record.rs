//! Records of missions: read by another program, cut by a kill, the same for the same seed.

use scenecast_tests::{
    LIGHT, Process, assert_refused, free_port, http, python, run, run_script, scenecast, scratch, state, wait_until,
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
    assert!(vehicle["frames"].as_u64() > Some(10), "camera frames that changed cells: {vehicle}");
    assert_eq!(surface["frames"], 0, "the surface knows no camera frames");
    for end in [&surface, &vehicle] {
        let carried = end["carried"].as_array().unwrap();
        assert!(["map", "status"].iter().all(|content| carried.contains(&(*content).into())), "{end}");
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
    let records = ["record_surface", "record_vehicle"].map(|name| dir.join(name));
    let [surface, vehicle] = records.each_ref().map(|record| record.to_str().unwrap());
    let report = |more: &[&str]| {
        let output = run(&[&["report", surface, vehicle][..], more].concat());
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
        "95 % interval",
        "share of the cells that the vehicle had to send that the operator's map had",
        "age of the last frame",
        "<h2>Events</h2>",
        "2000-01-01T00:0",
        "channel.loss</td><td>0.2",
        "<h2>How to cite</h2>",
        "rehearsal over a simulated sea floor",
        "had arrived by the end",
        "aria-label=\"scale\"",
        "<h3>Link by round trip</h3>",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(
        !page.contains("http://")
            || page.matches("http://").count() == page.matches("http://www.w3.org/2000/svg").count()
    );
    let zip = dir.join("dive.zip");
    report(&["--zip", zip.to_str().unwrap()]);
    if let Some(python) = python("zipfile") {
        let files: u32 = run_script(&python, "tests/read_report.py", &[zip.to_str().unwrap()]).trim().parse().unwrap();
        assert!(files > 15, "{files}");
    }
    assert_refused(&["report", dir.join("record_vehicle").to_str().unwrap()], &["no record of a surface"]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_replay_shows_each_moment_as_either_side_knew_it() {
    let (dir, port) = (scratch("record-replay"), free_port().to_string());
    simulate(&dir);
    let records = ["record_surface", "record_vehicle"].map(|name| dir.join(name));
    let [surface, vehicle] = records.each_ref().map(|record| record.to_str().unwrap());
    let replay = Process::start(&["replay", surface, vehicle, "--port", &port]);
    let port = port.parse().unwrap();
    wait_until("the page is there", || state(port).is_some());
    let begin = state(port).unwrap();
    let times = ["from_utc_s", "to_utc_s"].map(|name| begin["replay"][name].as_f64().unwrap());
    assert_eq!(begin["replay"]["sides"], serde_json::json!(["operator", "vehicle", "difference"]));
    let post = |path: &str, body: serde_json::Value| {
        http(port, "POST", path, "X-Scenecast: 1\r\nContent-Type: application/json\r\n", &body.to_string()).unwrap()
    };
    let cells_of = |side: &str, at: f64| {
        let (status, _) = post("/api/v2/replay", serde_json::json!({ "at_utc_s": at, "side": side }));
        assert_eq!(status, 200);
        state(port).unwrap()["vehicles"][0]["map"]["explored_cells"].as_u64().unwrap()
    };
    let sides = ["operator", "vehicle", "difference"];
    let end = sides.map(|side| cells_of(side, times[1]));
    assert!(end[0] > 100 && end[0] == end[1] && end[2] == 0, "{end:?}");
    // With a loss of a fifth the maps differ at one of these moments at least.
    let moments = [5, 15, 25, 35, 45].map(|s| times[0] + f64::from(s));
    let differing = moments.map(|at| sides.map(|side| cells_of(side, at)));
    assert!(differing.iter().all(|[operator, vehicle, both]| *both >= vehicle.abs_diff(*operator)), "{differing:?}");
    assert!(differing.iter().any(|[operator, vehicle, both]| operator < vehicle && *both > 0), "{differing:?}");
    assert!(differing[0][1] < end[1], "{differing:?}");
    let map = http(port, "GET", "/api/v2/vehicles/1/map.csv", "", "").unwrap();
    let lines = String::from_utf8(map.1).unwrap().lines().count() as u64;
    assert_eq!((map.0, lines), (200, differing[4][2] + 1), "a file of the map that is shown");
    let (status, report) = http(port, "GET", "/api/v2/report.html", "", "").unwrap();
    assert!(status == 200 && String::from_utf8(report).unwrap().contains("<h1>Dive report"));
    let (status, events) = http(port, "GET", "/api/v2/replay/events", "", "").unwrap();
    assert!(status == 200 && String::from_utf8(events).unwrap().contains("\"label\""));
    let log = |at: f64| {
        cells_of("operator", at);
        let body = http(port, "GET", "/api/v2/log", "", "").unwrap().1;
        serde_json::from_slice::<serde_json::Value>(&body).unwrap()["entries"].as_array().unwrap().clone()
    };
    assert!(log(times[0]).len() < log(times[1]).len());
    assert!(log(times[1])[0]["utc"].as_str().unwrap().starts_with("2000-01-01T00:0"), "{}", log(times[1])[0]);
    let refused = [
        ("/api/v2/vehicles/1/constraints", serde_json::json!({ "hold": true, "abort": false }), 403),
        ("/api/v2/replay", serde_json::json!({ "speed": 0 }), 422),
        ("/api/v2/replay", serde_json::json!({ "moment": 1 }), 422),
    ];
    for (path, body, status) in refused {
        assert_eq!(post(path, body.clone()).0, status, "{path} {body}");
    }
    drop(replay);
    assert_refused(&["replay", dir.join("none").to_str().unwrap()], &["none"]);
    std::fs::remove_dir_all(dir).unwrap();
}

#[test]
fn a_replayed_channel_loses_the_same_frames() {
    let dir = scratch("record-channel");
    let [first, again, other] = ["first", "again", "other"].map(|name| dir.join(name));
    simulate(&first);
    let replay = format!("channel.replay={}", first.display());
    let fly = |out: &Path, seed: &str| {
        let fixed = ["sim", "--duration", "60", "--seed", seed, "--set", &replay, "--out", out.to_str().unwrap()];
        let flown = run(&[&fixed[..], &LIGHT].concat());
        assert!(flown.status.success(), "{}", String::from_utf8_lossy(&flown.stderr));
    };
    fly(&again, "3");
    let text = |out: &Path, file: &str| std::fs::read_to_string(out.join(file)).unwrap();
    // Fields of a line: time, direction, bytes, kind, fate, reason.
    let fates = |out: &Path| -> Vec<String> {
        text(out, "frames.log").lines().map(|line| line.split(' ').take(5).collect::<Vec<_>>().join(" ")).collect()
    };
    let lost = |out: &Path| fates(out).iter().filter(|line| line.ends_with("lost")).count();
    assert!(lost(&first) > 3);
    assert_eq!(fates(&first), fates(&again));
    let map = |out: &Path| std::fs::read(out.join("operator-map.png")).unwrap();
    assert!(map(&first) == map(&again), "the operator's map");
    fly(&other, "4");
    assert!(lost(&other) > 0 && fates(&other) != fates(&first), "another mission over the same channel");
    let (nowhere, out) = (format!("channel.replay={}", dir.display()), dir.join("none"));
    assert_refused(&["sim", "--set", &nowhere, "--out", out.to_str().unwrap()], &["no record"]);
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
