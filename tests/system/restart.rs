//! A surface that is killed and started again shows the same page.

use scenecast_tests::{
    Process, free_port, http, is_full, lacks_browser, recorded, run, scratch, wait_until, workspace,
};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

struct Pair {
    dir: PathBuf,
    console: u16,
    surface_file: String,
    vehicle_file: String,
}

fn pair(name: &str) -> Pair {
    let (recording, _) = recorded();
    let dir = scratch(name);
    let (modem, console) = (free_port(), free_port());
    let file = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let runtime = |who: &str| format!("[runtime]\ntime_scale = 20\nstate_dir = \"{}\"\n", dir.join(who).display());
    let surface = format!(
        "{}[modem]\nlisten = \"127.0.0.1:{modem}\"\n[console]\nlisten = \"127.0.0.1:{console}\"\n",
        runtime("asv")
    );
    let vehicle = format!(
        "{}[modem]\nconnect = \"127.0.0.1:{modem}\"\n[camera]\nsource = \"frames:{}\"\n",
        runtime("auv"),
        recording.display()
    );
    let (surface_file, vehicle_file) = (file("asv.toml", surface), file("auv.toml", vehicle));
    Pair { dir, console, surface_file, vehicle_file }
}

impl Pair {
    fn surface(&self) -> Process {
        Process::start(&["asv", "--config", &self.surface_file])
    }

    fn vehicle(&self) -> Process {
        Process::start(&["auv", "--config", &self.vehicle_file])
    }

    fn state(&self) -> Option<Value> {
        let (status, body) = http(self.console, "GET", "/api/v2/state", "", "")?;
        (status == 200).then(|| serde_json::from_slice(&body).unwrap())
    }

    fn auv(&self) -> Value {
        self.state().map_or(Value::Null, |state| state["vehicles"][0].clone())
    }

    fn post(&self, path: &str, body: &str) {
        let headers = "Content-Type: application/json\r\nX-Scenecast: 1\r\n";
        let (status, answer) = http(self.console, "POST", &format!("/api/v2/{path}"), headers, body).unwrap();
        assert!(status < 300, "{path}: {status} {}", String::from_utf8_lossy(&answer));
    }
}

/// The members of a vehicle that do not change while it is silent.
fn lasting(mut vehicle: Value) -> Value {
    let members = vehicle.as_object_mut().unwrap();
    // Reports on the content in force begin again with the surface that runs now.
    for changing in ["link", "next_contact_s", "expected_interval_s", "in_force"] {
        members.remove(changing);
    }
    let map = members["map"].as_object_mut().unwrap();
    map.remove("version");
    map.remove("earlier");
    // Gains are counted from the start of the surface on.
    for label in members["labels"].as_array_mut().unwrap() {
        label.as_object_mut().unwrap().remove("gained_m2");
    }
    vehicle
}

fn cells(pair: &Pair) -> Vec<String> {
    let (_, csv) = http(pair.console, "GET", "/api/v2/vehicles/1/map.csv", "", "").unwrap();
    // East, north and label of each cell; its age goes on.
    let line = |line: &str| line.split(',').take(3).collect::<Vec<_>>().join(",");
    String::from_utf8(csv).unwrap().lines().map(line).collect()
}

/// Text and place of the only marker in the exported file.
fn marker_of(pair: &Pair) -> (String, Vec<f64>) {
    let (_, file) = http(pair.console, "GET", "/api/v2/vehicles/1/map.geojson", "", "").unwrap();
    let file: Value = serde_json::from_slice(&file).unwrap();
    let points = file["features"].as_array().unwrap().iter().filter(|f| f["geometry"]["type"] == "Point");
    let [point] = points.collect::<Vec<_>>()[..] else { panic!("one marker is left") };
    let place = point["geometry"]["coordinates"].as_array().unwrap();
    let place = place.iter().filter_map(Value::as_f64).collect();
    (point["properties"]["marker"].as_str().unwrap().to_owned(), place)
}

/// The panels of the page as text, without ages; `None` where there is no browser.
fn page_text(pair: &Pair) -> Option<Value> {
    if lacks_browser() {
        return None;
    }
    let url = format!("http://127.0.0.1:{}", pair.console);
    let script = workspace().join("tests/browser/page-text.mjs");
    let output = Command::new("node").arg(script).args(["--url", &url]).output().expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).expect("the script prints JSON"))
}

/// Only its user can read what a process keeps.
fn assert_private(folder: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(folder), 0o700, "{}", folder.display());
        let files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty());
        files.iter().filter(|path| path.is_file()).for_each(|path| assert_eq!(mode(path), 0o600, "{}", path.display()));
    }
}

#[test]
fn a_killed_surface_shows_the_same_page_again() {
    let pair = pair("same-page");
    let mut surface = pair.surface();
    let mut vehicle = pair.vehicle();
    wait_until("a map", || pair.auv()["map"]["explored_cells"].as_u64() > Some(20));
    let label = pair.auv()["labels"][0]["id"].as_u64().unwrap();
    pair.post("vehicles/1/fence", r#"{"fence": [[-500,-500],[500,-500],[500,500],[-500,500]]}"#);
    pair.post("vehicles/1/limits", r#"{"silence_s": 900, "on_silence": "hold"}"#);
    pair.post("vehicles/1/settings", r#"{"planner": "greedy"}"#);
    pair.post("vehicles/1/labels", &format!(r##"{{"label": {label}, "name": "sand", "colour": "#112233"}}"##));
    pair.post("vehicles/1/notes", r#"{"text": "a wreck"}"#);
    for text in ["a wreck", "a mistake"] {
        pair.post("vehicles/1/markers", &format!(r#"{{"x_m": 4.5, "y_m": -3, "text": "{text}"}}"#));
    }
    pair.post("vehicles/1/markers/remove", r#"{"number": 2}"#);
    let is_applied = |vehicle: &Value| !vehicle["fence_in_force"].is_null() && !vehicle["limits_in_force"].is_null();
    wait_until("the orders are applied", || is_applied(&pair.auv()));
    vehicle.kill();
    // A terminal that closes ends no surface.
    surface.hang_up();
    pair.post("vehicles/1/utility", &format!(r#"{{"weights": {{"{label}": 0.5}}, "exploration": 0.2}}"#));
    let utility =
        |v: &Value| v["directive"]["slots"].as_array().unwrap().iter().find(|s| s["slot"] == "utility").cloned();
    let (text, before, map) = (page_text(&pair), pair.state().unwrap(), cells(&pair));
    assert_private(&pair.dir.join("asv"));
    assert_private(&pair.dir.join("auv"));
    surface.kill();
    let began = Instant::now();
    let _surface = pair.surface();
    wait_until("the page is back", || pair.state().is_some());
    let back = began.elapsed();
    assert!(!is_full() || back < Duration::from_secs(2), "{back:?}");
    let after = pair.state().unwrap();
    assert_eq!(lasting(after["vehicles"][0].clone()), lasting(before["vehicles"][0].clone()));
    assert_eq!(page_text(&pair), text);
    assert_eq!(after["command"], before["command"]);
    assert_eq!(after["command"]["holder"]["name"], "local");
    assert_eq!(cells(&pair), map);
    assert_eq!(marker_of(&pair), ("a wreck".to_owned(), vec![4.5, -3.0]));
    assert_eq!(after["mission"]["id"], before["mission"]["id"]);
    assert!(after["now_s"].as_f64() > before["now_s"].as_f64(), "ages continue");
    assert!(!after["vehicles"][0]["map"]["earlier"].is_null(), "the map is not shown as live");
    let second = run(&[
        "asv",
        "--config",
        &pair.surface_file,
        "--set",
        "console.listen=\"\"",
        "--set",
        "modem.listen=127.0.0.1:0",
    ]);
    let line = String::from_utf8_lossy(&second.stderr).into_owned();
    assert!(second.status.code() == Some(2) && line.contains("another process"), "{line}");

    // The vehicle comes back: the pending order reaches it, and the current map takes the place of the earlier one.
    let _vehicle = pair.vehicle();
    let version = |state: &Value| utility(&state["vehicles"][0]).unwrap()["version"].clone();
    assert_eq!(version(&after), version(&before));
    wait_until("the order is decided", || {
        let order = utility(&pair.auv()).unwrap();
        (order["state"] == "applied" || order["state"] == "refused") && order["version"] == version(&before)
    });
    wait_until("the current map is in view", || pair.auv()["map"]["earlier"].is_null());
    let (_, list) = http(pair.console, "GET", "/api/v2/archive", "", "").unwrap();
    let list: Value = serde_json::from_slice(&list).unwrap();
    let name = list["maps"][0]["name"].as_str().expect("the map before the restart is archived").to_owned();
    for (file, head) in
        [("map.png", "\u{89}PNG"), ("map.csv", "east"), ("map.geojson", "{"), ("map.ply", "ply"), ("map.tif", "II*")]
    {
        let (status, bytes) = http(pair.console, "GET", &format!("/api/v2/archive/{name}/{file}"), "", "").unwrap();
        let begin: String = bytes.iter().take(16).map(|&b| char::from(b)).collect();
        assert!(status == 200 && begin.starts_with(head), "{file}: {status} {begin}");
    }
    let (_, regions) = http(pair.console, "GET", &format!("/api/v2/archive/{name}/map.geojson"), "", "").unwrap();
    let regions: Value = serde_json::from_slice(&regions).unwrap();
    let of_label = regions["features"].as_array().unwrap().iter().find(|region| region["id"] == label);
    assert_eq!(of_label.expect("the label is on the map")["properties"]["name"], "sand");
    assert!(Path::new(&pair.dir.join(format!("asv/{name}.scmap"))).exists());
}

#[cfg(unix)]
#[test]
fn a_removed_folder_stops_no_surface() {
    let pair = pair("removed-folder");
    let mut surface = pair.surface();
    let _vehicle = pair.vehicle();
    wait_until("a map", || pair.auv()["map"]["explored_cells"].as_u64() > Some(20));
    let folder = pair.dir.join("asv");
    // The surface writes meanwhile, and makes the folder again.
    wait_until("a file is in the way of the folder", || {
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::write(&folder, "in the way of the folder").is_ok()
    });
    let storage = || pair.state().map_or(Value::Null, |state| state["storage"].clone());
    wait_until("the page reports the disk", || !storage()["failing"].is_null());
    assert!(storage()["write_errors"].as_u64() > Some(0));
    pair.post("vehicles/1/notes", r#"{"text": "written in memory"}"#);
    std::fs::remove_file(folder).unwrap();
    wait_until("the files are written again", || storage()["failing"].is_null());
    surface.kill();
    let _surface = pair.surface();
    wait_until("the note survives", || pair.auv()["notes"][0]["text"] == "written in memory");
}
