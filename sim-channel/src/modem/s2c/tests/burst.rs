//! Burst data over a connection.

use super::rig::{EmulatorRig, SECOND, keywords};
use crate::channel::ChannelConfig;
use crate::loss::LossModel;
use crate::modem::s2c::{Interpreter, S2cConfig};
use crate::nodes::NodeId;
use std::time::Duration;

const KILOMETRE: f64 = 1000.0;

fn push(rig: &mut EmulatorRig, from: u8, to: u8, fill: u8, bytes: usize) {
    let mut line = format!("AT*SEND,{bytes},{to},").into_bytes();
    line.extend(std::iter::repeat_n(fill, bytes));
    line.push(b'\r');
    rig.write(from, &line);
}

/// Bytes of payload in the `RECV` lines of a host.
fn received_bytes(text: &str) -> usize {
    text.match_indices("RECV,").filter_map(|(at, _)| text[at + 5..].split(',').next()?.parse::<usize>().ok()).sum()
}

#[test]
fn one_record_arrives_is_counted_and_delivered() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    push(&mut rig, 1, 2, b'x', 1024);
    rig.run(SECOND);
    assert_eq!(rig.take(1), "OK\r\n");
    assert_eq!(rig.request(1, "AT?PC\r"), "1\r\n");
    rig.run(5 * SECOND);
    assert_eq!(rig.take(1), "DELIVERED,1,2\r\n");
    let received = rig.take(2);
    assert!(received.starts_with("RECV,1024,1,2,13000,-50,180,666666,0.0000,xxx"), "{}", &received[..50]);
    assert_eq!(rig.request(1, "AT?ZE\r"), "1024\r\n");
}

/// Keeps the pool of modem 1 full for 300 s; payload bit/s at modem 2.
fn throughput(config: ChannelConfig) -> f64 {
    let seconds = 300;
    let mut rig = EmulatorRig::of(
        (1..=2).map(|address| S2cConfig { baud: None, ..S2cConfig::new(address) }).collect(),
        KILOMETRE,
        config,
    );
    for _ in 0..seconds * 2 {
        for _ in 0..4 {
            push(&mut rig, 1, 2, b'x', 1000);
        }
        rig.run(SECOND / 2);
    }
    8.0 * received_bytes(&rig.take(2)) as f64 / f64::from(seconds)
}

#[test]
fn full_pool_carries_about_ten_kilobits_per_second() {
    let rate = throughput(ChannelConfig::default());
    assert!((9_000.0..11_000.0).contains(&rate), "{rate}");
}

#[test]
fn ten_percent_loss_costs_little_more_throughput() {
    let rate = throughput(ChannelConfig { loss: LossModel::Independent { probability: 0.1 }, ..Default::default() });
    assert!((7_000.0..9_900.0).contains(&rate), "{rate}");
}

#[test]
fn heavy_loss_in_both_directions_keeps_order() {
    let config = ChannelConfig { loss: LossModel::Independent { probability: 0.3 }, ..Default::default() };
    let mut rig = EmulatorRig::new(2, KILOMETRE, config);
    for modem in [1, 2] {
        rig.request(modem, "AT!RC20\r");
    }
    for record in 0..10u8 {
        push(&mut rig, 1, 2, b'a' + record, 700);
        push(&mut rig, 2, 1, b'A' + record, 300);
    }
    rig.run(400 * SECOND);
    for (node, first, bytes, delivered) in [(2, b'a', 700, 1), (1, b'A', 300, 2)] {
        let text = rig.take(node);
        let firsts: Vec<_> = text
            .match_indices("RECV,")
            .map(|(at, _)| text[at..].splitn(10, ',').nth(9).expect("payload").as_bytes()[0])
            .collect();
        assert_eq!(firsts, (0..10).map(|record| first + record).collect::<Vec<_>>(), "at {node}");
        assert_eq!(received_bytes(&text), 10 * bytes);
        let reports = text.matches(&format!("DELIVERED,{delivered}")).count();
        assert!(reports >= 1);
    }
}

#[test]
fn absent_peer_fails_every_record_and_counts_the_bytes() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    rig.request(1, "AT!RC1\r");
    push(&mut rig, 1, 9, b'x', 100);
    push(&mut rig, 1, 9, b'y', 50);
    rig.run(2 * SECOND);
    assert!(rig.request(1, "AT?S\r").contains(": INITIATION ESTABLISH\r\n"));
    rig.run(30 * SECOND);
    assert_eq!(rig.lines(1), ["FAILED,1,9", "FAILED,2,9", "DROPCNT,150"]);
    assert!(rig.request(1, "AT?S\r").contains(": INITIATION LISTEN\r\n"));
    assert_eq!(rig.request(1, "AT?ZD\r"), "150\r\n");
}

#[test]
fn silent_peer_fails_the_records_under_way() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    for _ in 0..15 {
        push(&mut rig, 1, 2, b'x', 1000);
    }
    rig.run(10 * SECOND);
    rig.basin.channel().remove(NodeId(2));
    rig.run(60 * SECOND);
    let lines = rig.lines(1);
    assert!(lines.iter().any(|line| line.starts_with("FAILED,15,2")), "{lines:?}");
    assert!(lines.last().is_some_and(|line| line.starts_with("DROPCNT,")));
}

#[test]
fn full_pool_refuses_data() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    for _ in 0..17 {
        push(&mut rig, 1, 2, b'x', 1000);
    }
    rig.run(Duration::from_millis(9_300));
    let lines = rig.lines(1);
    assert!(lines.contains(&"ERROR BUFFER FULL".to_string()) || lines.contains(&"DELIVERED,1,2".to_string()));
    assert_eq!(rig.request(1, "AT@ZL20000\r"), "ERROR BUFFER IS NOT EMPTY\r\n");
}

#[test]
fn acoustic_settings_wait_for_the_connection_to_end() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    rig.request(1, "AT!ZI5\r");
    rig.request(1, "AT@ZX1\r");
    push(&mut rig, 1, 2, b'x', 100);
    rig.run(4 * SECOND);
    assert!(rig.take(1).contains("BITRATE,local,13000\r\nBITRATE,remote,13000\r\n"));
    assert!(rig.request(1, "AT?S\r").contains(": ONLINE\r\n"));
    assert_eq!(rig.request(1, "AT!ZP765\r"), "[*]OK\r\n");
    assert_eq!(rig.request(1, "AT?ZP\r"), "[*]765\r\n");
    assert!(rig.request(1, "AT!G1\rAT&V\r").contains("[*]Gain: 1\r\n"));
    rig.run(20 * SECOND);
    assert!(rig.request(1, "AT?S\r").contains(": INITIATION LISTEN\r\n"));
    assert!(rig.request(2, "AT?S\r").contains(": INITIATION LISTEN\r\n"));
    assert_eq!(rig.request(1, "AT?ZP\r"), "765\r\n");
}

#[test]
fn third_node_backs_off_and_may_force() {
    let modems = (1..=3).map(|address| S2cConfig { baud: None, ..S2cConfig::new(address) }).collect();
    let mut rig = EmulatorRig::of(modems, 300.0, ChannelConfig::default());
    for _ in 0..15 {
        push(&mut rig, 1, 2, b'x', 1000);
    }
    rig.run(12 * SECOND);
    assert_eq!(rig.request(3, "AT*SENDIM,1,1,ack,x\r"), "BUSY BACKOFF STATE\r\n");
    assert!(rig.request(3, "AT?S\r").contains(": BACKOFF\r\n"));
    assert_eq!(rig.request(2, "AT*SENDIM,1,3,ack,x\r"), "BUSY BACKOFF STATE\r\n");
    assert_eq!(rig.request(3, "AT*SENDIM,1,1,force,x\r"), "OK\r\n");
}

#[test]
fn messages_pass_between_trains() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    for modem in [1, 2] {
        rig.request(modem, "AT!ZC4\r");
    }
    for _ in 0..16 {
        push(&mut rig, 1, 2, b'x', 1000);
    }
    rig.run(10 * SECOND);
    rig.take(1);
    rig.take(2);
    rig.write(2, b"AT*SENDIM,4,1,ack,down\r");
    rig.write(1, b"AT*SENDIM,2,2,ack,up\r");
    rig.run(12 * SECOND);
    let (one, two) = (rig.lines(1), rig.lines(2));
    assert!(keywords(&one).contains(&"RECVIM") && keywords(&one).contains(&"DELIVEREDIM"), "{one:?}");
    assert!(keywords(&two).contains(&"RECVIM") && keywords(&two).contains(&"DELIVEREDIM"));
}

#[test]
fn raw_data_crosses_between_ports_in_data_mode() {
    let port = |address| S2cConfig { interpreter: Interpreter::At, ..S2cConfig::new(address) };
    let mut rig = EmulatorRig::of(vec![port(1), port(2)], KILOMETRE, ChannelConfig::default());
    rig.write(1, b"lost");
    rig.run(SECOND);
    assert_eq!(rig.take(1), "+++AT:9:DROPCNT,4\r\n");
    assert_eq!(rig.request(1, "+++AT!AR2\r"), "+++AT!AR:2:OK\r\n");
    rig.write(1, b"hello +++ world");
    rig.run(10 * SECOND);
    assert_eq!(rig.take(2), "hello +++ world");
    assert_eq!(rig.take(1), "+++AT:13:DELIVERED,1,2\r\n");
}

#[test]
fn a_line_driver_needs_only_a_stored_remote_address() {
    let port = |address, remote| S2cConfig { interpreter: Interpreter::At, remote, ..S2cConfig::new(address) };
    let mut rig = EmulatorRig::of(vec![port(1, 2), port(2, 1)], KILOMETRE, ChannelConfig::default());
    assert_eq!(rig.request(1, "+++ATZ4\r"), "+++ATZ4:2:OK\r\n");
    rig.write(1, b"#M01, first line\r\n");
    rig.run(10 * SECOND);
    assert_eq!(rig.take(2), "#M01, first line\r\n");
}

#[test]
fn stale_connection_admits_another_node() {
    let modems = (1..=3).map(|address| S2cConfig { baud: None, ..S2cConfig::new(address) }).collect();
    let mut rig = EmulatorRig::of(modems, KILOMETRE, ChannelConfig::default());
    push(&mut rig, 1, 2, b'x', 100);
    rig.run(8 * SECOND);
    rig.basin.channel().remove(NodeId(1));
    rig.run(20 * SECOND);
    rig.take(2);
    push(&mut rig, 3, 2, b'y', 100);
    rig.run(15 * SECOND);
    assert_eq!(received_bytes(&rig.take(2)), 100);
}

#[test]
fn dropping_data_empties_the_pool() {
    let mut rig = EmulatorRig::new(2, KILOMETRE, ChannelConfig::default());
    push(&mut rig, 1, 9, b'x', 100);
    rig.run(SECOND);
    assert_eq!(rig.take(1), "OK\r\n");
    assert_eq!(rig.request(1, "ATZ1\r"), "OK\r\nDROPCNT,100\r\n");
    assert_eq!(rig.request(1, "AT@ZL20000\r"), "OK\r\n");
    rig.run(60 * SECOND);
    assert_eq!(rig.take(1), "");
}
