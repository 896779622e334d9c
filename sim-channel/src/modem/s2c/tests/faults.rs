//! Injected faults, pacing, and bytes that are not commands.

use super::rig::{EmulatorRig, SECOND};
use crate::channel::ChannelConfig;
use crate::modem::{Emulator, Fault, s2c::S2c, s2c::S2cConfig};
use crate::nodes::NodeId;
use proptest::prelude::*;
use std::time::Duration;

const ONE: NodeId = NodeId(1);

fn inject(rig: &mut EmulatorRig, fault: Fault) {
    let now = rig.basin.now();
    rig.basin.inject(ONE, fault, now);
}

#[test]
fn busy_refuses_messages_for_its_time() {
    let mut rig = EmulatorRig::calm(2);
    inject(&mut rig, Fault::Busy(5 * SECOND));
    assert_eq!(rig.request(1, "AT*SENDIM,1,2,ack,x\r"), "BUSY BACKOFF STATE\r\n");
    rig.run(5 * SECOND);
    assert_eq!(rig.request(1, "AT*SENDIM,1,2,ack,x\r"), "OK\r\n");
}

#[test]
fn reboot_loses_settings_that_were_not_stored() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(1, "AT!L2\r");
    rig.request(1, "AT&W\r");
    rig.request(1, "AT!RI7\r");
    rig.request(1, "AT@ZX1\r");
    inject(&mut rig, Fault::Reboot);
    assert_eq!(rig.basin.poll_hang_up(), Some(ONE));
    assert_eq!(rig.request(1, "AT?L\r"), "", "it ignores bytes while it boots");
    rig.run(3 * SECOND);
    assert_eq!(
        [rig.request(1, "AT?L\r"), rig.request(1, "AT?RI\r"), rig.request(1, "AT?ZX\r")],
        ["2\r\n", "0\r\n", "0\r\n"]
    );
}

#[test]
fn a_brown_out_cuts_the_transmission_short() {
    let mut rig = EmulatorRig::calm(2);
    rig.request(2, "AT@ZX1\r");
    rig.write(1, format!("AT*SENDIM,64,2,noack,{}\r", "x".repeat(64)).as_bytes());
    rig.run(Duration::from_millis(400));
    inject(&mut rig, Fault::BrownOut);
    rig.run(5 * SECOND);
    assert!(rig.take(2).starts_with("RECVSTART\r\nRECVFAILED,"));
}

#[test]
fn frozen_port_neither_reads_nor_writes() {
    let mut rig = EmulatorRig::calm(1);
    inject(&mut rig, Fault::Freeze(10 * SECOND));
    assert_eq!(rig.request(1, "AT?AL\r"), "");
    rig.run(10 * SECOND);
    assert_eq!(rig.take(1), "1\r\n");
}

#[test]
fn garbage_and_half_lines_reach_the_host() {
    let mut rig = EmulatorRig::calm(1);
    inject(&mut rig, Fault::Garbage(100));
    rig.run(SECOND);
    assert_eq!(rig.received[&1].len(), 100);
    rig.take(1);
    rig.write(1, b"AT&V\r");
    rig.run(Duration::from_millis(4));
    inject(&mut rig, Fault::HalfLine);
    rig.run(SECOND);
    let received = rig.take(1);
    assert!(received.starts_with("Source Level: 3") && !received.ends_with("\r\n\r\n"));
}

#[test]
fn wrong_address_shows_in_a_query() {
    let mut rig = EmulatorRig::calm(1);
    inject(&mut rig, Fault::WrongAddress(9));
    assert_eq!(rig.request(1, "AT?AL\r"), "9\r\n");
}

#[test]
fn big_buffer_holds_a_megabyte() {
    let mut rig = EmulatorRig::calm(1);
    inject(&mut rig, Fault::BigBuffer);
    assert_eq!(rig.request(1, "AT?ZL\r"), "1048576\r\n");
}

#[test]
fn input_is_paced_by_the_baud_rate() {
    let mut rig = EmulatorRig::calm(2);
    rig.write(1, format!("AT*SEND,1000,2,{}\r", "x".repeat(1000)).as_bytes());
    rig.run(Duration::from_millis(525));
    assert_eq!(rig.take(1), "", "1016 bytes take 529 ms");
    rig.run(Duration::from_millis(10));
    assert_eq!(rig.take(1), "OK\r\n");
}

#[test]
fn runs_repeat_bit_for_bit() {
    let run = || {
        let mut rig = EmulatorRig::new(3, 700.0, crate::channel::presets::shallow_harbour());
        for n in 0..20u8 {
            rig.write(1, format!("AT*SEND,300,2,{}\rAT@ZX1\r", "x".repeat(300)).as_bytes());
            rig.write(3, b"AT*SENDIM,4,1,ack,abcd\r");
            rig.run(Duration::from_millis(3000 + u64::from(n)));
        }
        rig.received
    };
    assert_eq!(run(), run());
}

#[test]
fn an_hour_of_fifteen_modems_runs_quickly() {
    let mut rig = EmulatorRig::new(15, 200.0, crate::channel::presets::shallow_harbour());
    for minute in 0..60u32 {
        for node in 1..=14u8 {
            let line = format!("AT*SENDIM,32,{},ack,{}\r", node + 1, "x".repeat(32));
            rig.write(node, line.as_bytes());
            rig.run(4 * SECOND);
        }
        assert!(rig.basin.now() <= 60 * SECOND * (minute + 1));
    }
    assert!((1..=14).map(|node| rig.take(node).matches("DELIVEREDIM").count()).sum::<usize>() > 300);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn any_host_bytes_and_any_frames_are_survived(
        writes in proptest::collection::vec((proptest::collection::vec(any::<u8>(), 0..80), 0u64..2000), 0..30),
        frames in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..60), 0..10),
    ) {
        let mut rig = EmulatorRig::new(2, 100.0, ChannelConfig { corruption: 0.5, ..ChannelConfig::default() });
        for (bytes, pause) in writes {
            rig.write(1, &bytes);
            rig.run(Duration::from_millis(pause));
        }
        let mut modem = S2c::new(S2cConfig::new(2));
        for bytes in frames {
            let now = rig.basin.now();
            let position = crate::nodes::NodePosition::default();
            let outcome = crate::channel::ReceptionOutcome::Delivered { bytes, copy: 0, corrupted: true };
            let arrival = crate::channel::Arrival {
                transmission: 1, from: ONE, to: NodeId(2), at: now, sent_at: now, range_m: 1.0,
                sender: position, receiver: position, airtime: SECOND, outcome,
            };
            modem.handle_arrival(&arrival, now);
        }
    }

    #[test]
    fn mutated_commands_are_answered_or_ignored_but_never_fatal(
        which in 0usize..10, at in 0usize..24, byte in any::<u8>(), pause in 0u64..4000,
    ) {
        const LINES: [&[u8]; 10] = [
            b"AT*SENDIM,5,2,ack,hello\r", b"AT*SENDIMS,5,2,99,hello\r", b"AT*SEND,5,2,hello\rATZ1\r",
            b"AT*SENDPBM,5,2,hello\r", b"AT!AL5\rAT!AR2\rAT?AL\r\r\r\r", b"AT?S\rAT?P\rAT&V\rAT?ZSL\r\r\r",
            b"ATZ4\rATZ3\rATZ1\rATH0\rATA\r\r", b"AT@ZX1\rAT@ZU1\rAT@ZF1\r\r", b"AT!UT12345.678\rAT?CLOCK\r\r",
            b"AT@ZL8096\rAT@ZD\rAT@ZO\r\r\r\r",
        ];
        let mut rig = EmulatorRig::calm(2);
        let mut line = LINES[which].to_vec();
        let at = at % line.len();
        line[at] = byte;
        rig.write(1, &line);
        rig.run(Duration::from_millis(pause));
        rig.write(1, &line);
        rig.run(20 * SECOND);
        rig.write(1, &[b'\r'; 9000]);
        rig.run(10 * SECOND);
    }
}
