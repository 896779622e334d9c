//! The API as used by programs: its document, its files, `scenecast ctl`.

use scenecast_tests::{
    LIGHT, Process, assert_refused, free_port, http, python, run, run_script, scratch, state, wait_until,
};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Output;
use std::time::Duration;

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// A mission whose map has labels.
fn demo(port: u16, more: &[&str]) -> Process {
    let demo = scenecast_tests::demo(port, 20, more);
    wait_until("labels on the map", || labels(port).len() > 1);
    demo
}

fn labels(port: u16) -> Vec<u64> {
    let state = state(port).unwrap_or_default();
    let labels = state["vehicles"][0]["labels"].as_array().cloned().unwrap_or_default();
    labels.iter().filter_map(|l| l["id"].as_u64()).collect()
}

/// The label with the largest area. Of a rare one the vehicle may have no image yet.
fn largest_label(port: u16) -> u64 {
    let state = state(port).unwrap_or_default();
    let labels = state["vehicles"][0]["labels"].as_array().cloned().unwrap_or_default();
    let largest = labels.iter().max_by_key(|l| l["cells"].as_u64());
    largest.and_then(|l| l["id"].as_u64()).expect("a label is on the map")
}

/// `scenecast ctl` to the surface on a port.
fn ctl(port: u16, arguments: &[&str]) -> Output {
    let url = format!("http://127.0.0.1:{port}");
    run(&[&["ctl", "--url", &url], arguments].concat())
}

#[test]
fn settings_are_fitted_to_a_budget_and_sent() {
    let port = free_port();
    let _demo = demo(port, &["--duration", "3000"]);
    let refused = ctl(port, &["settings", "--alpha", "5000"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused).contains("alpha 5000: it takes 0.000000001 to 1000"), "{}", text(&refused));
    let sent = ctl(port, &["settings", "--gamma", "1e-5", "--layers", "none", "--wait", "80"]);
    assert_eq!(sent.status.code(), Some(0), "{}", text(&sent));
    let shown = ctl(port, &["settings", "--json"]);
    let shown: Value = serde_json::from_slice(&shown.stdout).unwrap();
    assert_eq!((&shown["in_force"]["gamma"], &shown["in_force"]["layers"]), (&1e-5.into(), &"none".into()));
    assert_eq!((&shown["requested"]["gamma"], &shown["requested"]["alpha"]), (&1e-5.into(), &Value::Null));

    let nothing = ctl(port, &["settings", "--fit", "1"]);
    assert_eq!(nothing.status.code(), Some(1));
    assert!(text(&nothing).contains("no setting fits 1 bit/s: the lowest rate is"), "{}", text(&nothing));
    let fit = |more: &[&str]| {
        let output = ctl(port, &[&["settings", "--fit"], more, &["--dry-run", "--json"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        let order: Value = serde_json::from_slice(&output.stdout).unwrap();
        (order, String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (whole, words) = fit(&["100000"]);
    assert!(words.contains("no trade-off") && whole["cells"].is_string(), "{words}: {whole}");
    let (named, _) = fit(&["--alpha", "0.3"]);
    assert_eq!(named["alpha"], 0.3, "a given setting precedes a fitted one");
    let bad = http(port, "GET", "/api/v2/vehicles/1/fit?bits_per_s=x", "", "").unwrap();
    assert_eq!(bad.0, 422);
}

#[test]
fn labels_are_named_and_merged_and_places_marked_by_ctl() {
    let port = free_port();
    let _demo = demo(port, &["--duration", "3000"]);
    wait_until("two labels", || labels(port).len() > 1);
    let [coral, other] = [labels(port)[0], labels(port)[1]].map(|label| label.to_string());
    let done = |arguments: &[&str]| {
        let output = ctl(port, arguments);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output));
        text(&output)
    };
    done(&["label", &coral, "--name", "Soft coral", "--colour", "#a0b1c2"]);
    done(&["label", &other, "--merge-into", "soft CORAL"]);
    done(&["label", "soft coral", "--colour", ""]);
    let book = || state(port).unwrap()["vehicles"][0]["label_book"].clone();
    wait_until("the names are shown", || book()[&coral]["colour"].is_null());
    assert_eq!(book()[&coral]["name"], "Soft coral");
    assert_eq!(book()[&other]["merged_into"].to_string(), coral);
    done(&["note", "turbid since noon"]);
    done(&["mark", "set", "2.5", "-4", "lost anchor"]);
    let marks = || text(&ctl(port, &["mark"]));
    wait_until("the marker is shown", || marks().contains("1: 2.5 m east, -4.0 m north: lost anchor"));
    let unknown = ctl(port, &["mark", "remove", "7"]);
    assert!(unknown.status.code() == Some(2) && text(&unknown).contains("known: 1"), "{}", text(&unknown));
    done(&["mark", "remove", "1"]);
    wait_until("the marker is gone", || marks() == "no marker\n");
    assert!(done(&["log"]).contains("turbid since noon"));
}

#[test]
fn orders_are_followed_until_applied_or_refused() {
    let port = free_port();
    let _demo = demo(port, &["--duration", "3000", "--set", "mission.origin_deg=[60.17, -10.25]"]);
    let label = labels(port)[0];
    let weight = format!("{label}=-0.75");
    let sent = ctl(port, &["utility", "set", &weight, "--exploration", "0.25", "--wait", "60", "--json"]);
    assert_eq!(sent.status.code(), Some(0), "{}", text(&sent));
    let outcome: Value = serde_json::from_slice(&sent.stdout).unwrap();
    assert_eq!((&outcome[0]["state"], &outcome[0]["slot"]), (&"applied".into(), &"utility".into()));
    let kept = ctl(port, &["utility", "--json"]);
    let kept: Value = serde_json::from_slice(&kept.stdout).unwrap();
    assert_eq!((&kept["weights"][label.to_string()], &kept["exploration"]), (&(-0.75).into(), &0.25.into()));

    let budget = ctl(port, &["budget", "set", "8000", "--shares", "map=40,exemplar=30", "--wait", "60"]);
    assert_eq!(budget.status.code(), Some(0), "{}", text(&budget));
    let link = &state(port).unwrap()["link"];
    assert_eq!(
        (&link["budget_bps"], &link["shares"]["map"], &link["shares"]["status"]),
        (&8000.into(), &40.into(), &5.into())
    );

    let image = scratch("ctl-image").join("label.webp");
    let pictured = largest_label(port).to_string();
    let saved = ctl(port, &["exemplar", &pictured, "--out", image.to_str().unwrap(), "--wait", "80"]);
    assert_eq!(saved.status.code(), Some(0), "{}", text(&saved));
    assert!(std::fs::read(&image).unwrap().starts_with(b"RIFF"));

    let refused = ctl(port, &["utility", "set", "250=1"]);
    assert_eq!(refused.status.code(), Some(1), "{}", text(&refused));
    assert!(text(&refused).contains("label 250 is not on the map"), "{}", text(&refused));
    let shares = ctl(port, &["budget", "set", "8000", "--shares", "map=90"]);
    assert!(shares.status.code() == Some(1) && text(&shares).contains("100 or less"), "{}", text(&shares));

    let status = text(&ctl(port, &["status"]));
    for word in ["mission rehearsal", "vehicle 1 auv-1", "utility", "version 1 applied", "ago", "8000 bit/s"] {
        assert!(status.contains(word), "{word} is missing in {status}");
    }
    assert!(text(&ctl(port, &["labels"])).contains("-0.75"));
    let floor = || state(port).is_some_and(|state| state["vehicles"][0]["floor"]["images"].as_u64() > Some(0));
    wait_until("an image of the sea floor", floor);
    if let Some(python) = python("jsonschema, openapi_spec_validator, prometheus_client") {
        run_script(&python, "tests/api/check.py", &[&format!("http://127.0.0.1:{port}")]);
    }
}

#[test]
fn wrong_usage_differs_from_a_surface_without_an_answer() {
    let url = format!("http://127.0.0.1:{}", free_port());
    let absent = run(&["ctl", "status", "--url", &url]);
    assert_eq!(absent.status.code(), Some(1), "{}", text(&absent));
    assert!(text(&absent).contains(&url) && text(&absent).contains("scenecast asv or demo"), "{}", text(&absent));
    assert_eq!(text(&absent).trim().lines().count(), 1);
    assert_refused(&["ctl", "status", "--url", "ftp://nowhere"], &["--url ftp://nowhere", "http://HOST:PORT"]);
    assert_refused(&["ctl", "utility", "set", "3=2"], &["3=2", "-1 to 1"]);
    assert_refused(&["ctl", "utility", "set", "0=1"], &["0=1", "1 to 254"]);
    assert_refused(&["ctl", "budget", "set", "5"], &["5", "10..=10000000"]);
    assert_refused(&["ctl", "abort"], &["--yes"]);
    assert_refused(&["ctl", "limits", "set", "--depth", "30-5"], &["30-5", "LOW..HIGH"]);
    assert_refused(&["ctl", "map", "--out", "reef.tiff"], &["reef.tiff", ".geojson"]);
    assert_refused(&["ctl", "status", "--wait", "-1"], &["--wait"]);
    assert_refused(&["ctl", "status", "--token-file", "nowhere.token"], &["nowhere.token", "key token"]);
}

#[test]
fn a_shell_sets_fence_and_limits_and_holds_and_resumes() {
    let (port, dir) = (free_port(), scratch("ctl-constraints"));
    let _demo = scenecast_tests::demo(port, 8, &["--duration", "3000"]);
    wait_until("the first status", || state(port).is_some_and(|s| !s["vehicles"][0]["status"].is_null()));
    let file = |name: &str, text: &str| {
        std::fs::write(dir.join(name), text).unwrap();
        dir.join(name).display().to_string()
    };
    let applied = |arguments: &[&str]| {
        let sent = ctl(port, &[arguments, &["--wait", "80"]].concat());
        assert_eq!(sent.status.code(), Some(0), "{arguments:?}: {}", text(&sent));
    };
    let keep_out = r#"{"type": "Feature", "properties": {"role": "keep_out"},
        "geometry": {"type": "Polygon", "coordinates": [[[70, 70], [75, 70], [75, 75], [70, 70]]]}}"#;
    let fence = r#"{"type": "Feature", "properties": {},
        "geometry": {"type": "Polygon", "coordinates": [[[-80, -80], [80, -80], [80, 80], [-80, 80], [-80, -80]]]}}"#;
    let plan = format!(r#"{{"type": "FeatureCollection", "features": [{fence}, {keep_out}]}}"#);
    applied(&["fence", "set", "--metres", &file("fence.geojson", &plan)]);
    applied(&["return-point", "set", "-5", "2.5"]);
    let vehicle = || state(port).unwrap()["vehicles"][0].clone();
    let order = &vehicle()["fence_in_force"]["order"];
    assert_eq!((&order["return_point"][0], &order["keep_outs"][0][2][1]), (&(-5.0).into(), &75.0.into()));
    assert!(text(&ctl(port, &["fence"])).contains("return point E -5.0 N 2.5"));

    applied(&["limits", "set", "--depth", "0..60", "--on-silence", "hold"]);
    applied(&["limits", "set", "--silence", "900"]);
    let limits = text(&ctl(port, &["limits"]));
    assert!(limits.contains("0.0 to 60.0 m") && limits.contains("15 min"), "{limits}");
    applied(&["limits", "clear", "depth"]);
    let limits = text(&ctl(port, &["limits"]));
    assert!(!limits.contains("60.0 m") && limits.contains("15 min"), "the others stay: {limits}");

    applied(&["hold"]);
    wait_until("it holds", || vehicle()["status"]["mode"] == "hold");
    applied(&["resume"]);
    wait_until("it surveys", || vehicle()["status"]["mode"] == "survey");

    // A fence that the vehicle refuses, fences that the surface refuses, and files that are not a fence.
    let back = r#"{"type": "Feature", "properties": {"role": "return_point"}, "geometry": {"type": "Point", "coordinates": [350, 350]}}"#;
    let moved = fence.replace("-80", "300").replace("80", "400");
    let elsewhere = format!(r#"{{"type": "FeatureCollection", "features": [{moved}, {back}]}}"#);
    let refused = ctl(port, &["fence", "set", "--metres", &file("elsewhere.geojson", &elsewhere), "--wait", "80"]);
    assert!(refused.status.code() == Some(1) && text(&refused).contains("refused"), "{}", text(&refused));
    let alone = ctl(port, &["fence", "set", "--metres", &file("moved.geojson", &moved), "--wait", "80"]);
    assert!(text(&alone).contains("return_point lies outside"), "the return point stays: {}", text(&alone));
    assert!(text(&ctl(port, &["fence"])).contains("in force: version 2"));
    let url = format!("http://127.0.0.1:{port}");
    let crossed = fence.replace("[80, 80], [-80, 80]", "[-80, 80], [80, 80]");
    let crossed = file("crossed.geojson", &crossed);
    let set = ["ctl", "--url", &url, "fence", "set"];
    assert_refused(&[&set[..], &["--metres", &crossed]].concat(), &["crossed.geojson", "edge"]);
    let line = file("line.geojson", &fence.replace("Polygon", "LineString"));
    assert_refused(&[&set[..], &["--metres", &line]].concat(), &["line.geojson", "Polygon"]);
    assert_refused(&[&set[..], &[&crossed]].concat(), &["mission.origin_deg", "--metres"]);
    let alone = file("keep-out.geojson", keep_out);
    assert_refused(&[&set[..], &["--metres", &alone]].concat(), &["keep-out.geojson", "no fence", "--without-fence"]);
    assert_refused(&["ctl", "--url", &url, "limits", "set", "--depth", "30..5"], &["depth_m", "below"]);
    assert_refused(&["ctl", "--url", &url, "limits", "set", "--on-abort", "dive"], &["on_abort", "hold, return"]);
    // The surface alone knows the fence in force.
    let outside = ctl(port, &["return-point", "set", "500", "0"]);
    assert!(
        outside.status.code() == Some(1) && text(&outside).contains("return_point lies outside"),
        "{}",
        text(&outside)
    );
    applied(&["abort", "--yes"]);
    wait_until("it has aborted", || vehicle()["status"]["mode"] != "survey");
    let orders = ctl(port, &["log", "--kind", "order"]);
    assert!(
        text(&orders).contains("hold (by") && text(&orders).trim().ends_with("abort (by local)"),
        "{}",
        text(&orders)
    );
    let table = dir.join("log.csv");
    assert!(ctl(port, &["log", "--out", table.to_str().unwrap()]).status.success());
    assert!(std::fs::read_to_string(&table).unwrap().starts_with("number,utc,mission_s,"));
    assert_refused(&["ctl", "log", "--kind", "orders"], &["orders", "order, answer"]);
}

#[test]
fn other_machines_need_a_token() {
    let dir = scratch("token");
    let file = dir.join("console.token");
    let file = file.to_str().unwrap();
    assert!(run(&["key", "token", "--out", file]).status.success());
    let token = std::fs::read_to_string(file).unwrap().trim().to_owned();
    let config = scenecast_tests::workspace().join("config/asv.toml");
    let (port, modem) = (free_port(), free_port());
    let sets = [
        format!("console.listen=0.0.0.0:{port}"),
        format!("modem.listen=127.0.0.1:{modem}"),
        format!("runtime.state_dir=\"{}\"", dir.join("asv").display()),
    ];
    let mut arguments = vec!["asv", "--config", config.to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|s| ["--set", s]));
    assert_refused(&arguments, &["console.listen", "console.token_file", "key token"]);
    let with = format!("console.token_file={file}");
    arguments.extend(["--set", &with]);
    let _surface = Process::start(&arguments);
    wait_until("the form is served", || http(port, "GET", "/login", "", "").is_some_and(|(s, _)| s == 200));
    let status = |path: &str, headers: &str| http(port, "GET", path, headers, "").unwrap().0;
    for path in ["/api/v2/state", "/api/v2/events", "/metrics", "/api/openapi.json", "/js/main.js", "/index.html"] {
        assert_eq!(status(path, ""), 401, "{path}");
    }
    assert_eq!(status("/", ""), 303);
    assert_eq!(status("/api/v2/state", &format!("Authorization: Bearer {token}\r\n")), 200);
    assert_eq!(status("/api/v2/state", &format!("Authorization: Bearer {token}0\r\n")), 401);
    let form = |token: &str, more: &str| {
        let headers = format!("Content-Type: application/x-www-form-urlencoded\r\n{more}");
        scenecast_tests::http_whole(port, "POST", "/login", &headers, &format!("token={token}")).unwrap()
    };
    assert!(form("wrong", "").starts_with("HTTP/1.1 401"));
    assert!(form(&token, "Origin: http://elsewhere.example\r\n").starts_with("HTTP/1.1 403"));
    let answer = form(&token, "");
    let cookie = answer.lines().find_map(|l| l.strip_prefix("set-cookie: ")).expect("a cookie");
    assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
    assert!(!cookie.contains(&token), "the cookie is not the token");
    let session = cookie.split(';').next().unwrap();
    let cookie = format!("Cookie: {session}\r\n");
    assert_eq!(status("/", &cookie), 200);
    let logout = http(port, "POST", "/logout", &format!("{cookie}X-Scenecast: 1\r\n"), "").unwrap();
    assert_eq!((logout.0, status("/", &cookie)), (303, 303), "the session has ended");
    let url = format!("http://127.0.0.1:{port}");
    assert_eq!(run(&["ctl", "status", "--url", &url, "--token-file", file]).status.code(), Some(0));
    let without = run(&["ctl", "status", "--url", &url]);
    assert!(without.status.code() == Some(1) && text(&without).contains("--token-file"), "{}", text(&without));
}

/// A surface whose tokens are `ROLE NAME` each, with the headers of each principal in the same order.
pub(super) fn surface_with_tokens(dir: &Path, principals: &[&str]) -> (Process, u16, Vec<String>) {
    surface_at(dir, principals, free_port())
}

/// As [`surface_with_tokens`], with a modem at this port.
pub(super) fn surface_at(dir: &Path, principals: &[&str], modem: u16) -> (Process, u16, Vec<String>) {
    let tokens: Vec<String> = (0..principals.len()).map(|i| format!("{i:032}")).collect();
    let lines: String = principals.iter().zip(&tokens).map(|(p, token)| format!("{p} {token}\n")).collect();
    std::fs::write(dir.join("console.tokens"), lines).unwrap();
    for (principal, token) in principals.iter().zip(&tokens) {
        let name = principal.rsplit(' ').next().unwrap();
        std::fs::write(dir.join(format!("{name}.token")), format!("{principal} {token}\n")).unwrap();
    }
    let config = scenecast_tests::workspace().join("config/asv.toml");
    let port = free_port();
    let sets = [
        format!("console.listen=127.0.0.1:{port}"),
        format!("console.token_file={}", dir.join("console.tokens").display()),
        format!("modem.listen=127.0.0.1:{modem}"),
        format!("runtime.state_dir=\"{}\"", dir.join("asv").display()),
    ];
    let mut arguments = vec!["asv", "--config", config.to_str().unwrap()];
    arguments.extend(sets.iter().flat_map(|s| ["--set", s]));
    let surface = Process::start(&arguments);
    wait_until("the form is served", || http(port, "GET", "/login", "", "").is_some_and(|(s, _)| s == 200));
    let headers = tokens
        .iter()
        .map(|t| format!("Authorization: Bearer {t}\r\nX-Scenecast: 1\r\nContent-Type: application/json\r\n"));
    (surface, port, headers.collect())
}

#[test]
fn a_viewer_changes_nothing_by_any_documented_method() {
    let dir = scratch("roles");
    let principals = ["viewer victor", "operator anna", "administrator carla"];
    let (_surface, port, headers) = surface_with_tokens(&dir, &principals);
    let ask = |who: usize, method: &str, path: &str, body: &str| http(port, method, path, &headers[who], body).unwrap();
    let document: Value = serde_json::from_slice(&ask(0, "GET", "/api/openapi.json", "").1).unwrap();
    let mut refused = Vec::new();
    for (path, methods) in document["paths"].as_object().unwrap() {
        let path = path.replace("{id}", "1").replace("{file}", "1.webp");
        for (method, operation) in methods.as_object().unwrap().iter().filter(|(method, _)| *method != "get") {
            if ["/login", "/logout"].contains(&&*path) {
                assert!(operation["x-role"].is_null());
                continue;
            }
            if path == "/api/v2/replay" {
                // It moves the play head of a record; a live surface has none.
                assert_eq!(ask(0, "POST", &path, "{}").0, 404);
                continue;
            }
            if path.ends_with("/dry-run") {
                // It plans and sends nothing.
                let (status, line) = ask(0, "POST", &path, "{\"weights\": {}, \"exploration\": 0.2}");
                assert_eq!(status, 422, "{}", String::from_utf8_lossy(&line));
                let state: Value = serde_json::from_slice(&ask(0, "GET", "/api/v2/state", "").1).unwrap();
                assert_eq!(state["vehicles"][0]["directive"]["slots"], serde_json::json!([]), "{state}");
                continue;
            }
            for body in ["", "{}", "{\"action\": \"hold\"}", "{\"action\": \"take\"}"] {
                let (status, line) = ask(0, &method.to_uppercase(), &path, body);
                let line = String::from_utf8_lossy(&line).into_owned();
                assert!(status == 403 && line.contains("the role of victor is viewer"), "{path}: {status} {line}");
            }
            let role = operation["x-role"].as_str().unwrap();
            assert_eq!(role == "administrator", ask(1, &method.to_uppercase(), &path, "[]").0 == 403, "{path}");
            refused.push(path.clone());
        }
    }
    assert!(refused.len() >= 8, "{refused:?}");
    let holder = |who| {
        let (status, state) = ask(who, "GET", "/api/v2/state", "");
        assert_eq!(status, 200);
        serde_json::from_slice::<Value>(&state).unwrap()["command"]["holder"].clone()
    };
    assert_eq!(holder(0), Value::Null);
    let me: Value = serde_json::from_slice(&ask(0, "GET", "/api/v2/principal", "").1).unwrap();
    assert_eq!((&me["name"], &me["role"]), (&"victor".into(), &"viewer".into()));
}

#[test]
fn command_passes_from_one_operator_to_another_in_a_shell() {
    let dir = scratch("command");
    let (_surface, port, headers) = surface_with_tokens(&dir, &["operator anna", "operator bob", "viewer victor"]);
    let url = format!("http://127.0.0.1:{port}");
    let as_one = |name: &str, arguments: &[&str]| {
        let file = dir.join(format!("{name}.token")).display().to_string();
        run(&[&["ctl", "--url", &url, "--token-file", &file], arguments].concat())
    };
    let ok = |name: &str, arguments: &[&str]| {
        let output = as_one(name, arguments);
        assert_eq!(output.status.code(), Some(0), "{name} {arguments:?}: {}", text(&output));
        text(&output)
    };
    let refused = |name: &str, arguments: &[&str], words: &[&str]| {
        let output = as_one(name, arguments);
        let line = text(&output);
        assert!(output.status.code() == Some(1) && words.iter().all(|w| line.contains(w)), "{name}: {line}");
    };
    wait_until("the first state", || as_one("anna", &["status"]).status.success());
    assert!(ok("bob", &["command"]).contains("nobody has it"));
    ok("anna", &["budget", "set", "900"]);
    assert!(ok("bob", &["command"]).contains("anna (ctl-"), "the first order took command");
    refused("bob", &["budget", "set", "800"], &["anna has had command for", "request it", "take it after"]);
    refused("bob", &["command", "take"], &["anna has had command for"]);
    refused("victor", &["command", "request"], &["needs the role operator", "the role of victor is viewer"]);
    refused("victor", &["hold"], &["needs the role operator"]);
    refused("victor", &["note", "hello"], &["needs the role operator"]);
    let log = ok("anna", &["log", "--kind", "refused"]);
    assert!(log.contains("budget: 800 bit/s: not sent: anna has had command"), "{log}");
    assert!(log.contains("orders the vehicle to hold, to abort, or to resume its survey {\"action\""), "{log}");
    assert!(
        log.contains("adds a note about the vehicle {\"text\":\"hello\"}: not sent: this needs the role operator"),
        "{log}"
    );
    ok("bob", &["hold"]);
    let abort = r#"{"action": "abort"}"#;
    assert_eq!(http(port, "POST", "/api/v2/vehicles/1/constraints", &headers[1], abort).unwrap().0, 202);
    let resume = http(port, "POST", "/api/v2/vehicles/1/constraints", &headers[1], r#"{"action": "resume"}"#).unwrap();
    assert_eq!(resume.0, 409, "a resume needs command");
    ok("bob", &["command", "request"]);
    refused("anna", &["command", "hand-over", "victor"], &["the role of victor is viewer"]);
    refused("anna", &["command", "hand-over", "dora"], &["dora is not a principal"]);
    assert!(ok("anna", &["command", "hand-over"]).contains("bob has command"));
    ok("bob", &["budget", "set", "800"]);
    let history = ok("anna", &["command"]);
    assert!(history.contains("anna handed command over to bob"), "{history}");
    ok("bob", &["command", "release"]);
    ok("anna", &["budget", "set", "700"]);
}

#[test]
fn last_seen_reaches_the_surface_and_its_exports_if_requested() {
    let out = scratch("last-seen");
    let report = |sets: &[&str]| -> Value {
        let sim = [&["sim", "--duration", "120", "--seed", "3", "--force", "--out", out.to_str().unwrap()], &LIGHT[..]]
            .concat();
        let ran = run(&[&sim[..], sets].concat());
        assert_eq!(ran.status.code(), Some(0), "{}", text(&ran));
        serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap()
    };
    let without = report(&[]);
    let bytes = &without["link"]["bytes_by_class"]["last_seen"];
    assert_eq!((&without["map"]["layers"]["last_seen"], bytes), (&Value::Null, &0.into()));
    for sets in [r#"link.background=["last_seen"]"#, "map.layer_shares.last_seen=10"] {
        let with = report(&["--set", sets]);
        let layer = &with["map"]["layers"]["last_seen"];
        assert_eq!((&layer["agreement_final"], &layer["cells"]), (&1.0.into(), &with["survey"]["explored_cells"]));
        assert!(layer["agreement_mean"].as_f64() > Some(0.8), "{layer}");
    }

    let port = free_port();
    let _demo = demo(port, &["--duration", "3000"]);
    let minutes = || {
        let (_, file) = http(port, "GET", "/api/v2/vehicles/1/map.csv", "", "").unwrap();
        let file = String::from_utf8(file).unwrap();
        let at = file.lines().next()?.split(',').position(|name| name == "last_seen")?;
        let values = file.lines().skip(1).filter_map(|line| line.split(',').nth(at)?.parse().ok());
        Some(values.collect::<Vec<f64>>())
    };
    assert_eq!(minutes(), None);
    let order = ctl(port, &["budget", "set", "--background", "last_seen", "--wait", "80"]);
    assert_eq!(order.status.code(), Some(0), "{}", text(&order));
    wait_until("cells that were seen within 2, and within 4 minutes", || {
        minutes().is_some_and(|minutes| minutes.contains(&1.0) && minutes.contains(&3.0))
    });
    let (_, map) = http(port, "GET", "/api/v2/vehicles/1/map", "", "").unwrap();
    let map: Value = serde_json::from_slice(&map).unwrap();
    let layer = map["layers"].as_array().unwrap().iter().find(|layer| layer["name"] == "last_seen").unwrap();
    assert_eq!((&layer["unit"], &layer["edges"][0], &layer["edges"][1]), (&"min".into(), &0.0.into(), &2.0.into()));
}

/// Names the largest label, whose class has a colour and two others that are merged into it, one by way of the other.
fn name_labels(port: u16) {
    let mut labels = state(port).unwrap()["vehicles"][0]["labels"].as_array().unwrap().clone();
    labels.sort_by_key(|label| std::cmp::Reverse(label["cells"].as_u64()));
    let [a, b, c] = [0, 1, 2].map(|i| labels[i]["id"].clone());
    let entries = [
        json!({ "label": a, "name": "sand, \"fine\" & <wet>", "colour": "#12ab34" }),
        json!({ "label": b, "name": "=rubble", "merged_into": a }),
        json!({ "label": c, "merged_into": b }),
    ];
    let post = |entry: &Value| {
        let headers = "Content-Type: application/json\r\nX-Scenecast: 1\r\n";
        http(port, "POST", "/api/v2/vehicles/1/labels", headers, &entry.to_string()).map(|(status, _)| status)
    };
    entries.iter().for_each(|entry| assert_eq!(post(entry), Some(204), "{entry}"));
    assert_eq!(post(&json!({ "label": a, "merged_into": c })), Some(422), "a circle");
    wait_until("the labels are named", || {
        state(port).unwrap()["vehicles"][0]["label_book"][c.to_string()]["merged_into"] == b
    });
    let sent = ctl(port, &["utility", "set", "SAND, \"fine\" & <wet>=0.5", "--wait", "0"]);
    assert_eq!(sent.status.code(), Some(0), "{}", text(&sent));
    wait_until("the class has the weight, and those that are merged into it", || {
        let labels = state(port).unwrap()["vehicles"][0]["labels"].clone();
        let weight = |id: &Value| labels.as_array()?.iter().find(|label| label["id"] == *id)?["weight"].as_f64();
        [&a, &b, &c].iter().all(|id| weight(id) == Some(0.5))
    });
    let wrong = ctl(port, &["utility", "set", "kelp=0.5"]);
    assert!(wrong.status.code() == Some(2) && text(&wrong).contains("=rubble"), "{}", text(&wrong));
}

/// Exports the map of an ended mission in all formats, and opens the files with other programs.
fn assert_exports_open(name: &str, origin: &[&str]) {
    let Some(python) = python("plyfile, rasterio, shapely") else { return };
    let (dir, port) = (scratch(name), free_port());
    let _demo = demo(port, &[&["--duration", "90"], origin].concat());
    let mut last = Value::Null;
    wait_until("the last map", || {
        let state = state(port).unwrap_or_default();
        let version = state["vehicles"][0]["map"]["version"].clone();
        std::thread::sleep(Duration::from_secs(1));
        state["mission"]["ended"] == true && std::mem::replace(&mut last, version.clone()) == version
    });
    name_labels(port);
    let path = |file: &str| dir.join(file).display().to_string();
    let placement = || state(port).unwrap()["vehicles"][0]["map"]["placement"].clone();
    // A late fix may move the map between two files.
    wait_until("all files with the map in one place", || {
        let before = placement();
        let projected: &[&str] = if origin.is_empty() { &[] } else { &["map.utm.tif", "map.wgs84.tif"] };
        let files = ["map.json", "map.png", "map.geojson", "map.ply", "map.csv", "map.labels.csv", "map.tif"];
        for file in files.iter().chain(&["map.coco.json", "map.taglab.json"]).chain(projected) {
            let made = ctl(port, &["map", "--out", &path(file)]);
            assert_eq!(made.status.code(), Some(0), "{file}: {}", text(&made));
        }
        std::fs::write(path("state.json"), state(port).unwrap().to_string()).unwrap();
        placement() == before
    });
    let labels_in = |file: &str| {
        let table = std::fs::read_to_string(path(file)).unwrap();
        let column = table.lines().next().unwrap().split(',').position(|name| name == "label").unwrap();
        table.lines().skip(1).map(|line| line.split(',').nth(column).unwrap().to_owned()).collect::<BTreeSet<_>>()
    };
    let two = ctl(port, &["map", "--labels", "2", "--out", &path("two.csv")]);
    assert_eq!(two.status.code(), Some(0), "{}", text(&two));
    let (cut, all) = (labels_in("two.csv"), labels_in("map.csv"));
    let tree = &state(port).unwrap()["vehicles"][0]["label_tree"];
    assert!(cut.is_subset(&all) && (tree.is_null() || cut.len() <= 2), "{cut:?} of {all:?}, {tree}");
    let png = ctl(port, &["map", "--labels", "2", "--out", &path("two.png")]);
    assert_eq!(png.status.code(), Some(0), "{}", text(&png));
    let json = ctl(port, &["map", "--labels", "2", "--out", &path("two.json")]);
    assert!(json.status.code() == Some(2) && text(&json).contains("two.json"), "{}", text(&json));
    run_script(&python, "tests/exports/check.py", &[&path("")]);
}

#[test]
fn exports_with_an_origin_open_in_the_right_place() {
    assert_exports_open("exports-earth", &["--set", "mission.origin_deg=[60.17, -10.25]"]);
}

#[test]
fn exports_without_an_origin_open_in_metres() {
    assert_exports_open("exports-metres", &[]);
}
