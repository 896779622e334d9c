//! The surface's GPS as real connections: gpsd that goes away and comes back, a receiver that talks nonsense.

use scenecast_core::nmea;
use scenecast_tests::{Process, assert_refused, free_port, http, scratch, wait_until};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};

/// A surface with a GPS at `gps`, its page, and what the page says of the position.
fn surface(name: &str, gps: &str) -> (Process, impl Fn() -> Value + use<>) {
    let dir = scratch(name);
    let page = free_port();
    let text = format!(
        "[modem]\nlisten = \"127.0.0.1:{}\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n[position]\ngps = \"{gps}\"\n\
         [runtime]\nstate_dir = \"{}\"\n",
        free_port(),
        dir.join("asv").display()
    );
    let file = dir.join("asv.toml");
    std::fs::write(&file, text).unwrap();
    let process = Process::start(&["asv", "--config", file.to_str().unwrap()]);
    let state = move || {
        let Some((_, body)) = http(page, "GET", "/api/v2/state", "", "") else { return Value::Null };
        serde_json::from_slice(&body).unwrap_or_default()
    };
    (process, state)
}

/// A connection of the surface, once it has asked gpsd to watch.
fn watched(listener: &TcpListener) -> TcpStream {
    let (mut stream, _) = listener.accept().unwrap();
    stream.write_all(b"{\"class\":\"VERSION\",\"release\":\"3.25\",\"proto_major\":3,\"proto_minor\":15}\r\n").unwrap();
    let mut asked = Vec::new();
    while !asked.ends_with(b"\n") {
        let mut byte = [0];
        stream.read_exact(&mut byte).unwrap();
        asked.extend(byte);
    }
    let asked = String::from_utf8(asked).unwrap();
    assert!(asked.starts_with("?WATCH={") && asked.contains("\"json\":true"), "{asked}");
    stream
}

fn report(second: u32) -> String {
    format!(
        "{{\"class\":\"TPV\",\"mode\":3,\"time\":\"2026-05-01T12:00:{second:02}.000Z\",\"lat\":29.5,\"lon\":34.92,\"eph\":4.0}}\r\n"
    )
}

#[test]
fn gpsd_is_reconnected_and_old_positions_are_not_good() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (_process, state) = surface("gpsd", &format!("gpsd:{}", listener.local_addr().unwrap()));
    let mut stream = watched(&listener);
    let mut second = 0;
    let mut feed = |stream: &mut TcpStream| {
        second += 1;
        let _ = stream.write_all(report(second % 60).as_bytes());
    };
    wait_until("a good position", || {
        feed(&mut stream);
        state()["position"]["is_valid"] == true
    });
    let now = state();
    assert!((now["mission"]["origin"]["lat_deg"].as_f64().unwrap() - 29.5).abs() < 1e-9, "{now}");
    drop(stream);
    wait_until("the position is old", || state()["position"]["is_valid"] == false);
    let mut again = watched(&listener);
    wait_until("it is good again", || {
        feed(&mut again);
        state()["position"]["is_valid"] == true
    });
}

#[test]
fn nonsense_of_a_receiver_is_counted() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let (_process, state) = surface("nmea", &format!("tcp:{}", listener.local_addr().unwrap()));
    let (mut stream, _) = listener.accept().unwrap();
    let good = |second: u32| {
        nmea::line(&format!("GPGGA,1200{:02}.00,2930.00000,N,03455.20000,E,1,09,1.0,0.0,M,0.0,M,,", second % 60))
    };
    stream.write_all(good(0).replace("2930", "2931").as_bytes()).unwrap();
    stream.write_all(&[b'$'; 5000]).unwrap();
    stream.write_all(b"\r\n\xFF\xFE\r\n").unwrap();
    stream.write_all(nmea::line("GPGGA,120000.00,nan,N,inf,E,1,09,1.0,0.0,M,0.0,M,,").as_bytes()).unwrap();
    stream.write_all(nmea::line("GPGGA,120000.00,,,,,0,00,99.9,,,,,,").as_bytes()).unwrap();
    let mut second = 0;
    wait_until("a good position after the nonsense", || {
        second += 1;
        let _ = stream.write_all(good(second).as_bytes());
        state()["position"]["is_valid"] == true
    });
    let refused = state()["position"]["rejected"].clone();
    let expected = serde_json::json!({ "checksum": 1, "too_long": 1, "malformed": 2, "no_position": 1 });
    assert_eq!(refused, expected);
}

#[test]
fn wrong_places_of_instruments_are_refused_with_what_is_allowed() {
    let dir = scratch("wrong-places");
    let state = format!("runtime.state_dir={}", dir.display());
    let config = scenecast_tests::workspace().join("config");
    let [asv, auv] = ["asv.toml", "auv.toml"].map(|f| config.join(f).display().to_string());
    let common = ["--set", &state, "--set", "console.listen=", "--set", "modem.listen=127.0.0.1:0"];
    let asv = |set: &str, words: &[&str]| {
        assert_refused(&[&["asv", "--config", &asv][..], &common, &["--set", set]].concat(), words);
    };
    asv("position.gps=/dev/ttyUSB0", &["position.gps", "serial:DEVICE:BAUD", "gpsd:HOST:PORT"]);
    asv("position.follow=true", &["position.follow", "position.gps"]);
    let auv = |set: &str, words: &[&str]| {
        let sets = ["--set", &state, "--set", set];
        assert_refused(&[&["auv", "--config", &auv][..], &sets].concat(), words);
    };
    auv("autopilot.kind=mavlink", &["autopilot.port", "udp:ADDRESS:PORT"]);
    auv("autopilot.kind=submarine", &["autopilot.kind", "mavlink"]);
    auv("mission.origin_deg=[91.0, 0.0]", &["mission.origin_deg", "-90 to 90"]);
}
