//! Both ends as processes under one key: budget and shares change from either end.

use scenecast_tests::{Process, free_port, http, run, scratch, wait_until};
use serde_json::Value;
use std::io::Write;
use std::path::Path;

const ORDER: &str = "Content-Type: application/json\r\nX-Scenecast: 1\r\n";

fn state(port: u16) -> Option<Value> {
    let (status, body) = http(port, "GET", "/api/v2/state", "", "")?;
    (status == 200).then(|| serde_json::from_slice(&body).ok()).flatten()
}

/// Starts both ends; the section `link` of the surface's and of the vehicle's file has these lines.
fn start(dir: &Path, vehicle_key: &str, surface_key: &str, surface_link: &str, link: &str) -> (u16, Process, Process) {
    let (modem, page) = (free_port(), free_port());
    let seal = |key: &str, link: &str| {
        let encrypt = if link.contains("encrypt") { "" } else { "encrypt = true\n" };
        format!("key_file = \"{key}\"\nauthenticate = \"all\"\n{encrypt}")
    };
    let runtime = |who: &str| format!("[runtime]\ntime_scale = 20\nstate_dir = \"{}\"\n", dir.join(who).display());
    let surface = format!(
        "{}[link]\n{}{surface_link}[modem]\nlisten = \"127.0.0.1:{modem}\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n",
        runtime("asv"),
        seal(surface_key, surface_link)
    );
    std::fs::write(dir.join("asv.toml"), surface).unwrap();
    let vehicle = format!(
        "{}[survey]\narea_m = [0, 0, 20, 20]\n[modem]\nconnect = \"127.0.0.1:{modem}\"\n[link]\n{}",
        runtime("auv"),
        seal(vehicle_key, link)
    );
    std::fs::write(dir.join("auv.toml"), format!("{vehicle}{link}")).unwrap();
    let process = |role: &str| {
        let file = |kind| dir.join(role).with_extension(kind);
        Process::start_logged(&[role, "--config", file("toml").to_str().unwrap()], &file("log"))
    };
    (page, process("asv"), process("auv"))
}

fn key(dir: &Path, name: &str) -> String {
    let file = dir.join(name).display().to_string();
    assert!(run(&["key", "new", "--out", &file]).status.success());
    file
}

#[test]
fn budget_and_shares_change_from_either_end_under_a_key() {
    let dir = scratch("either-end");
    let key = key(&dir, "mission.key");
    let own = dir.join("auv-1.key").display().to_string();
    assert!(run(&["key", "derive", &key, "--vehicle", "1", "--out", &own]).status.success());
    let (page, _surface, vehicle) = start(&dir, &own, &key, "", "budget_bps = 4000\n");
    let budget = || state(page)?["vehicles"][0]["status"]["budget_bps"].as_u64();
    wait_until("the vehicle's budget is told", || budget() == Some(4000));
    let order = |map: u32| {
        format!(
            "{{\"budget_bps\": 6000, \"shares\": {{\"directive\": 10, \"status\": 5, \"fix\": 5, \"map\": {map}, \
             \"exemplar\": 30}}}}"
        )
    };
    let (status, said) = http(page, "POST", "/api/v2/budget", ORDER, &order(60)).unwrap();
    assert_eq!((status, String::from_utf8_lossy(&said).contains("110 percent")), (422, true));
    assert_eq!(http(page, "POST", "/api/v2/budget", ORDER, &order(40)).unwrap().0, 202);
    wait_until("the surface's word is in force", || budget() == Some(6000));
    let now = state(page).unwrap();
    assert_eq!((now["link"]["budget_bps"].as_u64(), now["link"]["shares"]["map"].as_u64()), (Some(6000), Some(40)));
    let file = dir.join("auv.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("budget_bps = 4000", "budget_bps = 2000")).unwrap();
    vehicle.hang_up();
    wait_until("the vehicle's own word is in force", || budget() == Some(2000));
    std::fs::write(&file, "[link]\nbudget_bps = 1\n").unwrap();
    vehicle.hang_up();
    let heard = || state(page)?["vehicles"][0]["last_received_s"].as_f64();
    let before = heard().unwrap();
    wait_until("the vehicle goes on with what it had", || heard().is_some_and(|at| at > before + 30.0));
    assert_eq!(budget(), Some(2000));
    let vehicle = &state(page).unwrap()["vehicles"][0];
    assert_eq!(vehicle["status"]["refused_frames"], 0);
    let disk = &vehicle["status"]["disk"];
    assert!(disk["free_bytes"].is_u64() && disk["journal_refused"] == false, "{disk}");
    assert!(vehicle["link"]["round_trip_s"].is_number() && vehicle["link"]["clock_offset_s"].is_number(), "{vehicle}");
}

#[test]
fn another_key_is_named_at_both_ends_and_nothing_is_heard() {
    let dir = scratch("another-key");
    let (page, _surface, _vehicle) = start(&dir, &key(&dir, "one.key"), &key(&dir, "other.key"), "", "");
    wait_until("two minutes of the mission pass", || state(page).is_some_and(|s| s["now_s"].as_f64() > Some(120.0)));
    assert!(state(page).unwrap()["vehicles"][0]["last_received_s"].is_null());
    let same = "set the same link.key_file and mission.id at both ends";
    assert_both_name(
        page,
        &dir,
        &format!("it hears this end, whose hellos fit neither its key nor its mission number: {same}"),
        &format!("its hellos fit neither the key nor the mission number here: {same}"),
    );
}

#[test]
fn another_frame_length_is_named_and_the_link_still_works() {
    let dir = scratch("another-length");
    let key = key(&dir, "mission.key");
    let (page, _surface, _vehicle) = start(&dir, &key, &key, "frame_bytes = 48\n", "frame_bytes = 512\n");
    wait_until("a status", || state(page).is_some_and(|s| s["vehicles"][0]["status"].is_object()));
    let text = |its, own| {
        format!(
            "its frames have up to {its} bytes, those of this end {own}: set the same link.frame_bytes at both ends"
        )
    };
    assert_both_name(page, &dir, &text(512, 48), &text(48, 512));
}

#[test]
fn an_end_that_does_not_encrypt_is_named_at_both_ends() {
    let dir = scratch("another-mode");
    let key = key(&dir, "mission.key");
    let (page, _surface, _vehicle) = start(&dir, &key, &key, "encrypt = false\n", "");
    let [at_surface, at_vehicle] = ["it encrypts and this end does not", "this end encrypts and it does not"]
        .map(|text| format!("{text}: set the same link.encrypt at both ends"));
    assert_both_name(page, &dir, &at_surface, &at_vehicle);
}

/// The page names a mismatch, and so does the log of the vehicle.
fn assert_both_name(page: u16, dir: &Path, at_surface: &str, at_vehicle: &str) {
    let said = || state(page)?["vehicles"][0]["link"]["mismatch"].as_str().map(str::to_owned);
    let mut before = None;
    wait_until(at_surface, || {
        let now = said();
        if now != before {
            eprintln!("the page names {now:?}");
        }
        before.clone_from(&now);
        now.as_deref() == Some(at_surface)
    });
    let log = || std::fs::read_to_string(dir.join("auv.log")).unwrap_or_default();
    wait_until(at_vehicle, || log().contains(at_vehicle));
}

/// A terminal may close while a process still starts: here it waits for its key from a pipe.
#[cfg(unix)]
#[test]
fn a_hang_up_during_the_start_ends_neither_end() {
    let dir = scratch("hang-up-at-start");
    let key = std::fs::read(key(&dir, "mission.key")).unwrap();
    let (modem, page) = (free_port(), free_port());
    let surface = format!("[modem]\nlisten = \"127.0.0.1:{modem}\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n");
    let vehicle = format!("[survey]\narea_m = [0, 0, 20, 20]\n[modem]\nconnect = \"127.0.0.1:{modem}\"\n");
    for (end, text) in [("asv", surface), ("auv", vehicle)] {
        let (pipe, state_dir) = (dir.join(format!("{end}.pipe")), dir.join(end));
        assert!(std::process::Command::new("mkfifo").args(["-m", "600"]).arg(&pipe).status().unwrap().success());
        let file = dir.join(format!("{end}.toml"));
        let runtime = format!("[runtime]\nstate_dir = \"{}\"\n", state_dir.display());
        let link = format!("[link]\nkey_file = \"{}\"\n", pipe.display());
        std::fs::write(&file, text + &runtime + &link).unwrap();
        let mut process = Process::start(&[end, "--config", file.to_str().unwrap()]);
        // This opens only once the process reads.
        let mut writer = std::fs::File::options().write(true).open(&pipe).unwrap();
        process.hang_up();
        writer.write_all(&key).unwrap();
        drop(writer);
        wait_until(&format!("{end} has a record"), || state_dir.join("records").is_dir());
        assert_eq!(process.interrupt(), Some(0), "{end}");
    }
}
