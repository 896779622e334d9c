//! The operator's page and API of a running demo.

use scenecast_tests::{Process, UNRECORDED, demo, free_port, http, http_whole, state, wait_until};
use serde_json::Value;

fn slot(state: &Value, name: &str) -> Option<String> {
    let slots = state["vehicles"][0]["directive"]["slots"].as_array()?;
    slots.iter().find(|s| s["slot"] == name)?["state"].as_str().map(str::to_owned)
}

const ORDER: &str = "Content-Type: application/json\r\nX-Scenecast: 1\r\n";

#[test]
fn an_operator_sends_weights_and_receives_an_image() {
    let port = free_port();
    let _demo = demo(port, 20, &["--duration", "600"]);
    wait_until("labels on the map", || {
        state(port).is_some_and(|s| s["vehicles"][0]["labels"].as_array().is_some_and(|l| l.len() > 1))
    });
    let label = state(port).unwrap()["vehicles"][0]["labels"][0]["id"].as_u64().unwrap();
    let weights = format!("{{\"weights\": {{\"{label}\": 0.8}}, \"exploration\": 0.2}}");
    assert_eq!(http(port, "POST", "/api/v2/vehicles/1/utility", ORDER, &weights).unwrap().0, 202);
    wait_until("the weights are applied", || slot(&state(port).unwrap(), "utility").as_deref() == Some("applied"));
    let order = format!("{{\"label\": {label}}}");
    assert_eq!(http(port, "POST", "/api/v2/vehicles/1/exemplars", ORDER, &order).unwrap().0, 202);
    wait_until("the image has arrived", || {
        state(port).unwrap()["vehicles"][0]["labels"][0]["exemplar"]["state"] == "received"
    });
    let (status, webp) = http(port, "GET", &format!("/api/v2/vehicles/1/exemplars/{label}.webp"), "", "").unwrap();
    assert!(status == 200 && webp.starts_with(b"RIFF"));
    let (status, page) = http(port, "GET", "/", "", "").unwrap();
    assert!(status == 200 && String::from_utf8_lossy(&page).contains("<title>"));
}

#[test]
fn wrong_orders_and_other_sites_are_refused() {
    let port = free_port();
    let _demo = demo(port, 1, &["--duration", "600"]);
    wait_until("the page answers", || state(port).is_some());
    let refused = |path: &str, headers: &str, body: &str| http(port, "POST", path, headers, body).unwrap();
    let (status, body) = refused("/api/v2/vehicles/1/utility", ORDER, "{\"weights\": {\"9\": 0.5}}");
    assert_eq!(status, 422);
    assert!(String::from_utf8_lossy(&body).contains("label 9"), "{}", String::from_utf8_lossy(&body));
    assert_eq!(refused("/api/v2/budget", ORDER, "{\"budget_bps\": 1}").0, 422);
    assert_eq!(refused("/api/v2/budget", "Content-Type: application/json\r\n", "{\"budget_bps\": 1000}").0, 403);
    let other_site = format!("{ORDER}Origin: http://elsewhere.example\r\n");
    assert_eq!(refused("/api/v2/budget", &other_site, "{\"budget_bps\": 1000}").0, 403);
    assert_eq!(http(port, "GET", "/api/v2/vehicles/7/map", "", "").unwrap().0, 404);
    assert_eq!(refused("/api/v2/budget", ORDER, &"x".repeat(100_000)).0, 413);
}

#[test]
fn a_map_is_read_by_region_and_by_changed_tiles() {
    let port = free_port();
    let _demo = demo(port, 20, &["--duration", "600"]);
    wait_until("a map", || state(port).is_some_and(|s| s["vehicles"][0]["map"]["explored_cells"].as_u64() > Some(0)));
    let get = |path: &str| http(port, "GET", &format!("/api/v2/vehicles/1/{path}"), "", "").unwrap();
    let region = "map?x0=-2&y0=-3&width=4&height=5";
    let (status, body) = get(region);
    let body: Value = serde_json::from_slice(&body).unwrap();
    assert_eq!((status, &body["x0"], &body["y0"], &body["width"]), (200, &(-2).into(), &(-3).into(), &4.into()));
    assert_eq!(body["labels"].as_str().unwrap().len(), 28, "20 bytes in base64");
    for wrong in ["map?x0=1", "map?x0=1&y0=a&width=1&height=1", "map?x0=0&y0=0&width=0&height=1"] {
        assert_eq!(get(wrong).0, 422, "{wrong}");
    }
    let (status, body) = get("map?x0=0&y0=0&width=100000&height=100000");
    assert!(status == 422 && String::from_utf8_lossy(&body).contains("at most 1048576"));
    let index = |path: &str| -> Value {
        let (status, body) = get(path);
        assert_eq!((status, &body[..5]), (200, &b"SCMT\x01"[..]));
        let length = u32::from_le_bytes(body[8..12].try_into().unwrap()) as usize;
        serde_json::from_slice(&body[12..12 + length]).unwrap()
    };
    let whole = index("map/tiles");
    assert!(whole["since"].is_null() && !whole["tiles"].as_array().unwrap().is_empty());
    let changed = index(&format!("map/tiles?since={}", whole["tag"].as_str().unwrap()));
    assert_eq!(changed["since"], whole["tag"]);
    assert!(index("map/tiles?since=0000000-1")["since"].is_null());
}

#[test]
fn the_page_is_small_and_cached() {
    let port = free_port();
    let _demo = demo(port, 20, &["--duration", "600"]);
    wait_until("the page answers", || state(port).is_some());
    let (_, index) = http(port, "GET", "/", "", "").unwrap();
    let index = String::from_utf8(index).unwrap();
    let files =
        index.split("href=\"").skip(1).filter_map(|rest| rest.split('"').next()).filter(|f| !f.starts_with('#'));
    let mut bytes = 0;
    for file in files.chain(["js/main.js", ""]) {
        let (status, packed) = http(port, "GET", &format!("/{file}"), "Accept-Encoding: gzip\r\n", "").unwrap();
        assert_eq!(status, 200, "{file}");
        bytes += packed.len();
    }
    assert!((10_000..400_000).contains(&bytes), "{bytes} bytes");
    for path in ["/", "/js/main.js", "/api/v2/vehicles/1/map.pgw"] {
        let answer = http_whole(port, "GET", path, "", "").unwrap();
        let tag = answer.lines().find_map(|l| l.strip_prefix("etag: ")).expect("a tag");
        let (status, _) = http(port, "GET", path, &format!("If-None-Match: {tag}\r\n"), "").unwrap();
        assert!(status == 304 || path.starts_with("/api"), "{path}: {status}");
    }
}

#[test]
fn a_demo_too_fast_for_the_machine_still_answers() {
    let port = free_port();
    let mut demo = Process::start(
        &[&["demo", "--port", &port.to_string(), "--speed", "1000", "--duration", "1000000"][..], &UNRECORDED].concat(),
    );
    wait_until("labels on the map", || {
        state(port).is_some_and(|s| s["vehicles"][0]["labels"].as_array().is_some_and(|l| l.len() > 1))
    });
    for exploration in [0.1, 0.2, 0.3] {
        let weights = format!("{{\"weights\": {{}}, \"exploration\": {exploration}}}");
        assert_eq!(http(port, "POST", "/api/v2/vehicles/1/utility", ORDER, &weights).expect("an answer").0, 202);
    }
    assert_eq!(demo.interrupt(), Some(0));
}
