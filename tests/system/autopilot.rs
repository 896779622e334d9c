//! The vehicle and an autopilot built on pymavlink that behaves as ArduSub does.

use scenecast_core::LatLon;
use scenecast_drivers::autopilot::mavlink::MavlinkConfig;
use scenecast_drivers::autopilot::{Autopilot, Goal, Health, Mavlink, Step};
use scenecast_protocol::time::Instant;
use scenecast_tests::{Process, free_port, http, python, scratch, wait_until, workspace};
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::net::UdpSocket;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// The peer as a process.
struct Peer {
    child: Child,
    orders: ChildStdin,
    seen: Arc<Mutex<Value>>,
}

impl Peer {
    fn start(python: &str, port: u16, speed_m_s: f64) -> Self {
        let script = workspace().join("tests/ardusub_peer.py");
        let mut child = Command::new(python)
            .arg(script)
            .args([port.to_string(), speed_m_s.to_string()])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the peer starts");
        let lines = BufReader::new(child.stdout.take().expect("it has an output")).lines();
        let orders = child.stdin.take().expect("it has an input");
        let seen = Arc::new(Mutex::new(Value::Null));
        let told = Arc::clone(&seen);
        std::thread::spawn(move || {
            for line in lines.map_while(Result::ok) {
                *told.lock().expect("nobody panics") = serde_json::from_str(&line).unwrap_or_default();
            }
        });
        Self { child, orders, seen }
    }

    fn order(&mut self, order: &str) {
        writeln!(self.orders, "{order}").expect("the peer lives");
    }

    fn seen(&self) -> Value {
        self.seen.lock().expect("nobody panics").clone()
    }

    fn number(&self, name: &str) -> f64 {
        self.seen()[name].as_f64().unwrap_or(0.0)
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Our state machine on a socket of this thread.
struct Bench {
    pilot: Mavlink,
    socket: UdpSocket,
    peer: Option<std::net::SocketAddr>,
    began: std::time::Instant,
    way: (f64, f64),
    /// The longest stretch of way in one report, metres.
    longest_m: f64,
    notes: Vec<String>,
    last: Option<Step>,
}

impl Bench {
    fn new() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
        let config = MavlinkConfig { system: 1, component: None, arms: true, silence: Duration::from_secs(3) };
        let began = std::time::Instant::now();
        Self {
            pilot: Mavlink::new(config, Instant::ZERO),
            socket,
            peer: None,
            began,
            way: (0.0, 0.0),
            longest_m: 0.0,
            notes: Vec::new(),
            last: None,
        }
    }

    fn now(&self) -> Instant {
        Instant::ZERO + self.began.elapsed()
    }

    fn step(&mut self) {
        let mut buffer = [0; 2048];
        if let Ok((n, from)) = self.socket.recv_from(&mut buffer) {
            self.peer = Some(from);
            self.pilot.handle_bytes(&buffer[..n], self.now());
        }
        if self.now() >= self.pilot.poll_timeout() {
            self.pilot.handle_timeout(self.now());
        }
        while let Some(bytes) = self.pilot.poll_output() {
            self.peer.iter().for_each(|peer| drop(self.socket.send_to(&bytes, peer)));
        }
        while let Some(step) = self.pilot.poll_step() {
            self.way = (self.way.0 + step.dx_m, self.way.1 + step.dy_m);
            self.longest_m = self.longest_m.max(step.dx_m.hypot(step.dy_m));
            self.last = Some(step);
        }
        self.notes.extend(std::iter::from_fn(|| self.pilot.poll_note()));
    }

    fn is_noted(&self, text: &str) -> bool {
        self.notes.iter().any(|note| note.contains(text))
    }

    fn until(&mut self, what: &str, mut done: impl FnMut(&mut Self) -> bool) {
        let limit = std::time::Instant::now() + scenecast_tests::GIVEN_UP;
        while !done(self) {
            assert!(std::time::Instant::now() < limit, "{what}: not met; {:?}", self.pilot.counters());
            self.step();
        }
    }
}

#[test]
fn ardusub_is_armed_guided_and_given_its_position() {
    let Some(python) = python("pymavlink") else { return };
    let mut bench = Bench::new();
    let port = bench.socket.local_addr().unwrap().port();
    // The way is a sum of reported velocities; on a busy machine, a turn between two reports costs the more the faster it is.
    let mut peer = Peer::start(&python, port, 1.5);
    bench.pilot.set_goal(Some(Goal { east_m: 12.0, north_m: 9.0, depth_m: Some(1.0), place: None }), Instant::ZERO);
    bench.until("the autopilot is in command", |b| b.pilot.health(b.now()) == Health::InCommand);
    assert_eq!((peer.number("mode"), peer.seen()["armed"].as_bool()), (4.0, Some(true)));
    // Half way it takes a fix in, and its own frame jumps by 25 m: neither way nor goal may.
    bench.until("half of the way", |b| b.way.0 > 5.0);
    let place = LatLon { lat_deg: 29.5001, lon_deg: 34.9201 };
    bench.until("five GPS inputs", |b| {
        b.pilot.handle_place(place, 1.5, b.now());
        peer.seen()["jumped"] == true
    });
    bench.until("the goal", |b| (b.way.0 - 12.0).hypot(b.way.1 - 9.0) < 0.7);
    bench.until("the peer tells", |_| (peer.number("east") - 12.0).hypot(peer.number("north") - 9.0) < 1.0);
    let gps = peer.seen()["gps"].clone();
    assert!((gps[0].as_f64().unwrap() - 29.5001).abs() < 2e-4 && gps[2].as_f64() == Some(1.5), "{gps}");
    let seen = peer.seen();
    assert_eq!((seen["bad"].as_u64(), seen["failsafes"].as_u64()), (Some(0), Some(0)), "{seen}");
    // A pilot takes over: he is not fought.
    peer.order("pilot 2");
    bench.until("the pilot is noticed", |b| b.pilot.health(b.now()) == Health::NotInCommand);
    let targets = peer.number("targets");
    let until = bench.now() + Duration::from_secs(3);
    bench.until("three seconds", |b| b.now() >= until);
    assert_eq!((peer.number("mode"), peer.number("targets")), (2.0, targets));
}

#[test]
fn ardusub_that_refuses_gets_lost_or_restarts_is_recovered() {
    let Some(python) = python("pymavlink") else { return };
    let mut bench = Bench::new();
    let port = bench.socket.local_addr().unwrap().port();
    let mut peer = Peer::start(&python, port, 1.0);
    let goal = |b: &mut Bench, east_m: f64| {
        let to = Goal { east_m: east_m - b.way.0, north_m: -b.way.1, depth_m: Some(1.0), place: None };
        b.pilot.set_goal(Some(to), b.now());
    };
    goal(&mut bench, 100.0);
    bench.until("it flies", |b| b.pilot.health(b.now()) == Health::InCommand && b.way.0 > 1.0);
    let last = bench.last.unwrap();
    assert_eq!((last.roll_rad as f32, last.pitch_rad as f32), (0.1, -0.05));
    // 20 m of water, and a beam that leans with the vehicle.
    assert!((last.altitude_m.unwrap() - (20.0 - last.depth_m.unwrap())).abs() < 0.6, "{last:?}");

    peer.order("refuse");
    goal(&mut bench, -100.0);
    bench.until("the refusal is noticed", |b| b.pilot.health(b.now()) == Health::NotInCommand);
    assert!(
        bench.is_noted("the autopilot does not follow the waypoint: it reports a target 200 m away"),
        "{:?}",
        bench.notes
    );
    peer.order("accept");
    bench.until("it is in command", |b| b.pilot.health(b.now()) == Health::InCommand);
    assert!(bench.is_noted("the autopilot follows the waypoint again"), "{:?}", bench.notes);

    peer.order("lose");
    bench.until("the position is lost", |b| b.is_noted("the autopilot reports no position any more"));
    let way = bench.way;
    peer.order("find");
    bench.until("it has a position", |b| b.is_noted("the autopilot reports its position again"));
    assert!((bench.way.0 - way.0).hypot(bench.way.1 - way.1) < 1.0, "{way:?} and {:?}", bench.way);
    bench.until("it flies on", |b| b.way.0 < way.0 - 2.0 && b.pilot.health(b.now()) == Health::InCommand);

    let way = bench.way;
    peer.order("reboot");
    bench.until("the restart is noticed", |b| b.is_noted("the autopilot has restarted"));
    bench.until("it flies on", |b| b.way.0 < way.0 - 2.0 && b.pilot.health(b.now()) == Health::InCommand);
    // It has moved by no more than a metre a second between two reports at most 3 s apart.
    assert!(bench.longest_m < 3.5 && bench.way.1.abs() < 1.0, "{} {:?}", bench.longest_m, bench.way);
    let (east, north) = (peer.number("east"), peer.number("north"));
    assert!(
        (bench.way.0 - east).hypot(bench.way.1 - north) < 4.0,
        "{:?}, and the vehicle is at {east} {north}",
        bench.way
    );
    assert_eq!(peer.seen()["bad"].as_u64(), Some(0));
}

/// HEARTBEAT of a ground station (system 255, component 190, no autopilot), MAVLink 1.
const GROUND_STATION: [u8; 17] = [0xFE, 9, 0, 255, 190, 0, 0, 0, 0, 0, 6, 8, 0, 4, 3, 0x49, 0x21];

#[test]
fn a_vehicle_surveys_on_ardusub_and_reports_its_silence() {
    let Some(python) = python("pymavlink") else { return };
    let dir = scratch("ardusub");
    let [modem, page, mavlink] = [(); 3].map(|()| free_port());
    let file = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let state = |who: &str| dir.join(who).display().to_string();
    let auv = file(
        "auv.toml",
        format!(
            "[modem]\nconnect = \"127.0.0.1:{modem}\"\n[survey]\nstart = \"free\"\narea_m = [0, 0, 30, 20]\n[link]\nstatus_period_s = 1\n\
             [autopilot]\nkind = \"mavlink\"\nport = \"udp:127.0.0.1:{mavlink}\"\narm = true\ntimeout_s = 2\n\
             [runtime]\nstate_dir = \"{}\"\n",
            state("auv")
        ),
    );
    let asv = file(
        "asv.toml",
        format!(
            "[modem]\nlisten = \"127.0.0.1:{modem}\"\n[link]\nmax_idle_s = 1\n[console]\nlisten = \"127.0.0.1:{page}\"\n\
             [runtime]\nstate_dir = \"{}\"\n",
            state("asv")
        ),
    );
    let _asv = Process::start(&["asv", "--config", &asv]);
    let log = dir.join("auv.log");
    let _auv = Process::start_logged(&["auv", "--config", &auv], &log);
    // A ground station is heard before the autopilot, and beside it.
    let station = std::net::UdpSocket::bind("127.0.0.1:0").unwrap();
    let heartbeat = || station.send_to(&GROUND_STATION, ("127.0.0.1", mavlink)).is_ok();
    let mut heartbeats = 0;
    wait_until("a ground station has sent heartbeats", || {
        heartbeats += u32::from(heartbeat());
        heartbeats > 20 && std::fs::read_to_string(&log).is_ok_and(|log| log.contains("autopilot: "))
    });
    let mut peer = Peer::start(&python, mavlink, 3.0);
    let status = || {
        let (_, body) = http(page, "GET", "/api/v2/state", "", "")?;
        Some(serde_json::from_slice::<Value>(&body).ok()?["vehicles"][0]["status"].clone())
    };
    wait_until("the survey is flown", || heartbeat() && peer.number("targets") > 5.0 && peer.number("east") > 10.0);
    wait_until("the operator sees it move", || {
        status().is_some_and(|s| s["x_m"].as_f64() > Some(8.0) && s["autopilot_silent"] == false)
    });
    assert_eq!(peer.seen()["targets_refused"].as_u64(), Some(0), "{}", peer.seen());
    peer.order("silent");
    wait_until("the operator sees that it is silent", || status().is_some_and(|s| s["autopilot_silent"] == true));
    let at = status().unwrap()["at_s"].as_f64();
    wait_until("the link goes on", || status().is_some_and(|s| s["at_s"].as_f64() > at));
    peer.order("speak");
    wait_until("it is back", || status().is_some_and(|s| s["autopilot_silent"] == false));
    let is_logged = |text: &str| std::fs::read_to_string(&log).is_ok_and(|log| log.contains(text));
    // A vehicle that refuses only what corrects its place after the silence would stop beside its waypoint, as if it had followed.
    let targets = peer.number("targets");
    wait_until("it flies on", || heartbeat() && peer.number("targets") > targets + 3.0);
    peer.order("refuse");
    wait_until("a refused waypoint is logged", || {
        is_logged("the autopilot does not follow the waypoint: it reports") && is_logged("autopilot: not in command;")
    });
    let refuses = |is_expected: bool| {
        let faults = status().and_then(|s| s["faults"].as_array().cloned()).unwrap_or_default();
        let is_named = |fault: &Value| fault["text"] == "the autopilot does not follow" && fault["is_grave"] == true;
        faults.iter().any(is_named) == is_expected
    };
    wait_until("the operator sees that the autopilot does not follow", || refuses(true));
    peer.order("accept");
    wait_until("the operator sees that it follows again", || refuses(false));
    wait_until("its end is logged", || is_logged("the autopilot follows the waypoint again"));
    let seen = peer.seen();
    assert_eq!(seen["bad"].as_u64(), Some(0), "{seen}");
}
