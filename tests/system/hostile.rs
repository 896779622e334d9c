//! Clients that are slow or hostile: they cost the surface neither its link nor its memory.

use super::api::surface_at;
use scenecast_tests::{LIGHT, Process, free_port, http, http_whole, is_full, scratch, state, wait_until};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::time::{Duration, Instant};

const SPEED: f64 = 5.0;

fn connect(port: u16, said: &str) -> Option<TcpStream> {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).ok()?;
    stream.set_read_timeout(Some(Duration::from_secs(5))).ok()?;
    stream.write_all(said.as_bytes()).ok()?;
    Some(stream)
}

/// Asks for a stream of events; the stream, and the status of the surface's answer.
fn open_stream(port: u16) -> Option<(TcpStream, String)> {
    let mut first = [0; 12];
    let mut stream = connect(port, &format!("GET /api/v2/events HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n"))?;
    stream.read_exact(&mut first).ok()?;
    Some((stream, String::from_utf8_lossy(&first[9..]).into_owned()))
}

fn is_served(port: u16) -> bool {
    open_stream(port).is_some_and(|(_, status)| status == "200")
}

struct End<'a>(&'a AtomicBool);

impl Drop for End<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Does `attack` while an operator goes on working: he has his answers, frames go on to arrive, and the surface does not grow. On a
/// quiet machine his answers come soon, and the mission runs at its pace.
fn assert_unmoved(demo: &Process, port: u16, what: &str, attack: impl FnOnce()) {
    let before = state(port).unwrap();
    let held = demo.memory_bytes().unwrap_or_default();
    let began = Instant::now();
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // Also when the attack fails.
        let _end = End(&done);
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                let asked = Instant::now();
                let answer = state(port);
                assert!(answer.is_some(), "{what}: the operator gets no answer");
                let waited = asked.elapsed();
                assert!(!is_full() || waited < Duration::from_secs(3), "{what}: he waited {waited:?}");
                std::thread::sleep(Duration::from_millis(200));
            }
        });
        attack();
        std::thread::sleep(Duration::from_secs(2).saturating_sub(began.elapsed()));
    });
    let after = state(port).unwrap();
    let passed = after["now_s"].as_f64().unwrap() - before["now_s"].as_f64().unwrap();
    let expected = began.elapsed().as_secs_f64() * SPEED;
    assert!(!is_full() || passed > 0.7 * expected - 5.0, "{what}: {passed} s of mission instead of {expected}");
    let frames = |s: &serde_json::Value| s["link"]["up"]["frames"].as_u64().unwrap();
    assert!(frames(&after) > frames(&before), "{what}: no frame was heard meanwhile");
    let holds = demo.memory_bytes().unwrap_or_default();
    assert!(holds < held + (64 << 20), "{what}: the surface grew from {held} to {holds} bytes");
}

#[test]
fn no_client_stalls_the_link_or_fills_the_memory() {
    let port = free_port();
    // Its world is patches: a drawn reef keeps the floor that it has drawn, so that its memory grows by itself.
    let demo = scenecast_tests::demo(port, SPEED as u32, &["--duration", "30000"]);
    wait_until("a map", || state(port).is_some_and(|s| s["vehicles"][0]["map"]["explored_cells"].as_u64() > Some(50)));
    let host = format!("Host: 127.0.0.1:{port}\r\n");
    assert_unmoved(&demo, port, "ten thousand slow heads", || {
        for _ in 0..25 {
            let held: Vec<_> =
                (0..400).filter_map(|_| connect(port, "GET /api/v2/state HTTP/1.1\r\nX-Slow: ")).collect();
            assert!(held.len() > 200, "the surface takes connections");
        }
    });
    assert_unmoved(&demo, port, "readers that do not read", || {
        let mut deaf = Vec::new();
        wait_until("there are only so many streams", || {
            let opened: Vec<_> = (0..20).filter_map(|_| open_stream(port)).collect();
            let is_full = opened.iter().any(|(_, status)| status == "503");
            deaf.extend(opened);
            is_full
        });
        assert!(deaf.len() >= 64, "{} readers fill the surface", deaf.len());
        wait_until("streams that are not read give up their seats", || is_served(port));
        drop(deaf);
    });
    assert_unmoved(&demo, port, "a thousand bodies that do not come", || {
        let head =
            format!("POST /api/v2/budget HTTP/1.1\r\n{host}X-Scenecast: 1\r\nContent-Type: application/json\r\n");
        for _ in 0..3 {
            let ask = format!("{head}Content-Length: 100\r\n\r\n{{");
            let held: Vec<_> = (0..350).filter_map(|_| connect(port, &ask)).collect();
            assert!(held.len() > 200, "the surface takes connections");
            std::thread::sleep(Duration::from_millis(500));
        }
    });
    assert_unmoved(&demo, port, "bodies without end", || {
        for length in ["Content-Length: 99999999999", "Transfer-Encoding: chunked"] {
            let head =
                format!("POST /api/v2/budget HTTP/1.1\r\n{host}X-Scenecast: 1\r\nContent-Type: application/json\r\n");
            let mut stream = connect(port, &format!("{head}{length}\r\n\r\n")).unwrap();
            let chunk = format!("10000\r\n{}\r\n", "1".repeat(0x10000));
            let written = (0..2000).map_while(|_| stream.write_all(chunk.as_bytes()).ok()).count();
            assert!(written < 2000, "{length}: it was all taken");
        }
    });
    assert_unmoved(&demo, port, "heads without end", || {
        let mut stream = connect(port, "GET / HTTP/1.1\r\n").unwrap();
        let line = format!("X-More: {}\r\n", "y".repeat(1000));
        let written = (0..100_000).map_while(|_| stream.write_all(line.as_bytes()).ok()).count();
        assert!(written < 100_000);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        assert!(answer.is_empty() || answer.starts_with(b"HTTP/1.1 4"), "{}", String::from_utf8_lossy(&answer));
    });
    assert_unmoved(&demo, port, "all files at once", || {
        std::thread::scope(|scope| {
            for i in 0..60 {
                let file = ["map", "map.png", "map.geojson", "map.ply"][i % 4];
                scope.spawn(move || http(port, "GET", &format!("/api/v2/vehicles/1/{file}"), "", ""));
            }
        });
    });
    wait_until("a reader is served again", || is_served(port));
}

/// A vehicle whose modem is at this port of the surface.
fn vehicle_at(modem: u16, dir: &Path) -> Process {
    let config = scenecast_tests::workspace().join("config/auv.toml");
    let sets = [format!("modem.connect=127.0.0.1:{modem}"), format!("runtime.state_dir=\"{}\"", dir.display())];
    let mut arguments = [&["auv", "--config", config.to_str().unwrap()][..], &LIGHT].concat();
    arguments.extend(sets.iter().flat_map(|s| ["--set", s]));
    Process::start(&arguments)
}

/// Three kinds of clients of a viewer ask without a pause: edits, logins, and streams that they leave. The operator, who logged in
/// before, holds and resumes the vehicle meanwhile.
#[test]
fn the_load_of_a_viewer_delays_no_hold_and_ends_no_session() {
    let (dir, modem) = (scratch("viewer-load"), free_port());
    let (_surface, port, headers) = surface_at(&dir, &["viewer victor", "operator anna"], modem);
    let _vehicle = vehicle_at(modem, &dir.join("auv"));
    let mode = || {
        let (_, body) = http(port, "GET", "/api/v2/state", &headers[1], "")?;
        let state: Value = serde_json::from_slice(&body).ok()?;
        state["vehicles"][0]["status"]["mode"].as_str().map(str::to_owned)
    };
    wait_until("the vehicle, which knows no orders, holds", || mode().as_deref() == Some("hold"));
    let login = |who: usize| {
        let form = "Content-Type: application/x-www-form-urlencoded\r\n";
        let token = format!("token={who:032}");
        http_whole(port, "POST", "/login", form, &token).unwrap_or_default()
    };
    let cookie = login(1).lines().find_map(|l| l.strip_prefix("set-cookie: ")).expect("a cookie").to_owned();
    let session = cookie.split(';').next().unwrap();
    let operator = format!("Cookie: {session}\r\nX-Scenecast: 1\r\nContent-Type: application/json\r\n");
    let order = |action: &str| {
        let began = Instant::now();
        let body = format!("{{\"action\": \"{action}\"}}");
        let answer = http(port, "POST", "/api/v2/vehicles/1/constraints", &operator, &body);
        assert_eq!(answer.map(|(status, _)| status), Some(202), "{action}");
        let wanted = if action == "hold" { "hold" } else { "survey" };
        wait_until("the vehicle obeys", || mode().as_deref() == Some(wanted));
        assert!(!is_full() || began.elapsed() < Duration::from_secs(3), "{action} took {:?}", began.elapsed());
    };
    order("resume");
    let edit = || {
        let refused = http(port, "POST", "/api/v2/vehicles/1/labels", &headers[0], r#"{"label": 1, "name": "x"}"#);
        assert!(refused.is_none_or(|(status, _)| status == 403));
    };
    let stream_head = format!("GET /api/v2/events HTTP/1.1\r\nHost: localhost\r\n{}\r\n", headers[0]);
    let stream = || drop(connect(port, &stream_head));
    let log_in = || drop(login(0));
    let clients: [&(dyn Fn() + Sync); 3] = [&edit, &stream, &log_in];
    let until = Instant::now() + Duration::from_secs(if is_full() { 60 } else { 3 });
    let (requests, mut holds) = (AtomicU32::new(0), 0);
    std::thread::scope(|scope| {
        for ask in clients.iter().chain(&clients) {
            scope.spawn(|| {
                while Instant::now() < until {
                    ask();
                    requests.fetch_add(1, Ordering::Relaxed);
                }
            });
        }
        while Instant::now() < until {
            order("hold");
            order("resume");
            holds += 1;
        }
    });
    let (_, log) = http(port, "GET", "/api/v2/log?kind=order", &headers[1], "").unwrap();
    let log: Value = serde_json::from_slice(&log).unwrap();
    let logged = log["entries"].as_array().unwrap().iter().filter(|entry| entry["text"] == "hold").count();
    assert_eq!(logged, holds, "{log}");
    assert!(requests.into_inner() > 300, "the load is none");
}
