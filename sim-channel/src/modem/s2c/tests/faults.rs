//! Faults on demand, pacing, and bytes that are no commands.

use super::bench::{Bench, SECOND};
use crate::channel::ChannelConfig;
use crate::modem::{Emulator, Fault, s2c::S2c, s2c::S2cConfig};
use crate::nodes::NodeId;
use proptest::prelude::*;
use std::time::Duration;

const ONE: NodeId = NodeId(1);

fn inject(bench: &mut Bench, fault: Fault) {
    let now = bench.basin.now();
    bench.basin.inject(ONE, fault, now);
}

#[test]
fn busy_refuses_messages_for_its_time() {
    let mut bench = Bench::calm(2);
    inject(&mut bench, Fault::Busy(5 * SECOND));
    assert_eq!(bench.ask(1, "AT*SENDIM,1,2,ack,x\r"), "BUSY BACKOFF STATE\r\n");
    bench.run(5 * SECOND);
    assert_eq!(bench.ask(1, "AT*SENDIM,1,2,ack,x\r"), "OK\r\n");
}

#[test]
fn a_reboot_loses_what_was_not_stored() {
    let mut bench = Bench::calm(2);
    bench.ask(1, "AT!L2\r");
    bench.ask(1, "AT&W\r");
    bench.ask(1, "AT!RI7\r");
    bench.ask(1, "AT@ZX1\r");
    inject(&mut bench, Fault::Reboot);
    assert_eq!(bench.basin.poll_hang_up(), Some(ONE));
    assert_eq!(bench.ask(1, "AT?L\r"), "", "it does not hear while it boots");
    bench.run(3 * SECOND);
    assert_eq!([bench.ask(1, "AT?L\r"), bench.ask(1, "AT?RI\r"), bench.ask(1, "AT?ZX\r")], ["2\r\n", "0\r\n", "0\r\n"]);
}

#[test]
fn a_brown_out_cuts_the_transmission_short() {
    let mut bench = Bench::calm(2);
    bench.ask(2, "AT@ZX1\r");
    bench.write(1, format!("AT*SENDIM,64,2,noack,{}\r", "x".repeat(64)).as_bytes());
    bench.run(Duration::from_millis(400));
    inject(&mut bench, Fault::BrownOut);
    bench.run(5 * SECOND);
    assert!(bench.take(2).starts_with("RECVSTART\r\nRECVFAILED,"));
}

#[test]
fn a_frozen_port_neither_reads_nor_writes_until_it_thaws() {
    let mut bench = Bench::calm(1);
    inject(&mut bench, Fault::Freeze(10 * SECOND));
    assert_eq!(bench.ask(1, "AT?AL\r"), "");
    bench.run(10 * SECOND);
    assert_eq!(bench.take(1), "1\r\n");
}

#[test]
fn garbage_and_half_lines_reach_the_host() {
    let mut bench = Bench::calm(1);
    inject(&mut bench, Fault::Garbage(100));
    bench.run(SECOND);
    assert_eq!(bench.told[&1].len(), 100);
    bench.take(1);
    bench.write(1, b"AT&V\r");
    bench.run(Duration::from_millis(4));
    inject(&mut bench, Fault::HalfLine);
    bench.run(SECOND);
    let told = bench.take(1);
    assert!(told.starts_with("Source Level: 3") && !told.ends_with("\r\n\r\n"));
}

#[test]
fn a_wrong_address_shows_when_asked() {
    let mut bench = Bench::calm(1);
    inject(&mut bench, Fault::WrongAddress(9));
    assert_eq!(bench.ask(1, "AT?AL\r"), "9\r\n");
}

#[test]
fn a_big_buffer_swallows_a_megabyte() {
    let mut bench = Bench::calm(1);
    inject(&mut bench, Fault::BigBuffer);
    assert_eq!(bench.ask(1, "AT?ZL\r"), "1048576\r\n");
}

#[test]
fn serial_time_is_real_on_the_way_in() {
    let mut bench = Bench::calm(2);
    bench.write(1, format!("AT*SEND,1000,2,{}\r", "x".repeat(1000)).as_bytes());
    bench.run(Duration::from_millis(525));
    assert_eq!(bench.take(1), "", "1016 bytes take 529 ms");
    bench.run(Duration::from_millis(10));
    assert_eq!(bench.take(1), "OK\r\n");
}

#[test]
fn runs_repeat_bit_for_bit() {
    let run = || {
        let mut bench = Bench::new(3, 700.0, crate::channel::presets::shallow_harbour());
        for n in 0..20u8 {
            bench.write(1, format!("AT*SEND,300,2,{}\rAT@ZX1\r", "x".repeat(300)).as_bytes());
            bench.write(3, b"AT*SENDIM,4,1,ack,abcd\r");
            bench.run(Duration::from_millis(3000 + u64::from(n)));
        }
        bench.told
    };
    assert_eq!(run(), run());
}

#[test]
fn an_hour_of_fifteen_modems_passes_quickly() {
    let mut bench = Bench::new(15, 200.0, crate::channel::presets::shallow_harbour());
    for minute in 0..60u32 {
        for node in 1..=14u8 {
            let line = format!("AT*SENDIM,32,{},ack,{}\r", node + 1, "x".repeat(32));
            bench.write(node, line.as_bytes());
            bench.run(4 * SECOND);
        }
        assert!(bench.basin.now() <= 60 * SECOND * (minute + 1));
    }
    assert!((1..=14).map(|node| bench.take(node).matches("DELIVEREDIM").count()).sum::<usize>() > 300);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn any_host_bytes_and_any_frames_are_survived(
        writes in proptest::collection::vec((proptest::collection::vec(any::<u8>(), 0..80), 0u64..2000), 0..30),
        frames in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..60), 0..10),
    ) {
        let mut bench = Bench::new(2, 100.0, ChannelConfig { corruption: 0.5, ..ChannelConfig::default() });
        for (bytes, pause) in writes {
            bench.write(1, &bytes);
            bench.run(Duration::from_millis(pause));
        }
        let mut modem = S2c::new(S2cConfig::new(2));
        for bytes in frames {
            let now = bench.basin.now();
            let place = crate::nodes::Position::default();
            let outcome = crate::channel::Outcome::Delivered { bytes, copy: 0, corrupted: true };
            let arrival = crate::channel::Arrival {
                transmission: 1, from: ONE, to: NodeId(2), at: now, sent_at: now, range_m: 1.0,
                sender: place, receiver: place, airtime: SECOND, outcome,
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
        let mut bench = Bench::calm(2);
        let mut line = LINES[which].to_vec();
        let at = at % line.len();
        line[at] = byte;
        bench.write(1, &line);
        bench.run(Duration::from_millis(pause));
        bench.write(1, &line);
        bench.run(20 * SECOND);
        bench.write(1, &[b'\r'; 9000]);
        bench.run(10 * SECOND);
    }
}
