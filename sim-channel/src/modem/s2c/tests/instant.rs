//! Instant, synchronous and piggyback messages, and positions.

use super::rig::{EmulatorRig, SECOND, keywords};
use crate::channel::{ChannelConfig, Interferer, Outage};
use crate::loss::LossModel;
use crate::modem::s2c::S2cConfig;
use crate::nodes::{NodeId, NodePosition};
use crate::usbl::UsblConfig;
use std::time::Duration;

#[test]
fn acknowledged_message_is_reported_in_order_at_both_ends() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(1, "AT@ZX1\r");
    rig.request(2, "AT@ZX1\r");
    rig.write(1, b"AT*SENDIM,4,2,ack,a\r\nb\r");
    rig.run(5 * SECOND);
    let sender = rig.lines(1);
    assert_eq!(sender[0], "OK");
    assert_eq!(sender[1], "SENDSTART,2,im,204600,0");
    assert!(sender[2].starts_with("SENDEND,2,im,") && sender[2].ends_with(",204600"), "{}", sender[2]);
    assert_eq!(sender[3], "RECVSTART");
    assert!(sender[4].starts_with("RECVEND,"));
    assert_eq!(sender[5], "DELIVEREDIM,2");
    let received = rig.take(2);
    let message = received.split_once("RECVIM,").expect("message").1;
    assert!(message.starts_with("4,1,2,ack,204600,-52,178,0.0000,a\r\nb\r\n"), "{message}");
    assert!(received.starts_with("RECVSTART\r\nRECVEND,"));
    assert!(received.contains("\r\nSENDSTART,1,ack,139000,0\r\n"));
    assert_eq!(rig.request(1, "AT?T\r"), "1000000\r\n");
    assert_eq!(rig.request(1, "AT?DI\r"), "DELIVERED\r\n");
}

#[test]
fn round_trip_at_a_kilometre_takes_under_two_seconds() {
    let mut rig = EmulatorRig::new(2, 1000.0, ChannelConfig::default());
    rig.write(1, b"AT*SENDIM,4,2,ack,abcd\r");
    rig.run(Duration::from_millis(1700));
    assert_eq!(rig.take(1), "OK\r\n");
    rig.run(Duration::from_millis(400));
    assert_eq!(rig.take(1), "DELIVEREDIM,2\r\n");
}

#[test]
fn extended_networking_reports_the_protocol_id() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(2, "AT@ZF1\r");
    rig.write(1, b"AT*SENDIM,p3,2,2,noack,hi\r");
    rig.run(5 * SECOND);
    assert!(rig.take(2).starts_with("RECVIM,p3,2,1,2,noack,182800,"));
}

#[test]
fn only_one_message_at_a_time() {
    let mut rig = EmulatorRig::calm(2);
    assert_eq!(rig.request(1, "AT*SENDIM,2,2,ack,hi\r"), "OK\r\n");
    assert_eq!(rig.request(1, "AT*SENDIM,2,2,ack,hi\r"), "BUSY DELIVERING MESSAGE\r\n");
    assert_eq!(rig.request(1, "AT?DI\r"), "DELIVERING\r\n");
    rig.run(5 * SECOND);
    assert_eq!(rig.request(1, "AT*SENDIM,2,2,noack,hi\r"), "OK\r\n");
}

#[test]
fn message_to_an_absent_peer_fails_after_retries() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(1, "AT!RI2\r");
    rig.request(1, "AT@ZX1\r");
    rig.write(1, b"AT*SENDIM,2,9,ack,hi\r");
    rig.run(60 * SECOND);
    let lines = rig.lines(1);
    assert_eq!(lines.iter().filter(|line| line.starts_with("SENDSTART")).count(), 3);
    assert_eq!(lines.last().map(String::as_str), Some("FAILEDIM,9"));
    assert_eq!(rig.request(1, "AT?DI\r"), "FAILED\r\n");
}

#[test]
fn a_lost_acknowledgement_delivers_twice() {
    let mut rig = EmulatorRig::calm(2);
    rig.basin.channel().set_link_loss(NodeId(2), NodeId(1), LossModel::Independent { probability: 1.0 });
    rig.request(1, "AT!RI1\r");
    rig.write(1, b"AT*SENDIM,2,2,ack,hi\r");
    rig.run(60 * SECOND);
    assert_eq!(keywords(&rig.lines(2)), ["RECVIM", "RECVIM"]);
    assert_eq!(rig.lines(1), ["OK", "FAILEDIM,2"]);
}

#[test]
fn broadcast_reaches_all_and_promiscuous_mode_receives_all() {
    let mut rig = EmulatorRig::calm(3);
    rig.write(1, b"AT*SENDIM,3,255,noack,all\r");
    rig.run(10 * SECOND);
    assert!(rig.take(2).starts_with("RECVIM,3,1,255,noack,"));
    assert!(rig.take(3).starts_with("RECVIM,3,1,255,noack,"));
    rig.request(3, "AT!RP1\r");
    rig.write(1, b"AT*SENDIM,3,2,noack,two\r");
    rig.run(10 * SECOND);
    assert!(rig.take(3).starts_with("RECVIM,3,1,2,noack,"));
}

#[test]
fn modems_of_different_networks_ignore_each_other() {
    for setting in ["AT!AM30\r", "AT!C3\r", "AT!ZP500\r"] {
        let mut rig = EmulatorRig::calm(2);
        rig.request(2, "AT@ZX1\r");
        rig.request(2, setting);
        rig.write(1, b"AT*SENDIM,2,2,noack,hi\r");
        rig.run(5 * SECOND);
        assert_eq!(rig.take(2), "", "{setting}");
    }
}

#[test]
fn a_lost_message_is_a_failed_reception() {
    let config = ChannelConfig { loss: LossModel::Independent { probability: 1.0 }, ..Default::default() };
    let mut rig = EmulatorRig::new(2, 1500.0, config);
    rig.request(2, "AT@ZX1\r");
    rig.write(1, b"AT*SENDIM,2,2,noack,hi\r");
    rig.run(5 * SECOND);
    assert_eq!(rig.lines(2), ["RECVSTART", "RECVFAILED,0.0000,-52,59"]);
}

#[test]
fn interferer_causes_failed_receptions() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(2, "AT@ZX1\r");
    rig.basin.channel().place(NodeId(99), NodePosition::new(100.0, 0.0, 0.0));
    rig.basin.add_interferer(Interferer::new(NodeId(99), 20, SECOND, 5 * SECOND, 1));
    rig.run(60 * SECOND);
    let lines = rig.lines(2);
    assert!(lines.len() > 10);
    assert!(lines.iter().all(|line| line == "RECVSTART" || line.starts_with("RECVFAILED,")));
}

#[test]
fn outage_causes_no_notification() {
    let config = ChannelConfig { outages: vec![Outage::one_way(NodeId(1), NodeId(2))], ..Default::default() };
    let mut rig = EmulatorRig::new(2, 1500.0, config);
    rig.request(2, "AT@ZX1\r");
    rig.write(1, b"AT*SENDIM,2,2,noack,hi\r");
    rig.run(5 * SECOND);
    assert_eq!(rig.take(2), "");
}

#[test]
fn piggyback_message_travels_with_the_next_acknowledgement() {
    let mut rig = EmulatorRig::calm(2);
    assert_eq!(rig.request(2, "AT*SENDPBM,3,1,old\r"), "OK\r\n");
    rig.write(2, b"AT*SENDPBM,3,1,new\r");
    rig.run(5 * SECOND);
    assert_eq!(rig.lines(2), ["OK", "CANCELEDPBM,1"]);
    assert_eq!(rig.take(1), "", "it waits");
    rig.write(1, b"AT*SENDIM,2,2,ack,hi\r");
    rig.run(5 * SECOND);
    let lines = rig.lines(1);
    assert_eq!(keywords(&lines), ["OK", "DELIVEREDIM", "RECVPBM"]);
    assert_eq!(lines[2], "RECVPBM,3,2,1,139000,-52,178,0.0000,new");
    assert_eq!(rig.request(2, "AT?DP\r"), "EMPTY\r\n");
}

#[test]
fn a_synchronous_message_leaves_at_its_time_or_expires() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(1, "AT@ZX1\r");
    rig.write(1, b"AT*SENDIMS,2,2,4000000,hi\r");
    rig.run(3 * SECOND);
    assert_eq!(rig.take(1), "OK\r\n");
    rig.run(5 * SECOND);
    assert!(rig.take(1).starts_with("SENDSTART,2,ims,182800,0\r\n"));
    assert!(rig.take(2).starts_with("RECVIMS,2,1,2,5000000,182800,-52,178,0.0000,hi\r\n"));
    rig.write(1, b"AT*SENDIMS,2,2,4000000,hi\r");
    rig.run(SECOND);
    assert_eq!(rig.lines(1), ["OK", "EXPIREDIMS,2"]);
    rig.write(1, b"AT*SENDIMS,2,2,,hi\r");
    rig.run(5 * SECOND);
    assert_eq!(keywords(&rig.lines(2)), ["RECVIMS"]);
}

#[test]
fn dropping_messages_cancels_those_under_way() {
    let mut rig = EmulatorRig::calm(2);
    rig.write(1, b"AT*SENDPBM,1,2,x\rAT*SENDIMS,1,2,90000000,x\rAT*SENDIM,2,2,ack,hi\r");
    rig.run(Duration::from_millis(100));
    rig.take(1);
    rig.write(1, b"ATZ3\r");
    rig.run(20 * SECOND);
    assert_eq!(rig.lines(1), ["OK", "CANCELEDIM,2", "CANCELEDIMS,2", "CANCELEDPBM,2"]);
}

fn head(angles_only: bool) -> EmulatorRig {
    let usbl = UsblConfig {
        range_std_m: 0.0,
        angle_std_rad: 0.0,
        outlier_probability: 0.0,
        range_only_probability: 0.0,
        ..UsblConfig::default()
    };
    let config = S2cConfig { usbl: Some(usbl), angles_only, ..S2cConfig::new(1) };
    EmulatorRig::of(vec![config, S2cConfig::new(2)], 1500.0, ChannelConfig::default())
}

#[test]
fn usbl_head_reports_the_position_of_the_peer() {
    let mut rig = head(false);
    rig.write(1, b"AT@ZU1\rAT*SENDIM,1,2,ack,x\r");
    rig.run(5 * SECOND);
    let lines = rig.lines(1);
    assert_eq!(keywords(&lines), ["OK", "OK", "DELIVEREDIM", "USBLLONG", "USBLPHYD", "USBLPHYP"]);
    let fields: Vec<_> = lines[3].split(',').skip(1).collect();
    assert_eq!(fields.len(), 16);
    assert_eq!(fields[2], "2");
    assert_eq!(fields[3..9], ["1500.0000", "0.0000", "0.0000", "1500.0000", "0.0000", "0.0000"]);
    assert_eq!(fields[12..], ["1000000", "-52", "178", "0.0000"]);
    assert_eq!(lines[4].split(',').count(), 13);
    assert_eq!(lines[5].split(',').count(), 23);
    assert!(rig.request(1, "AT?UP\r").ends_with(",2,1500.0000,0.0000,0.0000\r\n"));
}

#[test]
fn angles_only_head_reports_angles() {
    let mut rig = head(true);
    rig.write(1, b"AT@ZU1\rAT*SENDIM,1,2,ack,x\r");
    rig.run(5 * SECOND);
    let lines = rig.lines(1);
    let fields: Vec<_> = lines[3].split(',').collect();
    assert_eq!((fields[0], fields.len()), ("USBLANGLES", 14));
    assert_eq!(fields[4..8], ["1.5708", "0.0000", "1.5708", "0.0000"]);
}

#[test]
fn positions_follow_acknowledged_messages_if_switched_on() {
    let mut rig = head(false);
    rig.write(1, b"AT*SENDIM,1,2,ack,x\r");
    rig.run(5 * SECOND);
    assert_eq!(rig.lines(1), ["OK", "DELIVEREDIM,2"]);
    rig.write(1, b"AT@ZU1\rAT*SENDIM,1,2,noack,x\r");
    rig.run(5 * SECOND);
    assert_eq!(rig.lines(1), ["OK", "OK"]);
}
