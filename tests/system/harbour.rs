//! Both ends as processes, each at a modem of `scenecast modem-sim` on a device of its own, a kilometre apart in a harbour.

use scenecast_tests::{free_port, http, recorded, scenecast, scratch, wait_until};
use serde_json::Value;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};

/// Seconds of the rehearsal a second.
const TIME_SCALE: &str = "20";

/// A command whose standard error goes to a file.
struct Logged {
    child: Child,
    log: PathBuf,
}

impl Logged {
    fn start(arguments: &[String], log: PathBuf) -> Self {
        let mut command = scenecast();
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(File::create(&log).unwrap());
        Self { child: command.spawn().unwrap(), log }
    }

    /// Interrupts it as a person would; what it had to say.
    fn finish(mut self) -> String {
        let code = scenecast_tests::end(&mut self.child, "INT");
        assert_eq!(code, Some(0), "{}", self.said());
        self.said()
    }

    fn said(&self) -> String {
        std::fs::read_to_string(&self.log).unwrap()
    }
}

impl Drop for Logged {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        if std::thread::panicking() {
            eprintln!("{}:\n{}", self.log.display(), self.said());
        }
    }
}

/// A modem's name, address and place.
const SHIP: (&str, &str, &str) = ("ship", "10", "[0, 0, 2]");
const BOAT: (&str, &str, &str) = ("boat", "11", "[0, 100, 2]");
const AUV: (&str, &str, &str) = ("auv", "1", "[1000, 0, 20]");

/// Modems of a kind; the links to them are in the folder `modems`.
fn moor(dir: &Path, modem: &str, places: &[(&str, &str, &str)]) -> Logged {
    let one = |(name, address, at): &(&str, &str, &str)| {
        let modem = modem.replace("ADDRESS", address);
        format!("[[modem]]\nname = \"{name}\"\n{modem}\nposition_m = {at}\n")
    };
    let modems: String = places.iter().map(one).collect();
    let scenario = format!("[channel]\npreset = \"shallow_harbour\"\n{modems}");
    let file = dir.join("modems.toml");
    std::fs::write(&file, scenario).unwrap();
    let (file, links) = (file.display().to_string(), dir.join("modems").display().to_string());
    let arguments = ["modem-sim", "--scenario", &file, "--link-dir", &links, "--time-scale", TIME_SCALE];
    let sea = Logged::start(&arguments.map(str::to_owned), dir.join("modem-sim.log"));
    wait_until("the modems are there", || places.iter().all(|(name, ..)| dir.join("modems").join(name).exists()));
    sea
}

/// One end at the modem of that name.
fn end(dir: &Path, role: &str, modem: &str, file: &str, sets: &[&str]) -> Logged {
    let path = dir.join(format!("{modem}.toml"));
    let state = dir.join(modem);
    let runtime = format!("[runtime]\nstate_dir = \"{}\"\ntime_scale = {TIME_SCALE}\n", state.display());
    std::fs::write(&path, format!("{runtime}{file}")).unwrap();
    let device = format!("modem.device={}", dir.join("modems").join(modem).display());
    let sets = sets.iter().copied().chain([device.as_str()]).flat_map(|set| ["--set".to_owned(), set.to_owned()]);
    let arguments: Vec<String> =
        [role.to_owned(), "--config".to_owned(), path.display().to_string()].into_iter().chain(sets).collect();
    Logged::start(&arguments, dir.join(format!("{modem}.log")))
}

/// The state of the vehicle as the page has it.
fn vehicle_of(port: u16) -> Option<Value> {
    let (_, body) = http(port, "GET", "/api/v2/state", "", "")?;
    let state: Value = serde_json::from_slice(&body).ok()?;
    state["vehicles"].get(0).cloned()
}

/// The status of the response to an order.
fn order(port: u16, what: &str, body: &str) -> u16 {
    let path = format!("/api/v2/vehicles/1/{what}");
    http(port, "POST", &path, "X-Scenecast: 1\r\nContent-Type: application/json\r\n", body).unwrap().0
}

fn is_applied(port: u16, slot: &str) -> bool {
    let Some(vehicle) = vehicle_of(port) else { return false };
    let slots = vehicle["directive"]["slots"].as_array().cloned().unwrap_or_default();
    slots.iter().any(|s| s["slot"] == slot && s["state"] == "applied")
}

/// What an end put on air kept to its budget, by its own account.
fn assert_budget_held(log: &str) {
    assert!(!log.contains("budget was exceeded"), "{log}");
    let account = log.lines().rev().find(|line| line.contains("bits on air")).unwrap_or_else(|| panic!("{log}"));
    assert!(!account.contains(" 0 transmissions"), "{account}");
}

/// The survey reaches the operator and his order the vehicle; `modem` is its part of the scenario, `sets` that of the ends.
fn assert_survey_arrives(name: &str, modem: &str, sets: &[&str]) {
    let (recording, expected) = recorded();
    let dir = scratch(name);
    let _sea = moor(&dir, modem, &[SHIP, AUV]);
    let port = free_port();
    let page = format!("[console]\nlisten = \"127.0.0.1:{port}\"\n");
    let camera = format!("[camera]\nsource = \"frames:{}\"\n", recording.display());
    let surface = end(&dir, "asv", "ship", &page, sets);
    let vehicle = end(&dir, "auv", "auv", &camera, sets);
    wait_until("the vehicle is heard", || vehicle_of(port).is_some_and(|v| v["last_received_s"].is_number()));
    assert_eq!(order(port, "utility", r#"{"weights": {}, "exploration": 0.5, "curiosity": 0.1}"#), 202);
    wait_until("the order is known to be applied", || is_applied(port, "utility"));
    let map = dir.join("ship/operator-map-1.png");
    wait_until("the operator's map equals the one of the rehearsal", || {
        std::fs::read(&map).is_ok_and(|png| png == *expected)
    });
    let said = vehicle.finish();
    assert_eq!(said.matches("utility 1: Applied").count(), 1, "{said}");
    assert_budget_held(&said);
    assert_budget_held(&surface.finish());
}

#[test]
fn a_survey_arrives_through_bursts() {
    assert_survey_arrives("harbour-burst", "kind = \"s2c\"\naddress = ADDRESS", &["modem.kind=s2c"]);
}

#[test]
fn a_survey_arrives_through_instant_messages() {
    let sets = ["modem.kind=s2c", "modem.s2c_mode=im"];
    assert_survey_arrives("harbour-instant", "kind = \"s2c\"\naddress = ADDRESS", &sets);
}

#[test]
fn a_survey_arrives_through_micromodems_at_rate_5() {
    let modem = "kind = \"micromodem\"\naddress = ADDRESS\nbaud = 115200";
    assert_survey_arrives("harbour-rate-5", modem, &["modem.kind=micromodem", "modem.rate=5", "modem.baud=115200"]);
}

#[test]
fn a_survey_arrives_through_micromodems_at_rate_1() {
    let modem = "kind = \"micromodem\"\naddress = ADDRESS";
    assert_survey_arrives("harbour-rate-1", modem, &["modem.kind=micromodem", "modem.rate=1"]);
}

#[test]
fn a_survey_arrives_through_pipes_of_9600_baud() {
    let sets = ["modem.kind=transparent", "modem.baud=9600", "modem.bit_rate=9600"];
    assert_survey_arrives("harbour-pipe", "kind = \"transparent\"\nbaud = 9600", &sets);
}

/// The other surface that a page names, and whether the vehicle obeys that one.
fn other_surface(port: u16) -> Option<(String, bool)> {
    let other = vehicle_of(port)?["other_surface"].clone();
    Some((other["name"].as_str()?.to_owned(), other["holds"].as_bool()?))
}

#[test]
fn a_second_surface_stops_the_vehicle_and_both_name_each_other() {
    let dir = scratch("harbour-two-surfaces");
    let key = dir.join("mission.key").display().to_string();
    assert!(scenecast_tests::run(&["key", "new", "--out", &key]).status.success());
    let key = format!("link.key_file={key}");
    let sets = ["modem.kind=transparent", "modem.baud=9600", "modem.bit_rate=9600", &key, "link.authenticate=all"];
    let _sea = moor(&dir, "kind = \"transparent\"\nbaud = 9600", &[SHIP, BOAT, AUV]);
    let (ship, boat) = (free_port(), free_port());
    let page =
        |port: u16, name: &str| format!("[console]\nlisten = \"127.0.0.1:{port}\"\n[surface]\nname = \"{name}\"\n");
    let _ship = end(&dir, "asv", "ship", &page(ship, "Meteor"), &sets);
    let _vehicle = end(&dir, "auv", "auv", "[survey]\narea_m = [0, 0, 20, 20]\n", &sets);
    wait_until("the ship hears the vehicle", || vehicle_of(ship).is_some_and(|v| v["last_received_s"].is_number()));
    assert_eq!(order(ship, "limits", &limits(900)), 202);
    wait_until("the limits are applied", || is_applied(ship, "limits"));
    let _boat = end(&dir, "asv", "boat", &page(boat, "Zodiac"), &sets);
    wait_until("the boat names the ship", || other_surface(boat) == Some(("Meteor".into(), true)));
    wait_until("the ship names the boat", || other_surface(ship) == Some(("Zodiac".into(), false)));
    assert_eq!(order(boat, "constraints", r#"{"action": "hold"}"#), 202);
    wait_until("the hold of the boat is applied", || is_applied(boat, "constraints"));
    wait_until("the vehicle follows the boat", || other_surface(ship) == Some(("Zodiac".into(), true)));
    assert_eq!(order(boat, "limits", &limits(600)), 202);
    wait_until("the limits of the boat are applied", || is_applied(boat, "limits"));
    assert_eq!(order(ship, "take-over", "{}"), 204);
    wait_until("the vehicle follows the ship again", || other_surface(boat) == Some(("Meteor".into(), true)));
    wait_until("the ship shows that its limits are no longer in force", || !is_applied(ship, "limits"));
}

/// Limits of which only the time is set.
fn limits(time_s: u32) -> String {
    format!(
        "{{\"time_s\": {time_s}, \"depth_m\": null, \"altitude_m\": null, \"distance_m\": null, \"silence_s\": null, \
         \"on_silence\": null, \"on_breach\": null, \"on_abort\": null}}"
    )
}
