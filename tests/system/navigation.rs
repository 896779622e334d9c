//! A vehicle without a camera, whose pose is that of a Doppler velocity log, as processes.

use scenecast_tests::{Process, free_port, http, scratch, wait_until};
use serde_json::Value;
use std::io::Write;
use std::net::TcpListener;
use std::time::Duration;

/// A position report of the log: ahead and to starboard since its reset, metres, and its yaw in degrees.
fn position(ts_s: f64, x: f64, y: f64, yaw: f64) -> String {
    format!(
        "{{\"ts\":{ts_s:.3},\"x\":{x},\"y\":{y},\"z\":4,\"std\":0.01,\"roll\":0,\"pitch\":0,\"yaw\":{yaw},\
         \"type\":\"position_local\",\"status\":0,\"format\":\"json_v3.1\"}}\r\n"
    )
}

/// A log that goes ahead at half a metre a second: it is reset at 10 m, and its connection ends at 5 m and at 15 m.
fn log(listener: &TcpListener) {
    let (mut x, mut ts_s, mut is_reset) = (0.0, 1000.0, false);
    let mut way_m: f64 = 0.0;
    loop {
        let Ok((mut stream, _)) = listener.accept() else { return };
        let _ = stream.write_all(b"half a line that is no report");
        let _ =
            stream.write_all(b"\r\n{\"type\":\"velocity\",\"altitude\":3,\"velocity_valid\":false,\"status\":0}\r\n");
        let ends_at = if way_m < 5.0 {
            5.0
        } else if way_m < 15.0 {
            15.0
        } else {
            f64::INFINITY
        };
        while way_m < ends_at {
            if !is_reset && way_m >= 10.0 {
                (is_reset, x) = (true, 0.0);
            }
            if stream.write_all(position(ts_s, x, 0.0, 0.0).as_bytes()).is_err() {
                return;
            }
            if way_m < 20.0 {
                (x, way_m) = (x + 0.1, way_m + 0.1);
            }
            ts_s += 0.05;
            std::thread::sleep(Duration::from_millis(50));
        }
    }
}

#[test]
fn a_velocity_log_moves_a_vehicle_without_a_camera() {
    let dir = scratch("dvl");
    let [modem, page] = [(); 2].map(|()| free_port());
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || log(&listener));
    let empty = dir.join("empty.toml");
    std::fs::write(&empty, "").unwrap();
    let state = |who: &str| format!("runtime.state_dir={}", dir.join(who).display());
    let start = |role: &str, log: &str, sets: &[String]| {
        let arguments = [role, "--config", empty.to_str().unwrap()];
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        Process::start_logged(&arguments.into_iter().chain(sets).collect::<Vec<_>>(), &dir.join(log))
    };
    let surface = [
        state("asv"),
        format!("modem.listen=127.0.0.1:{modem}"),
        format!("console.listen=127.0.0.1:{page}"),
        "link.max_idle_s=1".to_owned(),
    ];
    let vehicle = [
        state("auv"),
        format!("modem.connect=127.0.0.1:{modem}"),
        "survey.area_m=[-30, -30, 30, 30]".to_owned(),
        "link.status_period_s=1".to_owned(),
        format!("navigation.source=dvl:{address}"),
        "navigation.dvl_heading_deg=90".to_owned(),
    ];
    let _processes = [start("asv", "asv.log", &surface), start("auv", "auv.log", &vehicle)];
    let place = || {
        let (_, body) = http(page, "GET", "/api/v2/state", "", "")?;
        let status = serde_json::from_slice::<Value>(&body).ok()?["vehicles"][0]["status"].clone();
        Some((status["x_m"].as_f64()?, status["y_m"].as_f64()?))
    };
    let mut seen: Vec<(f64, f64)> = Vec::new();
    wait_until("the vehicle is 20 m to the east", || {
        seen.extend(place().filter(|now| seen.last() != Some(now)));
        seen.last().is_some_and(|(x, y)| (x - 20.0).abs() < 0.7 && y.abs() < 0.7)
    });
    assert!(seen.len() > 4 && seen.windows(2).all(|pair| pair[1].0 >= pair[0].0), "it never jumps: {seen:?}");
    let log = std::fs::read_to_string(dir.join("auv.log")).unwrap();
    for line in [
        "navigation: open",
        "navigation: unreadable message about the pose (1 so far): a line is not an object of JSON",
        "navigation: no bottom lock (1 so far)",
        "navigation: dead reckoning began anew (1 so far): it jumped by 10.",
        "closed the connection",
    ] {
        assert!(log.contains(line), "{line:?} is missing in {log}");
    }
}
