//! The two ends as processes in ROS 2, with peers that nobody here wrote: Cyclone DDS and Fast DDS on the loopback network, without
//! multicast.

use scenecast_config::Ros2;
use scenecast_ros2::{RosNode, topic};
use scenecast_tests::{
    Process, dds_domain, free_port, http, is_full, python, recorded, scratch, skip, state, wait_until, workspace,
};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

/// The peer of Fast DDS, compiled; without its library the test is skipped, which CI takes for a failure.
fn fast_dds() -> Option<String> {
    static PROGRAM: OnceLock<Option<String>> = OnceLock::new();
    PROGRAM.get_or_init(compile_fast_dds).clone()
}

fn compile_fast_dds() -> Option<String> {
    let program = scratch("fast-dds").join("peer").display().to_string();
    let source = workspace().join("tests/fast_dds_peer.cpp");
    let options = ["-O1", "-std=c++17", "-lfastrtps", "-lfastcdr", "-o", &program];
    let compiled = Command::new("g++").arg(source).args(options).output();
    let error = match &compiled {
        Ok(output) if output.status.success() => return Some(program),
        Ok(output) => String::from_utf8_lossy(&output.stderr).into_owned(),
        Err(error) => error.to_string(),
    };
    skip(&format!("no Fast DDS (Debian packages g++ and libfastrtps-dev): {error}"));
    None
}

/// A program that speaks to the ends: a Python, a script, and the arguments before those of the command.
#[derive(Clone)]
struct Speaker {
    python: String,
    script: &'static str,
    program: Option<String>,
}

impl Speaker {
    fn cyclone() -> Option<Self> {
        Some(Self { python: python("cyclonedds.domain")?, script: "tests/ros2_peer.py", program: None })
    }

    fn fast_dds() -> Option<Self> {
        Some(Self {
            python: python("cyclonedds.domain")?,
            script: "tests/fast_dds_peer.py",
            program: Some(fast_dds()?),
        })
    }
}

fn start(speaker: &Speaker, arguments: &[&str]) -> Child {
    let mut command = Command::new(&speaker.python);
    command.arg(workspace().join(speaker.script)).args(&speaker.program).args(arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("python starts")
}

fn result(peer: Child) -> Value {
    let output = peer.wait_with_output().expect("python ends");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stdout)))
}

fn peer(speaker: &Speaker, arguments: &[&str]) -> Value {
    result(start(speaker, arguments))
}

/// Both ends over TCP, with the page on `page`.
struct Ends {
    _surface: Process,
    _vehicle: Process,
}

fn ends(dir: &Path, page: u16, domain: u8) -> Ends {
    ends_with(dir, page, domain, true)
}

fn ends_with(dir: &Path, page: u16, domain: u8, is_in_ros: bool) -> Ends {
    let (recording, link) = (&recorded().0, free_port());
    let common = |who: &str, rest: &str| {
        let state = dir.join(who).display().to_string();
        let text = format!(
            "[mission]\norigin_deg = [29.5, 34.9]\n[runtime]\ntime_scale = 10\nstate_dir = \"{state}\"\n[ros2]\n\
             enabled = {is_in_ros}\ndomain = {domain}\nnetworks = [\"127.0.0.1\"]\n{rest}"
        );
        let file = dir.join(format!("{who}.toml"));
        std::fs::write(&file, text).unwrap();
        file.display().to_string()
    };
    let surface = common(
        "asv",
        &format!(
            "principal = \"ros\"\n[console]\nlisten = \"127.0.0.1:{page}\"\n[modem]\nlisten = \"127.0.0.1:{link}\"\n"
        ),
    );
    let vehicle = common(
        "auv",
        &format!(
            "[survey]\nstart = \"free\"\n[modem]\nconnect = \"127.0.0.1:{link}\"\n[camera]\nsource = \"frames:{}\"\n",
            recording.display()
        ),
    );
    Ends {
        _surface: Process::start(&["asv", "--config", &surface]),
        _vehicle: Process::start(&["auv", "--config", &vehicle]),
    }
}

/// The labels of the page's map, row by row from the south; 0 = unexplored.
fn page_map(page: u16) -> Option<(u64, u64, Vec<u8>)> {
    let (status, body) = http(page, "GET", "/api/v2/vehicles/1/map", "", "")?;
    let map: Value = serde_json::from_slice(&body).ok().filter(|_| status == 200)?;
    Some((map["width"].as_u64()?, map["height"].as_u64()?, base64(map["labels"].as_str()?)))
}

fn base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let bits = |c: u8| DIGITS.iter().position(|&d| d == c).unwrap_or(0) as u32;
    let padding = text.bytes().filter(|&c| c == b'=').count();
    let mut bytes: Vec<u8> = text
        .as_bytes()
        .chunks(4)
        .flat_map(|four| four.iter().fold(0, |sum, &c| sum << 6 | bits(c)).to_be_bytes()[1..].to_vec())
        .collect();
    bytes.truncate(bytes.len() - padding);
    bytes
}

fn explored(page: u16) -> u64 {
    state(page).and_then(|state| state["vehicles"][0]["map"]["explored_cells"].as_u64()).unwrap_or(0)
}

#[test]
fn late_subscribers_have_both_maps() {
    let (Some(cyclone), Some(fast)) = (Speaker::cyclone(), Speaker::fast_dds()) else { return };
    let (dir, page, domain) = (scratch("ros2-map"), free_port(), dds_domain());
    let _ends = ends(&dir, page, domain);
    wait_until("the survey ends", || {
        let found = state(page);
        let mode = found.as_ref().map(|state| &state["vehicles"][0]["status"]["mode"]);
        mode.is_some_and(|mode| mode == "done" || mode == "hold") && explored(page) > 100
    });
    let domain = domain.to_string();
    for (name, speaker) in [("Cyclone DDS", cyclone), ("Fast DDS", fast)] {
        assert_late_maps(name, &speaker, page, &domain);
    }
}

fn assert_late_maps(name: &str, speaker: &Speaker, page: u16, domain: &str) {
    let map = peer(speaker, &["map", domain, "/scenecast/auv_1/map", "20"]);
    let values =
        |map: &Value| -> Vec<i64> { map["data"].as_array().unwrap().iter().filter_map(Value::as_i64).collect() };
    let (width, height, labels) = page_map(page).unwrap();
    assert_eq!((map["width"].as_u64(), map["height"].as_u64()), (Some(width), Some(height)));
    let expected: Vec<i64> = labels.iter().map(|&l| if l == 0 { -1 } else { i64::from(l) }).collect();
    assert_eq!(values(&map), expected, "the map of ROS 2 is that of the page");
    assert_eq!(map["frame"], "map");
    let own = peer(speaker, &["map", domain, "/scenecast/map", "20"]);
    assert_eq!(own["frame"], "odom", "the vehicle's own map is in its map frame");
    for (end, map) in [("surface", &map), ("vehicle", &own)] {
        let seconds = map["seconds"].as_f64().unwrap();
        println!("{name}, {end}: the map was there after {seconds} s");
        assert!(seconds < 2.0 || !is_full(), "{name}, {end}: {seconds} s");
    }
}

#[test]
fn every_topic_of_the_surface_reaches_cyclone() {
    let Some(cyclone) = Speaker::cyclone() else { return };
    let (dir, page, domain) = (scratch("ros2-all"), free_port(), dds_domain());
    let _ends = ends(&dir, page, domain);
    let all = peer(&cyclone, &["all", &domain.to_string(), "/scenecast/auv_1", "120"]);
    println!("{all}");
    let number = |value: &Value| value.as_u64().unwrap();
    let cells = number(&all["map"][0]) * number(&all["map"][1]);
    assert!(cells > 0 && all["layers"][0] == "label");
    assert!(all["matrices"].as_array().unwrap().iter().all(|m| m.as_u64() > Some(0)));
    assert_eq!(number(&all["points"]) * 20, number(&all["point_bytes"]));
    assert_eq!((&all["jpeg"], &all["format"]), (&Value::from("ffd8ff"), &Value::from("jpeg")));
    assert!(all["exemplar"].as_str().unwrap().starts_with("label_"));
    assert!(number(&all["path"]) > 0 && all["frame"] == "map");
    let fix = [0, 1].map(|i| all["fix"][i].as_f64().unwrap());
    assert!((fix[0] - 29.5).abs() < 0.01 && (fix[1] - 34.9).abs() < 0.01, "{fix:?}");
    assert_eq!(all["no_altitude"], true);
    let [into, joins] = [0, 1].map(|part| all["tree"][part].as_array().unwrap());
    assert!(!joins.is_empty() && into.len() == joins.len() && into.iter().all(|label| number(label) > 0), "{all}");
    let parts: Vec<&str> = all["parts"].as_array().unwrap().iter().filter_map(Value::as_str).collect();
    assert!(parts.len() == 5 && parts[4].ends_with("ros2"), "{parts:?}");
    assert!(all["age_s"].as_f64().unwrap() < 30.0);
}

/// When no part of an image has come in for so long, none is on its way.
const IMAGES_PAUSE: Duration = Duration::from_secs(4);

/// Bytes that a surface has received of its vehicle, once the survey is over and everything is acknowledged.
fn bytes_of_the_survey(page: u16) -> u64 {
    let mut images = (0, Instant::now());
    wait_until("everything is received", || {
        let all = state(page).unwrap_or_default();
        let bytes = all["link"]["up"]["bytes_by_class"]["exemplar"].as_u64().unwrap_or_default();
        if images.0 != bytes {
            images = (bytes, Instant::now());
        }
        let found = &all["vehicles"][0];
        let is_over = found["status"]["mode"] == "done" || found["status"]["mode"] == "hold";
        // Further images follow each other without a pause.
        is_over && found["link"]["backlog"]["bits"] == 0 && explored(page) > 100 && images.1.elapsed() > IMAGES_PAUSE
    });
    let classes = state(page).unwrap()["link"]["up"]["bytes_by_class"].clone();
    println!("{classes}");
    classes.as_object().unwrap().values().filter_map(Value::as_u64).sum()
}

#[test]
fn ros_and_its_subscribers_do_not_change_the_link() {
    let Some(cyclone) = Speaker::cyclone() else { return };
    let pairs = [("ros2-off", false), ("ros2-alone", true), ("ros2-read", true)];
    let pairs = pairs.map(|(name, is_in_ros)| (scratch(name), free_port(), is_in_ros));
    let domains = [dds_domain(), dds_domain(), dds_domain()];
    let start_ends =
        |((dir, page, is_in_ros), domain): (&(PathBuf, u16, bool), u8)| ends_with(dir, *page, domain, *is_in_ros);
    let _ends: Vec<_> = pairs.iter().zip(domains).map(start_ends).collect();
    let reader = start(&cyclone, &["all", &domains[2].to_string(), "/scenecast/auv_1", "120"]);
    let bytes: Vec<u64> = pairs.iter().map(|(_, page, _)| bytes_of_the_survey(*page)).collect();
    assert!(result(reader)["points"].as_u64() > Some(0), "the subscriber has read the map");
    println!("bytes received without ROS 2, without a subscriber, with one: {bytes:?}");
    // The ends follow the clock, so that a busy machine shifts images from one frame to another.
    let limit = if is_full() { 0.1 } else { 0.5 };
    let spread = |other: u64| (other as f64 / bytes[0] as f64 - 1.0).abs();
    assert!(spread(bytes[1]) < limit && spread(bytes[2]) < limit, "{bytes:?}");
}

#[test]
fn an_order_of_cyclone_passes_the_surfaces_checks() {
    let Some(cyclone) = Speaker::cyclone() else { return };
    let (dir, page, domain) = (scratch("ros2-orders"), free_port(), dds_domain());
    let _ends = ends(&dir, page, domain);
    wait_until("the vehicle is met", || explored(page) > 0);
    let domain = domain.to_string();
    let hold = |arguments: &[&str]| {
        let event = peer(&cyclone, &[&["hold", &domain, "/scenecast/auv_1", "30"], arguments].concat());
        assert_eq!(event["vehicle"], "auv-1");
        (event["level"].as_u64().unwrap(), event["text"].as_str().unwrap().to_owned())
    };
    let (level, text) = hold(&["true"]);
    assert!(level == 20 && text.starts_with("hold of ros: accepted as hold"), "{text}");
    wait_until("the vehicle applies it", || {
        let slots = state(page).map(|state| state["vehicles"][0]["directive"]["slots"].clone());
        let slots = slots.as_ref().and_then(Value::as_array).cloned().unwrap_or_default();
        slots.iter().any(|slot| slot["slot"] == "constraints" && slot["state"] == "applied")
    });
    let headers = "X-Scenecast: 1\r\nContent-Type: application/json\r\n";
    let (status, _) = http(page, "POST", "/api/v2/command", headers, "{\"action\": \"take\"}").unwrap();
    assert_eq!(status, 200, "the page takes command");
    let (level, text) = hold(&["false"]);
    assert!(level == 30 && text.contains("refused") && text.contains("local has had command"), "{text}");
    let (level, text) = hold(&["true", "100"]);
    assert!(level == 30 && text.contains("its stamp is 100 s old"), "{text}");
}

#[test]
fn images_of_cyclone_dds_arrive_whole_and_in_order() {
    Speaker::cyclone().iter().for_each(|speaker| assert_images_arrive(speaker, dds_domain()));
}

#[test]
fn images_of_fast_dds_arrive_whole_and_in_order() {
    Speaker::fast_dds().iter().for_each(|speaker| assert_images_arrive(speaker, dds_domain()));
}

fn assert_images_arrive(speaker: &Speaker, domain: u8) {
    let networks = vec!["127.0.0.1".parse().unwrap()];
    let node = RosNode::start(&Ros2 { domain, networks, ..Ros2::default() }, "camera_test").unwrap();
    let name = |text: &str| topic(text).unwrap();
    let images = node.subscribe_images(&name("/camera/image_raw")).unwrap();
    let infos = node.subscribe_camera_info(&name("/camera/camera_info")).unwrap();
    let odometry = node.subscribe_odometry(&name("/odometry")).unwrap();
    // SCENECAST_ROS2_IMAGES=200 is the long run: 1360 x 1024 pixels at 2 Hz, of which each must arrive. Best effort may lose
    // images of 4 MB on a busy machine, so the short run publishes more than it takes.
    let long: Option<u64> = std::env::var("SCENECAST_ROS2_IMAGES").ok().map(|count| count.parse().unwrap());
    let (count, published, hertz) = long.map_or((6, 100, "4"), |count| (count, count, "2"));
    let arguments = ["camera", &domain.to_string(), "/camera/image_raw", &published.to_string(), hertz, "1360", "1024"];
    let mut camera = start(speaker, &arguments);
    let row: Vec<u8> = (0..1360 * 3).map(|i: u32| (i % 251) as u8).collect();
    let limit = Instant::now() + scenecast_tests::GIVEN_UP;
    let (mut taken, mut last) = (0, 0);
    assert!(images.wait(limit.saturating_duration_since(Instant::now())), "no image");
    assert!(node.peers().publishers.contains(&("/odometry".to_owned(), "nav_msgs/msg/Odometry".to_owned())));
    while taken < count && images.wait(limit.saturating_duration_since(Instant::now())) {
        let image = images.take().unwrap().message;
        assert_eq!((image.width, image.height, image.encoding.as_str()), (1360, 1024, "rgb8"));
        assert!(image.data.len() == 1360 * 1024 * 3 && image.data.chunks(row.len()).all(|r| r == row), "torn");
        let stamp = image.header.stamp.nanos();
        assert!(stamp > last, "out of order");
        (taken, last) = (taken + 1, stamp);
    }
    if long.is_none() {
        camera.kill().unwrap();
    }
    let output = camera.wait_with_output().unwrap();
    assert!(output.status.success() == long.is_some(), "{}", String::from_utf8_lossy(&output.stderr));
    println!("{taken} of {count} images, {} calibrations, {} odometry", infos.received(), odometry.received());
    assert_eq!((taken, images.dropped(), images.malformed()), (count, 0, 0));
    assert_eq!(infos.take().unwrap().message.k[0], 800.0);
    assert!(odometry.received() >= (count - 1) * 9, "{} of {}", odometry.received(), count * 10);
}
