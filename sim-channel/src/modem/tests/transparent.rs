//! The byte pipe at its hosts.

use super::rig::{EmulatorRig, SECOND};
use crate::channel::ChannelConfig;
use crate::modem::transparent::{Transparent, TransparentConfig};
use crate::modem::{Emulator, Fault};
use crate::nodes::NodeId;
use std::time::Duration;

fn rig(config: ChannelConfig) -> EmulatorRig {
    let boxed = |node| (node, Box::new(Transparent::new(TransparentConfig::default())) as Box<dyn Emulator>);
    EmulatorRig::join(vec![boxed(1), boxed(2)], 1500.0, config)
}

#[test]
fn bytes_cross_in_order_and_only_to_the_others() {
    let mut rig = rig(ChannelConfig::default());
    rig.write(1, b"hello");
    rig.write(1, &[7; 600]);
    rig.run(10 * SECOND);
    assert_eq!(rig.received[&2], [b"hello".to_vec(), vec![7; 600]].concat());
    assert!(rig.received[&1].is_empty());
}

#[test]
fn delay_adds_line_preamble_airtime_and_propagation() {
    let mut rig = rig(ChannelConfig::default());
    rig.write(1, &[1; 96]);
    // 100 ms over the line, 30 ms pause, 100 ms preamble, 80 ms of bits, 1 s of propagation, and 1 ms a byte out.
    rig.run(Duration::from_millis(1310));
    assert!(rig.received[&2].is_empty());
    rig.run(Duration::from_millis(5));
    assert_eq!(rig.received[&2].len(), 4);
}

#[test]
fn escape_is_removed_up_to_its_line_end() {
    let mut rig = rig(ChannelConfig::default());
    rig.write(1, b"ab+++AT?S\rcd");
    rig.run(10 * SECOND);
    assert_eq!(rig.take(2), "abcd");
    assert_eq!(rig.take(1), "OK\r\n");
}

#[test]
fn overflow_is_lost_silently() {
    let mut rig = rig(ChannelConfig::default());
    rig.basin.inject(NodeId(1), Fault::Busy(30 * SECOND), Duration::ZERO);
    rig.write(1, &[7; 10_000]);
    rig.run(60 * SECOND);
    assert_eq!(rig.received[&2].len(), 4096);
    assert!(rig.received[&1].is_empty());
}

#[test]
fn simultaneous_packets_are_both_lost() {
    let mut rig = rig(ChannelConfig::default());
    rig.set_spacing(1.0);
    rig.write(1, &[1; 100]);
    rig.write(2, &[2; 100]);
    rig.run(10 * SECOND);
    assert!(rig.received.values().all(Vec::is_empty));
}
