//! Instant, synchronous and piggyback messages, and positions.

use super::bench::{Bench, SECOND, keywords};
use crate::channel::{ChannelConfig, Outage, Talker};
use crate::loss::LossModel;
use crate::modem::s2c::S2cConfig;
use crate::nodes::{NodeId, Position};
use crate::usbl::UsblConfig;
use std::time::Duration;

#[test]
fn an_acknowledged_message_is_told_in_order_at_both_ends() {
    let mut bench = Bench::calm(2);
    bench.ask(1, "AT@ZX1\r");
    bench.ask(2, "AT@ZX1\r");
    bench.write(1, b"AT*SENDIM,4,2,ack,a\r\nb\r");
    bench.run(5 * SECOND);
    let sender = bench.lines(1);
    assert_eq!(sender[0], "OK");
    assert_eq!(sender[1], "SENDSTART,2,im,204600,0");
    assert!(sender[2].starts_with("SENDEND,2,im,") && sender[2].ends_with(",204600"), "{}", sender[2]);
    assert_eq!(sender[3], "RECVSTART");
    assert!(sender[4].starts_with("RECVEND,"));
    assert_eq!(sender[5], "DELIVEREDIM,2");
    let heard = bench.take(2);
    let received = heard.split_once("RECVIM,").expect("received").1;
    assert!(received.starts_with("4,1,2,ack,204600,-52,178,0.0000,a\r\nb\r\n"), "{received}");
    assert!(heard.starts_with("RECVSTART\r\nRECVEND,"));
    assert!(heard.contains("\r\nSENDSTART,1,ack,139000,0\r\n"));
    assert_eq!(bench.ask(1, "AT?T\r"), "1000000\r\n");
    assert_eq!(bench.ask(1, "AT?DI\r"), "DELIVERED\r\n");
}

#[test]
fn a_round_trip_at_a_kilometre_takes_what_it_takes_at_sea() {
    let mut bench = Bench::new(2, 1000.0, ChannelConfig::default());
    bench.write(1, b"AT*SENDIM,4,2,ack,abcd\r");
    bench.run(Duration::from_millis(1700));
    assert_eq!(bench.take(1), "OK\r\n");
    bench.run(Duration::from_millis(400));
    assert_eq!(bench.take(1), "DELIVEREDIM,2\r\n");
}

#[test]
fn extended_networking_tells_the_protocol() {
    let mut bench = Bench::calm(2);
    bench.ask(2, "AT@ZF1\r");
    bench.write(1, b"AT*SENDIM,p3,2,2,noack,hi\r");
    bench.run(5 * SECOND);
    assert!(bench.take(2).starts_with("RECVIM,p3,2,1,2,noack,182800,"));
}

#[test]
fn only_one_message_at_a_time() {
    let mut bench = Bench::calm(2);
    assert_eq!(bench.ask(1, "AT*SENDIM,2,2,ack,hi\r"), "OK\r\n");
    assert_eq!(bench.ask(1, "AT*SENDIM,2,2,ack,hi\r"), "BUSY DELIVERING MESSAGE\r\n");
    assert_eq!(bench.ask(1, "AT?DI\r"), "DELIVERING\r\n");
    bench.run(5 * SECOND);
    assert_eq!(bench.ask(1, "AT*SENDIM,2,2,noack,hi\r"), "OK\r\n");
}

#[test]
fn nobody_there_means_failed_after_the_retries() {
    let mut bench = Bench::calm(2);
    bench.ask(1, "AT!RI2\r");
    bench.ask(1, "AT@ZX1\r");
    bench.write(1, b"AT*SENDIM,2,9,ack,hi\r");
    bench.run(60 * SECOND);
    let lines = bench.lines(1);
    assert_eq!(lines.iter().filter(|line| line.starts_with("SENDSTART")).count(), 3);
    assert_eq!(lines.last().map(String::as_str), Some("FAILEDIM,9"));
    assert_eq!(bench.ask(1, "AT?DI\r"), "FAILED\r\n");
}

#[test]
fn a_lost_acknowledgement_delivers_twice() {
    let mut bench = Bench::calm(2);
    bench.basin.channel().set_link_loss(NodeId(2), NodeId(1), LossModel::Independent { probability: 1.0 });
    bench.ask(1, "AT!RI1\r");
    bench.write(1, b"AT*SENDIM,2,2,ack,hi\r");
    bench.run(60 * SECOND);
    assert_eq!(keywords(&bench.lines(2)), ["RECVIM", "RECVIM"]);
    assert_eq!(bench.lines(1), ["OK", "FAILEDIM,2"]);
}

#[test]
fn everybody_hears_a_broadcast_and_the_promiscuous_hear_all() {
    let mut bench = Bench::calm(3);
    bench.write(1, b"AT*SENDIM,3,255,noack,all\r");
    bench.run(10 * SECOND);
    assert!(bench.take(2).starts_with("RECVIM,3,1,255,noack,"));
    assert!(bench.take(3).starts_with("RECVIM,3,1,255,noack,"));
    bench.ask(3, "AT!RP1\r");
    bench.write(1, b"AT*SENDIM,3,2,noack,two\r");
    bench.run(10 * SECOND);
    assert!(bench.take(3).starts_with("RECVIM,3,1,2,noack,"));
}

#[test]
fn different_networks_do_not_hear_each_other_and_nobody_says_why() {
    for setting in ["AT!AM30\r", "AT!C3\r", "AT!ZP500\r"] {
        let mut bench = Bench::calm(2);
        bench.ask(2, "AT@ZX1\r");
        bench.ask(2, setting);
        bench.write(1, b"AT*SENDIM,2,2,noack,hi\r");
        bench.run(5 * SECOND);
        assert_eq!(bench.take(2), "", "{setting}");
    }
}

#[test]
fn a_lost_message_is_a_failed_reception() {
    let config = ChannelConfig { loss: LossModel::Independent { probability: 1.0 }, ..Default::default() };
    let mut bench = Bench::new(2, 1500.0, config);
    bench.ask(2, "AT@ZX1\r");
    bench.write(1, b"AT*SENDIM,2,2,noack,hi\r");
    bench.run(5 * SECOND);
    assert_eq!(bench.lines(2), ["RECVSTART", "RECVFAILED,0.0000,-52,59"]);
}

#[test]
fn a_third_talker_is_noise() {
    let mut bench = Bench::calm(2);
    bench.ask(2, "AT@ZX1\r");
    bench.basin.channel().place(NodeId(99), Position::new(100.0, 0.0, 0.0));
    bench.basin.add_talker(Talker::new(NodeId(99), 20, SECOND, 5 * SECOND, 1));
    bench.run(60 * SECOND);
    let lines = bench.lines(2);
    assert!(lines.len() > 10);
    assert!(lines.iter().all(|line| line == "RECVSTART" || line.starts_with("RECVFAILED,")));
}

#[test]
fn an_outage_is_heard_by_nobody() {
    let config = ChannelConfig { outages: vec![Outage::one_way(NodeId(1), NodeId(2))], ..Default::default() };
    let mut bench = Bench::new(2, 1500.0, config);
    bench.ask(2, "AT@ZX1\r");
    bench.write(1, b"AT*SENDIM,2,2,noack,hi\r");
    bench.run(5 * SECOND);
    assert_eq!(bench.take(2), "");
}

#[test]
fn a_piggyback_message_rides_on_the_next_acknowledgement() {
    let mut bench = Bench::calm(2);
    assert_eq!(bench.ask(2, "AT*SENDPBM,3,1,old\r"), "OK\r\n");
    bench.write(2, b"AT*SENDPBM,3,1,new\r");
    bench.run(5 * SECOND);
    assert_eq!(bench.lines(2), ["OK", "CANCELEDPBM,1"]);
    assert_eq!(bench.take(1), "", "it waits");
    bench.write(1, b"AT*SENDIM,2,2,ack,hi\r");
    bench.run(5 * SECOND);
    let lines = bench.lines(1);
    assert_eq!(keywords(&lines), ["OK", "DELIVEREDIM", "RECVPBM"]);
    assert_eq!(lines[2], "RECVPBM,3,2,1,139000,-52,178,0.0000,new");
    assert_eq!(bench.ask(2, "AT?DP\r"), "EMPTY\r\n");
}

#[test]
fn a_synchronous_message_leaves_at_its_time_or_expires() {
    let mut bench = Bench::calm(2);
    bench.ask(1, "AT@ZX1\r");
    bench.write(1, b"AT*SENDIMS,2,2,4000000,hi\r");
    bench.run(3 * SECOND);
    assert_eq!(bench.take(1), "OK\r\n");
    bench.run(5 * SECOND);
    assert!(bench.take(1).starts_with("SENDSTART,2,ims,182800,0\r\n"));
    assert!(bench.take(2).starts_with("RECVIMS,2,1,2,5000000,182800,-52,178,0.0000,hi\r\n"));
    bench.write(1, b"AT*SENDIMS,2,2,4000000,hi\r");
    bench.run(SECOND);
    assert_eq!(bench.lines(1), ["OK", "EXPIREDIMS,2"]);
    bench.write(1, b"AT*SENDIMS,2,2,,hi\r");
    bench.run(5 * SECOND);
    assert_eq!(keywords(&bench.lines(2)), ["RECVIMS"]);
}

#[test]
fn dropping_messages_cancels_what_is_under_way() {
    let mut bench = Bench::calm(2);
    bench.write(1, b"AT*SENDPBM,1,2,x\rAT*SENDIMS,1,2,90000000,x\rAT*SENDIM,2,2,ack,hi\r");
    bench.run(Duration::from_millis(100));
    bench.take(1);
    bench.write(1, b"ATZ3\r");
    bench.run(20 * SECOND);
    assert_eq!(bench.lines(1), ["OK", "CANCELEDIM,2", "CANCELEDIMS,2", "CANCELEDPBM,2"]);
}

fn head(angles_only: bool) -> Bench {
    let usbl = UsblConfig {
        range_std_m: 0.0,
        angle_std_rad: 0.0,
        outlier_probability: 0.0,
        range_only_probability: 0.0,
        ..UsblConfig::default()
    };
    let config = S2cConfig { usbl: Some(usbl), angles_only, ..S2cConfig::new(1) };
    Bench::of(vec![config, S2cConfig::new(2)], 1500.0, ChannelConfig::default())
}

#[test]
fn a_head_tells_where_the_answer_came_from() {
    let mut bench = head(false);
    bench.write(1, b"AT@ZU1\rAT*SENDIM,1,2,ack,x\r");
    bench.run(5 * SECOND);
    let lines = bench.lines(1);
    assert_eq!(keywords(&lines), ["OK", "OK", "DELIVEREDIM", "USBLLONG", "USBLPHYD", "USBLPHYP"]);
    let fields: Vec<_> = lines[3].split(',').skip(1).collect();
    assert_eq!(fields.len(), 16);
    assert_eq!(fields[2], "2");
    assert_eq!(fields[3..9], ["1500.0000", "0.0000", "0.0000", "1500.0000", "0.0000", "0.0000"]);
    assert_eq!(fields[12..], ["1000000", "-52", "178", "0.0000"]);
    assert_eq!(lines[4].split(',').count(), 13);
    assert_eq!(lines[5].split(',').count(), 23);
    assert!(bench.ask(1, "AT?UP\r").ends_with(",2,1500.0000,0.0000,0.0000\r\n"));
}

#[test]
fn a_head_without_range_tells_angles() {
    let mut bench = head(true);
    bench.write(1, b"AT@ZU1\rAT*SENDIM,1,2,ack,x\r");
    bench.run(5 * SECOND);
    let lines = bench.lines(1);
    let fields: Vec<_> = lines[3].split(',').collect();
    assert_eq!((fields[0], fields.len()), ("USBLANGLES", 14));
    assert_eq!(fields[4..8], ["1.5708", "0.0000", "1.5708", "0.0000"]);
}

#[test]
fn positions_are_told_only_if_wanted_and_only_after_answers() {
    let mut bench = head(false);
    bench.write(1, b"AT*SENDIM,1,2,ack,x\r");
    bench.run(5 * SECOND);
    assert_eq!(bench.lines(1), ["OK", "DELIVEREDIM,2"]);
    bench.write(1, b"AT@ZU1\rAT*SENDIM,1,2,noack,x\r");
    bench.run(5 * SECOND);
    assert_eq!(bench.lines(1), ["OK", "OK"]);
}
