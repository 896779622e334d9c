//! Viewers over a WebSocket, by a client of a few lines (RFC 6455).

use scenecast_messages::decode;
use scenecast_messages::nav_msgs::OccupancyGrid;
use scenecast_messages::rcl_interfaces::Log;
use scenecast_tests::{demo, free_port, state, wait_until};
use serde_json::{Value, json};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

struct Viewer(TcpStream);

impl Viewer {
    /// The answer to the request to join, and the viewer.
    fn join(port: u16, more: &str) -> (String, Self) {
        let mut stream = TcpStream::connect(("127.0.0.1", port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        let request = format!(
            "GET /foxglove HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n\
             Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n{more}\r\n"
        );
        stream.write_all(request.as_bytes()).unwrap();
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).unwrap();
            head.extend(byte);
        }
        (String::from_utf8(head).unwrap(), Self(stream))
    }

    fn read(&mut self, length: usize) -> Vec<u8> {
        let mut bytes = vec![0; length];
        self.0.read_exact(&mut bytes).unwrap();
        bytes
    }

    /// The next frame: whether it is text, and its payload.
    fn next(&mut self) -> (bool, Vec<u8>) {
        let head = self.read(2);
        let length = match head[1] {
            126 => u16::from_be_bytes(self.read(2).try_into().unwrap()) as usize,
            127 => u64::from_be_bytes(self.read(8).try_into().unwrap()) as usize,
            short => short as usize,
        };
        (head[0] & 15 == 1, self.read(length))
    }

    fn next_text(&mut self) -> Value {
        let (is_text, payload) = self.next();
        assert!(is_text);
        serde_json::from_slice(&payload).unwrap()
    }

    /// Sends a text of up to 125 bytes, under a mask of zeros.
    fn say(&mut self, text: &Value) {
        let text = text.to_string();
        let head = [0x81, 0x80 | u8::try_from(text.len()).unwrap(), 0, 0, 0, 0];
        self.0.write_all(&[&head, text.as_bytes()].concat()).unwrap();
    }
}

#[test]
fn a_viewer_receives_the_map_and_the_log_that_it_subscribes_to() {
    let port = free_port();
    let _demo = demo(port, 8, &[]);
    let cells = || state(port)?["vehicles"][0]["map"]["explored_cells"].as_u64();
    wait_until("a map has arrived", || cells() > Some(50));
    let (refused, _) = Viewer::join(port, "Origin: http://evil.example\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n");
    assert!(refused.starts_with("HTTP/1.1 403"), "{refused}");
    let (joined, mut viewer) = Viewer::join(port, "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n");
    assert!(joined.starts_with("HTTP/1.1 101") && joined.contains("foxglove.sdk.v1"), "{joined}");
    assert_eq!(viewer.next_text()["op"], "serverInfo");
    let advertised = viewer.next_text();
    assert_eq!(advertised["op"], "advertise");
    let channel = |topic: &str| {
        let channels = advertised["channels"].as_array().unwrap();
        channels.iter().find(|channel| channel["topic"] == topic).unwrap_or_else(|| panic!("{advertised}")).clone()
    };
    let (map, log) = (channel("/scenecast/auv_1/map"), channel("/scenecast/log"));
    assert_eq!((&map["encoding"], &map["schemaName"]), (&json!("cdr"), &json!("nav_msgs/msg/OccupancyGrid")));
    assert!(map["schema"].as_str().unwrap().contains("MSG: nav_msgs/MapMetaData"));
    for (id, channel) in [(7, &map), (8, &log)] {
        viewer.say(&json!({ "op": "subscribe", "subscriptions": [{ "id": id, "channelId": channel["id"] }] }));
    }
    let mut received = (None, None);
    while received.0.is_none() || received.1.is_none() {
        let (is_text, payload) = viewer.next();
        assert!(!is_text && payload[0] == 1, "message data");
        let subscription = u32::from_le_bytes(payload[1..5].try_into().unwrap());
        assert!(u64::from_le_bytes(payload[5..13].try_into().unwrap()) > 1_700_000_000_000_000_000);
        match subscription {
            7 => received.0 = decode::<OccupancyGrid>(&payload[13..]).ok(),
            8 => received.1 = decode::<Log>(&payload[13..]).ok(),
            other => panic!("nobody subscribed to {other}"),
        }
    }
    let labels = received.0.unwrap().data.iter().filter(|label| **label > 0).count();
    assert!(labels > 50, "{labels} cells");
    viewer.say(&json!({ "op": "unsubscribe", "subscriptionIds": [7, 8] }));
}
