//! The two ends as processes, over TCP and over real serial devices.

use scenecast_tests::{Process, free_port, http, recorded, run, scratch, wait_until};
use serialport::{SerialPort, TTYPort};
use std::io::{Read, Write};
use std::path::Path;
use std::time::Duration;

/// Both ends' arguments over a link; the map must become the one that `sim` makes.
fn assert_map_arrives(name: &str, vehicle_link: &[String], surface_link: &[String]) {
    let (recording, expected) = recorded();
    let dir = scratch(name);
    let port = free_port();
    let path = |p: &Path| p.display().to_string();
    let vehicle_file = dir.join("auv.toml");
    let surface_file = dir.join("asv.toml");
    std::fs::write(&vehicle_file, format!("[camera]\nsource = \"frames:{}\"\n", path(recording))).unwrap();
    std::fs::write(&surface_file, format!("[console]\nlisten = \"127.0.0.1:{port}\"\n")).unwrap();
    let arguments = |command: &str, file: &Path, state: &str, link: &[String]| {
        let common = [format!("runtime.state_dir=\"{}\"", path(&dir.join(state))), "runtime.time_scale=20".to_owned()];
        let sets = common.into_iter().chain(link.iter().cloned()).flat_map(|s| ["--set".to_owned(), s]);
        [command.to_owned(), "--config".to_owned(), path(file)].into_iter().chain(sets).collect::<Vec<String>>()
    };
    let surface = arguments("asv", &surface_file, "asv", surface_link);
    let vehicle = arguments("auv", &vehicle_file, "auv", vehicle_link);
    let borrowed = |a: &[String]| Process::start(&a.iter().map(String::as_str).collect::<Vec<_>>());
    let _surface = borrowed(&surface);
    let _vehicle = borrowed(&vehicle);
    let map = dir.join("asv/operator-map-1.png");
    wait_until("the operator's map equals the one of the rehearsal", || {
        std::fs::read(&map).is_ok_and(|png| png == *expected)
    });
    let (status, page) = http(port, "GET", "/api/v2/vehicles/1/map.png", "", "").unwrap();
    assert_eq!((status, page), (200, expected.clone()), "the page has the same map");
}

#[test]
fn a_map_arrives_over_tcp_and_equals_the_one_of_the_rehearsal() {
    let port = free_port();
    assert_map_arrives(
        "tcp",
        &[format!("modem.connect=127.0.0.1:{port}")],
        &[format!("modem.listen=127.0.0.1:{port}")],
    );
}

#[test]
fn a_map_arrives_over_udp_where_the_surface_listens() {
    let port = free_port();
    let link = |end: &str| vec!["modem.kind=udp".to_owned(), format!("modem.{end}=127.0.0.1:{port}")];
    assert_map_arrives("udp", &link("connect"), &link("listen"));
}

/// Joins two pseudo-terminals like a null modem, garbling the stream in between at first.
fn null_modem() -> (String, String, [TTYPort; 2]) {
    let (a, a_end) = TTYPort::pair().unwrap();
    let (b, b_end) = TTYPort::pair().unwrap();
    let names = (a_end.name().unwrap(), b_end.name().unwrap());
    for (mut from, mut to) in [(a.try_clone_native().unwrap(), b.try_clone_native().unwrap()), (b, a)] {
        from.set_timeout(Duration::from_millis(200)).unwrap();
        std::thread::spawn(move || {
            let _ = to.write_all(b"\x00+garbage++\xff");
            let mut buffer = [0; 512];
            loop {
                match from.read(&mut buffer) {
                    Ok(0) => return,
                    Ok(n) => {
                        if to.write_all(&buffer[..n]).is_err() {
                            return;
                        }
                    }
                    Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {}
                    Err(_) => return,
                }
            }
        });
    }
    (names.0, names.1, [a_end, b_end])
}

#[test]
fn a_map_over_serial_devices_equals_the_rehearsals() {
    let (a, b, _held) = null_modem();
    let link = |device: String| {
        vec!["modem.kind=transparent".to_owned(), format!("modem.device={device}"), "modem.baud=115200".to_owned()]
    };
    assert_map_arrives("serial", &link(a), &link(b));
}

#[test]
fn a_vehicle_that_is_killed_and_restarted_is_received_again() {
    let (recording, expected) = recorded();
    let dir = scratch("killed");
    let port = free_port();
    let file = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let common = "[runtime]\ntime_scale = 20\n";
    let state = |who: &str| format!("state_dir = \"{}\"\n", dir.join(who).display());
    let source = recording.display();
    let vehicle_file = file(
        "auv.toml",
        format!(
            "{common}{}[modem]\nconnect = \"127.0.0.1:{port}\"\n[camera]\nsource = \"frames:{source}\"\n",
            state("auv")
        ),
    );
    let surface_file = file(
        "asv.toml",
        format!("{common}{}[modem]\nlisten = \"127.0.0.1:{port}\"\n[console]\nlisten = \"\"\n", state("asv")),
    );
    let _surface = Process::start(&["asv", "--config", &surface_file]);
    let mut vehicle = Process::start(&["auv", "--config", &vehicle_file]);
    let map = dir.join("asv/operator-map-1.png");
    wait_until("a first map", || map.exists());
    vehicle.kill();
    let _again = Process::start(&["auv", "--config", &vehicle_file]);
    wait_until("the map of the second run", || std::fs::read(&map).is_ok_and(|png| png == *expected));
}

#[test]
fn a_killed_vehicle_resumes_from_its_checkpoint() {
    let (recording, expected) = recorded();
    let dir = scratch("checkpoint");
    let (port, page) = (free_port(), free_port());
    let file = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let state = |who: &str| format!("[runtime]\ntime_scale = 10\nstate_dir = \"{}\"\n", dir.join(who).display());
    let link = |key: &str| format!("[modem]\n{key} = \"127.0.0.1:{port}\"\n");
    let camera = format!("[camera]\nsource = \"frames:{}\"\n", recording.display());
    let vehicle =
        file("auv.toml", [state("auv"), link("connect"), camera, "[scene]\ncheckpoint_s = 1\n".into()].concat());
    let console = format!("[console]\nlisten = \"127.0.0.1:{page}\"\n");
    let surface = file("asv.toml", [state("asv"), link("listen"), console].concat());
    let _surface = Process::start(&["asv", "--config", &surface]);
    let checkpoint = dir.join("auv/scene.checkpoint");
    let kept = || std::fs::read(&checkpoint).unwrap_or_default();
    for kill in 0..4 {
        let before = kept();
        let mut process = Process::start(&["auv", "--config", &vehicle]);
        wait_until("a further checkpoint", || kept() != before);
        std::thread::sleep(Duration::from_millis(70 * kill));
        process.kill();
    }
    let arrived = || std::fs::read(dir.join("asv/operator-map-1.png")).is_ok_and(|png| png == *expected);
    let epoch = || {
        let (_, body) = http(page, "GET", "/api/v2/state", "", "")?;
        let state: serde_json::Value = serde_json::from_slice(&body).ok()?;
        state["vehicles"][0]["map"]["epoch"].as_u64()
    };
    let mut last = Process::start(&["auv", "--config", &vehicle]);
    wait_until("the map of a run that was never killed", arrived);
    assert_eq!(epoch(), Some(0), "the labels have gone on in their epoch");
    last.kill();
    let whole = kept();
    std::fs::write(&checkpoint, &whole[..whole.len() / 2]).unwrap();
    let _anew = Process::start(&["auv", "--config", &vehicle]);
    wait_until("labels in a new epoch", || epoch().is_some_and(|epoch| epoch > 0));
    wait_until("the map learnt anew", arrived);
}

#[test]
fn settings_survive_a_restart_of_the_vehicle() {
    let (recording, _) = recorded();
    let dir = scratch("settings");
    let (port, page) = (free_port(), free_port());
    let file = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    };
    let state = |who: &str| format!("[runtime]\ntime_scale = 4\nstate_dir = \"{}\"\n", dir.join(who).display());
    let link = |key: &str| format!("[modem]\n{key} = \"127.0.0.1:{port}\"\n");
    let camera = format!("[camera]\nsource = \"frames:{}\"\n[scene]\ncheckpoint_s = 1\n", recording.display());
    let vehicle = file("auv.toml", [state("auv"), link("connect"), camera].concat());
    let console = format!("[console]\nlisten = \"127.0.0.1:{page}\"\n");
    let surface = file("asv.toml", [state("asv"), link("listen"), console].concat());
    let _surface = Process::start(&["asv", "--config", &surface]);
    let told = || {
        let (_, body) = http(page, "GET", "/api/v2/state", "", "")?;
        let state: serde_json::Value = serde_json::from_slice(&body).ok()?;
        Some(state["vehicles"][0].clone())
    };
    let checkpoint = dir.join("auv/scene.checkpoint");
    let kept = || std::fs::read(&checkpoint).unwrap_or_default();
    let mut first = Process::start(&["auv", "--config", &vehicle]);
    wait_until("a label on the map", || told().is_some_and(|v| v["labels"].as_array().is_some_and(|l| !l.is_empty())));
    let headers = "Content-Type: application/json\r\nX-Scenecast: 1\r\n";
    let order = r#"{"gamma": 0.2, "alpha": 0.5}"#;
    assert_eq!(http(page, "POST", "/api/v2/vehicles/1/settings", headers, order).unwrap().0, 202);
    wait_until("settings in force", || told().is_some_and(|v| v["settings"]["in_force"]["gamma"] == 0.2));
    let before = kept();
    wait_until("a checkpoint with them", || kept() != before);
    first.kill();
    let before = kept();
    let _again = Process::start(&["auv", "--config", &vehicle]);
    wait_until("a checkpoint of the next run", || kept() != before);
    wait_until("the vehicle is heard again", || told().is_some_and(|v| v["map"]["explored_cells"].as_u64() > Some(0)));
    let vehicle = told().unwrap();
    assert_eq!(vehicle["map"]["epoch"], 0, "labels continue: the checkpoint was not skipped");
    assert_eq!(vehicle["settings"]["in_force"]["alpha"], 0.5);
}

/// What speaks at a pseudo-terminal instead of the configured modem: every half second this, and that after a question of a modem.
struct Stranger {
    said: &'static [u8],
    answer: &'static [u8],
    /// Whether it sends back what it gets.
    echoes: bool,
    /// The only speed at which it understands and is understood, bit/s.
    speed: Option<u32>,
}

impl Stranger {
    /// Its device, as long as the pair lives.
    fn plug_in(self) -> (String, TTYPort) {
        let (mut port, end) = TTYPort::pair().unwrap();
        port.set_timeout(Duration::from_millis(100)).unwrap();
        let name = end.name().unwrap();
        std::thread::spawn(move || {
            let mut buffer = [0; 256];
            for tick in 0.. {
                if tick % 5 == 0 && port.write_all(self.said).is_err() {
                    return;
                }
                match port.read(&mut buffer) {
                    Ok(_) if self.speed.is_some_and(|speed| port.baud_rate().ok() != Some(speed)) => {}
                    Ok(n) => {
                        let back = if self.echoes { &buffer[..n] } else { self.answer };
                        let _ = port.write_all(back);
                    }
                    Err(e) if e.kind() == std::io::ErrorKind::TimedOut => {}
                    Err(_) => return,
                }
            }
        });
        (name, end)
    }
}

#[test]
fn what_is_wrong_at_the_port_of_a_modem_is_told() {
    let none = || Stranger { said: b"", answer: b"", echoes: false, speed: None };
    let says = |said: &'static [u8]| Stranger { said, ..none() };
    let answers = |answer: &'static [u8]| Stranger { answer, ..none() };
    let dir = scratch("doctor");
    let file = dir.join("asv.toml");
    std::fs::write(&file, "[modem]\nkind = \"s2c\"\n").unwrap();
    let look = |kind: &str, device: &str| {
        let (kind, device) = (format!("modem.kind={kind}"), format!("modem.device={device}"));
        let asked = run(&["doctor", "modem", "--config", file.to_str().unwrap(), "--set", &kind, "--set", &device]);
        (asked.status.code(), String::from_utf8_lossy(&asked.stderr).into_owned())
    };
    let check = |kind: &'static str, stranger: Stranger, words: &'static [&'static str]| {
        let (device, _held) = stranger.plug_in();
        let (code, line) = look(kind, &device);
        assert!(code == Some(1) && words.iter().all(|word| line.contains(word)), "{kind} {words:?}: {line}");
    };
    std::thread::scope(|scope| {
        scope.spawn(|| check("s2c", none(), &["nothing comes in", "no modem answers at other speeds"]));
        scope.spawn(|| check("s2c", says(&[0xF8, 0, 0xE0, 0x80]), &["no text", "modem.baud"]));
        scope.spawn(|| check("s2c", says(b"$GPGGA,120000,,,,,0,,,,,,,,*56\r\n"), &["satellite positions", "swapped"]));
        scope.spawn(|| check("micromodem", says(b"$GPGGA,120000,,,,,0,,,,,,,,*56\r\n"), &["satellite positions"]));
        scope.spawn(|| {
            check("s2c", answers(b"$CAERR,120000,NMEA,1*00\r\n"), &["WHOI Micromodem", "modem.kind = \"micromodem\""])
        });
        scope.spawn(|| {
            check("micromodem", answers(b"ERROR WRONG COMMAND\r\n"), &["EvoLogics S2C", "modem.kind = \"s2c\""])
        });
        scope.spawn(|| check("s2c", says(b"\r\nasv login:\r\n"), &["console"]));
        scope.spawn(|| check("s2c", Stranger { echoes: true, ..none() }, &["comes back"]));
        let slower = Stranger { speed: Some(9600), ..answers(b"$CACFG,SRC,7*0B\r\n") };
        scope.spawn(|| check("micromodem", slower, &["WHOI Micromodem answers at 9600", "modem.baud = 9600"]));
    });
    let (code, line) = look("s2c", "/dev/null");
    assert!(code == Some(2) && line.contains("is no serial device"), "{line}");
    let (code, line) = look("s2c", "/dev/ttyNowhere");
    assert!(code == Some(2) && line.contains("No such file") && line.contains("serial device"), "{line}");
}

#[test]
fn a_running_surface_tells_what_is_wrong_at_its_modem() {
    let (dir, page) = (scratch("wrong-modem"), free_port());
    let device = dir.join("modem");
    let file = dir.join("asv.toml");
    let text = format!(
        "[modem]\nkind = \"s2c\"\ndevice = \"{}\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n[runtime]\nstate_dir = \"{}\"\n",
        device.display(),
        dir.join("asv").display()
    );
    std::fs::write(&file, text).unwrap();
    let log = dir.join("asv.log");
    let _surface = Process::start_logged(&["asv", "--config", file.to_str().unwrap()], &log);
    let logged = |words: &str| std::fs::read_to_string(&log).is_ok_and(|text| text.contains(words));
    wait_until("a device that is not there is waited for", || logged("opened again when it is available"));
    let gnss = Stranger { said: b"$GPGGA,120000,,,,,0,,,,,,,,*56\r\n", answer: b"", echoes: false, speed: None };
    let (there, _held) = gnss.plug_in();
    std::os::unix::fs::symlink(there, &device).unwrap();
    wait_until("the wrong device is named", || logged("a receiver of satellite positions speaks at"));
    wait_until("the page says so", || {
        http(page, "GET", "/api/v2/log", "", "").is_some_and(|(_, body)| {
            String::from_utf8_lossy(&body).contains("the surface's modem: a receiver of satellite positions")
        })
    });
}
