//! What ten open consoles cost the surface, and how soon they have a map that came in.
//!
//! `cargo bench -p scenecast-tests --bench console` flies a recorded mission between two processes at the pace of the world
//! and prints processor time of the surface without and with the consoles, and the time from the arrival of a change until
//! a console has the whole map. It fails if the consoles cost 10 % of a core, or half of the maps come later than 200 ms.

use scenecast_tests::{Process, free_port, run, scratch, state, wait_until, workspace};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::{Duration, Instant};

const CONSOLES: usize = 10;
const WINDOW: Duration = Duration::from_secs(30);

fn main() -> ExitCode {
    let dir = scratch("console-bench");
    let path = |name: &str| dir.join(name).display().to_string();
    let recording = path("recording");
    let sim = run(&["sim", "--duration", "240", "--record", &recording, "--out", &path("run")]);
    assert!(sim.status.success(), "{}", String::from_utf8_lossy(&sim.stderr));
    let (port, modem) = (free_port(), free_port());
    let start = |role: &str, sets: &[String]| {
        let config = workspace().join(format!("config/{role}.toml")).display().to_string();
        let state = format!("runtime.state_dir=\"{}\"", path(role));
        let mut arguments = vec![role.to_owned(), "--config".to_owned(), config, "--set".to_owned(), state];
        arguments.extend(sets.iter().flat_map(|s| ["--set".to_owned(), s.clone()]));
        Process::start(&arguments.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let surface =
        start("asv", &[format!("console.listen=127.0.0.1:{port}"), format!("modem.listen=127.0.0.1:{modem}")]);
    let source = format!("camera.source=frames:{recording}");
    let _vehicle = start("auv", &[format!("modem.connect=127.0.0.1:{modem}"), source]);
    wait_until("a map", Duration::from_secs(120), || {
        state(port).is_some_and(|s| s["vehicles"][0]["map"]["explored_cells"].as_u64() > Some(0))
    });
    let alone = share_of_a_core(&surface);
    let late = Mutex::new(Vec::new());
    let ends = Instant::now() + WINDOW + Duration::from_secs(2);
    let mut with = 0.0;
    std::thread::scope(|scope| {
        for _ in 0..CONSOLES {
            scope.spawn(|| late.lock().unwrap().extend(console(port, ends)));
        }
        std::thread::sleep(Duration::from_secs(1));
        with = share_of_a_core(&surface);
    });
    let mut late = late.into_inner().unwrap();
    late.sort_by(f64::total_cmp);
    let at =
        |share: f64| late.get(((late.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(f64::NAN) * 1e3;
    println!("surface alone: {:.1} % of a core; with {CONSOLES} consoles: {:.1} %", 100.0 * alone, 100.0 * with);
    println!(
        "{} maps fetched; from arrival to the whole map: median {:.0} ms, 95th percentile {:.0} ms, worst {:.0} ms",
        late.len(),
        at(0.5),
        at(0.95),
        at(1.0)
    );
    let missed = with - alone >= 0.1 || late.is_empty() || at(0.5) > 200.0;
    if missed { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn share_of_a_core(process: &Process) -> f64 {
    let used = || process.cost().map_or(Duration::ZERO, |(_, time)| time);
    let (before, began) = (used(), Instant::now());
    std::thread::sleep(WINDOW - Duration::from_secs(2));
    (used() - before).as_secs_f64() / began.elapsed().as_secs_f64()
}

/// Listens until `ends` and fetches each map as the page does; how late each was, seconds.
fn console(port: u16, ends: Instant) -> Vec<f64> {
    let mut events = BufReader::new(request(port, "/api/v2/events"));
    // The mission's clock against ours: no state comes before it was made, so the quickest one tells best.
    let (origin, mut clock) = (Instant::now(), f64::INFINITY);
    let (mut updated, mut late, mut first) = (0.0, Vec::new(), true);
    let mut line = String::new();
    while Instant::now() < ends && events.read_line(&mut line).is_ok_and(|n| n > 0) {
        if let Some(data) = line.strip_prefix("data: {\"now_s\"") {
            let state: serde_json::Value = serde_json::from_str(&format!("{{\"now_s\"{data}")).unwrap();
            clock = clock.min(origin.elapsed().as_secs_f64() - state["now_s"].as_f64().unwrap());
            updated = state["vehicles"][0]["map"]["updated_s"].as_f64().unwrap_or(0.0);
        } else if line.starts_with("event: map") {
            let mut map = Vec::new();
            request(port, "/api/v2/vehicles/1/map/tiles").read_to_end(&mut map).unwrap();
            // The map that was there before the console has no arrival to be late from.
            if !std::mem::take(&mut first) {
                late.push(origin.elapsed().as_secs_f64() - clock - updated);
            }
        }
        line.clear();
    }
    late
}

fn request(port: u16, path: &str) -> TcpStream {
    let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
    // HTTP/1.0: no lengths of chunks between the events.
    let head = format!("GET {path} HTTP/1.0\r\nHost: 127.0.0.1:{port}\r\nAccept-Encoding: gzip\r\n\r\n");
    stream.write_all(head.as_bytes()).unwrap();
    stream
}
