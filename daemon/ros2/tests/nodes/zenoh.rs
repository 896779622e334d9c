//! Nodes that speak rmw_zenoh, with peers and a router that nobody here wrote: the Zenoh of PyPI with the messages of rosbags.

use scenecast_config::{Ros2, RosName, RosTransport, ZenohEndpoint};
use scenecast_messages::nav_msgs::{OccupancyGrid, Odometry};
use scenecast_ros2::{Peers, Publisher, Qos, RosNode, Transport, topic};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpListener;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const TIMEOUT: Duration = Duration::from_secs(30);
const IMAGES: &str = "/camera/image_raw";

/// A Python with Zenoh; without one the test is skipped, which CI takes for a failure.
fn python() -> Option<String> {
    let python = std::env::var("SCENECAST_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let output = Command::new(&python).args(["-c", "import zenoh.ext, rosbags.typesys, xxhash"]).output();
    if output.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    let line = format!("SKIPPED: {python} has no eclipse-zenoh (tests/python/requirements.txt; SCENECAST_PYTHON)\n");
    assert!(std::env::var_os("CI").is_none_or(|ci| ci != "true"), "{line}");
    // The harness hides the captured output of a test that passes.
    let _ = std::io::stderr().write_all(line.as_bytes());
    None
}

/// A process of the script, which ends with this.
struct Peer(Child);

impl Peer {
    fn start(python: &str, arguments: &[&str]) -> Self {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/python/zenoh_peer.py");
        let mut command = Command::new(python);
        command.arg(script).args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped());
        Self(command.spawn().expect("python starts"))
    }

    /// As [`Self::start`], once it says that it is ready.
    fn ready(python: &str, arguments: &[&str]) -> Self {
        let mut peer = Self::start(python, arguments);
        assert_eq!(peer.line(), "ready", "{arguments:?}");
        peer
    }

    /// Stops it without closing its connections.
    fn stop(&self) {
        let status = Command::new("kill").args(["-STOP", &self.0.id().to_string()]).status();
        assert!(status.is_ok_and(|status| status.success()));
    }

    /// Its next line; empty at its end.
    fn line(&mut self) -> String {
        let mut line = String::new();
        let stdout = self.0.stdout.as_mut().expect("it is piped");
        BufReader::new(stdout).read_line(&mut line).expect("text");
        line.trim_end().to_owned()
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A port of the loopback network for a router.
fn free_port() -> String {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port().to_string()
}

fn name(text: &str) -> RosName {
    topic(text).unwrap()
}

fn node(port: &str, transport: RosTransport) -> RosNode {
    let zenoh_router = ZenohEndpoint::parse(&format!("tcp/127.0.0.1:{port}")).unwrap();
    // A domain of this process, for DDS.
    let domain = (10 + std::process::id() % 90) as u8;
    let networks = vec!["127.0.0.1".parse().unwrap()];
    RosNode::start(&Ros2 { transport, zenoh_router, domain, networks, ..Ros2::default() }, "scenecast_test").unwrap()
}

fn domain() -> String {
    (10 + std::process::id() % 90).to_string()
}

/// Waits for a state that nothing announces.
fn wait_until(what: &str, is_true: impl Fn() -> bool) {
    let limit = Instant::now() + TIMEOUT;
    while !is_true() {
        assert!(Instant::now() < limit, "{what}: not within {TIMEOUT:?}");
        std::thread::park_timeout(Duration::from_millis(10));
    }
}

fn grid(width: u32, label: i8) -> OccupancyGrid {
    let mut grid = OccupancyGrid { data: vec![label; width as usize * 10], ..Default::default() };
    (grid.info.width, grid.info.height, grid.header.frame_id) = (width, 10, "map".to_owned());
    grid
}

/// What a new subscriber of PyPI has of our map. The publisher looks for subscribers, as the outlets do.
fn map_of_peer(python: &str, port: &str, hash: &str, publisher: &Publisher<OccupancyGrid>) -> serde_json::Value {
    let mut peer = Peer::start(python, &["map", port, &domain(), "/scenecast/map", hash, "20"]);
    wait_until("the subscriber is seen", || publisher.subscribers() == 1);
    let line = peer.line();
    drop(peer);
    wait_until("the subscriber has left", || publisher.subscribers() == 0);
    println!("{line}");
    serde_json::from_str(&line).unwrap_or_else(|_| panic!("no map: {line}"))
}

#[test]
fn a_late_zenoh_subscriber_has_the_newest_map() {
    let Some(python) = python() else { return };
    let port = free_port();
    let _router = Peer::ready(&python, &["router", &port]);
    let node = node(&port, RosTransport::Zenoh);
    let publisher = node.publisher::<OccupancyGrid>(&name("/scenecast/map"), Qos::Latched(1)).unwrap();
    assert!(publisher.publish(grid(30, 1)) && publisher.publish(grid(40, 2)));
    wait_until("the router is there", || node.health().values.contains(&("zenoh_router", "true".to_owned())));
    for (hash, sequence) in [("own", 2), ("humble", 1)] {
        let map = map_of_peer(&python, &port, hash, &publisher);
        assert_eq!((&map["width"], &map["frame"]), (&40.into(), &"map".into()), "{hash}");
        assert_eq!(map["labels"], serde_json::json!([0, 0, 0, 400]), "400 cells of label 2");
        assert_eq!((&map["attachment"], &map["gid_length"]), (&33.into(), &16.into()));
        assert_eq!((&map["sequence"], &map["gid_is_of_token"]), (&sequence.into(), &true.into()));
        assert!(map["age_s"].as_f64().unwrap() < 30.0);
    }
}

#[test]
fn images_and_poses_of_zenoh_arrive_whole_and_in_order() {
    let Some(python) = python() else { return };
    let port = free_port();
    let _router = Peer::ready(&python, &["router", &port]);
    let node = node(&port, RosTransport::Both);
    let images = node.subscribe_images(&name(IMAGES)).unwrap();
    let odometry = node.subscribe_odometry(&name("/odometry")).unwrap();
    // SCENECAST_ROS2_IMAGES=200 is the long run, at 2 Hz.
    let long = std::env::var("SCENECAST_ROS2_IMAGES").ok();
    let (count, hertz) = (long.as_deref().unwrap_or("6"), if long.is_some() { "2" } else { "4" });
    let arguments = ["camera", &port, &domain(), IMAGES, "own", count, hertz, "1360", "1024"];
    let mut camera = Peer::start(&python, &arguments);
    let count: u64 = count.parse().unwrap();
    let row: Vec<u8> = (0..1360 * 3).map(|i: u32| (i % 251) as u8).collect();
    let limit = Instant::now() + TIMEOUT + Duration::from_secs(count);
    let (mut taken, mut last) = (0, 0);
    while taken < count && images.wait(limit.saturating_duration_since(Instant::now())) {
        let image = images.take().unwrap().message;
        assert_eq!((image.width, image.height, image.encoding.as_str()), (1360, 1024, "rgb8"));
        assert!(image.data.len() == 1360 * 1024 * 3 && image.data.chunks(row.len()).all(|r| r == row), "torn");
        let stamp = image.header.stamp.nanos();
        assert!(stamp > last, "out of order");
        (taken, last) = (taken + 1, stamp);
        let peers = node.peers_by_transport();
        let published = (IMAGES.to_owned(), "sensor_msgs/msg/Image".to_owned());
        assert!(peers[1].0 == Transport::Zenoh && peers[1].1.publishers.contains(&published), "{peers:?}");
        assert_eq!((peers[0].0, &peers[0].1), (Transport::Dds, &Peers::default()), "only Zenoh sees the camera");
    }
    let message = node.health().message;
    assert_eq!(message, "peers: 0 on DDS, 1 on rmw_zenoh");
    assert_eq!(camera.line(), format!("{count} images"));
    println!("{taken} of {count} images, {} odometry", odometry.received());
    assert_eq!((taken, images.dropped(), images.malformed()), (count, 0, 0));
    assert_eq!(odometry.received(), count * 10);
    let first: Odometry = odometry.take().unwrap().message;
    assert_eq!((first.child_frame_id.as_str(), first.pose.pose.position.z), ("base_link", -5.0));
    drop(camera);
    wait_until("the camera has left", || node.peers() == Peers::default());
}

#[test]
fn a_late_subscription_has_a_latched_map_of_zenoh() {
    let Some(python) = python() else { return };
    let port = free_port();
    let _router = Peer::ready(&python, &["router", &port]);
    let mapper = |topic: &str, hash: &str| Peer::ready(&python, &["latch", &port, &domain(), topic, hash, "40", "30"]);
    let _mappers = [mapper("/map", "own"), mapper("/old/map", "humble"), mapper("/other/map", "RIHS01_0")];
    let node = node(&port, RosTransport::Zenoh);
    let begin = Instant::now();
    let inbox = |topic: &str| node.subscribe_label_map(&name(topic)).unwrap();
    let (own, humble, other) = (inbox("/map"), inbox("/old/map"), inbox("/other/map"));
    for inbox in [&own, &humble] {
        assert!(inbox.wait(TIMEOUT), "no map");
        let grid = inbox.take().unwrap().message;
        assert_eq!((grid.info.width, grid.info.height, grid.data.len()), (40, 30, 1200));
        assert_eq!(grid.data[..8], [0, 1, 2, 3, 4, 5, 6, 0]);
        println!("the map was there after {:.3} s", begin.elapsed().as_secs_f64());
    }
    wait_until("the other definition is refused", || other.malformed() > 0);
    assert_eq!(other.take(), None);
}

#[test]
fn samples_flow_again_after_the_router_restarted() {
    let Some(python) = python() else { return };
    let port = free_port();
    let surface = node(&port, RosTransport::Zenoh);
    let map = name("/scenecast/map");
    let publisher = surface.publisher::<OccupancyGrid>(&map, Qos::Latched(1)).unwrap();
    assert!(publisher.publish(grid(10, 1)), "without a router");
    let has_router = || surface.health().values.contains(&("zenoh_router", "true".to_owned()));
    for _ in 0..2 {
        assert!(!has_router());
        let router = Peer::ready(&python, &["router", &port]);
        let begin = Instant::now();
        wait_until("the router is found", has_router);
        println!("the router is found after {:.1} s", begin.elapsed().as_secs_f64());
        assert_eq!(map_of_peer(&python, &port, "own", &publisher)["width"], 10);
        drop(router);
        wait_until("the router has left", || !has_router());
    }
}

#[test]
fn peers_that_stand_still_delay_no_publisher_for_long() {
    let Some(python) = python() else { return };
    let port = free_port();
    let router = Peer::ready(&python, &["router", &port]);
    let surface = node(&port, RosTransport::Zenoh);
    let publisher = surface.publisher::<OccupancyGrid>(&name("/scenecast/map"), Qos::Latched(1)).unwrap();
    let viewer = Peer::start(&python, &["map", &port, &domain(), "/scenecast/map", "own", "60"]);
    wait_until("the subscriber is seen", || publisher.subscribers() == 1);
    viewer.stop();
    router.stop();
    let mut longest = Duration::ZERO;
    for _ in 0..20 {
        let begin = Instant::now();
        publisher.publish(grid(100_000, 1));
        longest = longest.max(begin.elapsed());
    }
    println!("the longest call took {:.3} s", longest.as_secs_f64());
    assert!(longest < Duration::from_secs(2), "{longest:?}");
}
