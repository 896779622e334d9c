//! Two nodes on the loopback network, without multicast.

use scenecast_config::{Ros2, RosName};
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::sensor_msgs::Image;
use scenecast_ros2::{Peers, Qos, RosNode, topic};
use std::time::{Duration, Instant};

const TIMEOUT: Duration = Duration::from_secs(20);

/// A node in a domain of this test process, so that tests on one machine do not meet.
fn node(name: &str, offset: u32) -> RosNode {
    let domain = (1 + (std::process::id() + 50 * offset) % 100) as u8;
    RosNode::start(&Ros2 { domain, networks: vec!["127.0.0.1".parse().unwrap()], ..Ros2::default() }, name).unwrap()
}

fn name(text: &str) -> RosName {
    topic(text).unwrap()
}

#[test]
fn a_late_subscriber_receives_a_latched_map() {
    let map = name("/scenecast/map");
    let surface = node("surface", 0);
    let publisher = surface.publisher::<OccupancyGrid>(&map, Qos::Latched(1)).unwrap();
    for label in [1, 2] {
        assert!(publisher.publish(OccupancyGrid { data: vec![label; 1000], ..Default::default() }));
    }
    let viewer = node("viewer", 0);
    let inbox = viewer.subscribe_label_map(&map).unwrap();
    // DDS may keep more than the last one for a while, and sends them in order.
    let begin = Instant::now();
    loop {
        assert!(inbox.wait(TIMEOUT.saturating_sub(begin.elapsed())), "the last map did not arrive");
        let labels = inbox.take().unwrap().message.data;
        assert_eq!(labels.len(), 1000);
        if labels[0] == 2 {
            break;
        }
    }
}

#[test]
fn images_of_megabytes_arrive_whole() {
    let images = name("/camera/image_raw");
    let (camera, vehicle) = (node("camera", 1), node("vehicle", 1));
    let inbox = vehicle.subscribe_images(&images).unwrap();
    let publisher = camera.publisher::<Image>(&images, Qos::Sensor(5)).unwrap();
    let data: Vec<u8> = (0..1360 * 1024 * 3).map(|i: u32| (i % 251) as u8).collect();
    let image =
        Image { height: 1024, width: 1360, step: 1360 * 3, encoding: "rgb8".to_owned(), data, ..Default::default() };
    let begin = Instant::now();
    let received = loop {
        // Best effort: images before the match are lost.
        publisher.publish(image.clone());
        if inbox.wait(Duration::from_millis(500)) {
            break inbox.take().unwrap();
        }
        assert!(begin.elapsed() < TIMEOUT, "no image");
    };
    assert_eq!(received.message, image);
    assert_eq!(publisher.subscribers(), 1);
    assert_eq!(vehicle.peers(), Peers::default(), "two nodes of one process are no peers");
}
