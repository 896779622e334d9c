//! Hours of mixed traffic on a bad channel: no exchange hangs, and every message is accounted for.

use super::rig::{EmulatorRig, SECOND};
use crate::channel::ChannelConfig;
use crate::modem::s2c::S2cConfig;
use crate::random::RandomStream;
use std::collections::BTreeMap;
use std::time::Duration;

/// Number of the lines of a host for each keyword.
fn tally(text: &str) -> BTreeMap<&str, usize> {
    let mut counts = BTreeMap::new();
    for line in text.split("\r\n") {
        *counts.entry(line.split([',', ' ']).next().unwrap_or_default()).or_default() += 1;
    }
    counts
}

fn soak(config: ChannelConfig, seed: u64) {
    let modem = |address| S2cConfig { baud: Some(115_200), ..S2cConfig::new(address) };
    let mut rig = EmulatorRig::of((1..=3).map(modem).collect(), 900.0, config);
    for node in 1..=3 {
        rig.request(node, "AT!ZI5\r");
    }
    let mut rng = RandomStream::new(seed, &[]);
    let (mut bursts, mut instants) = (BTreeMap::<u8, usize>::new(), BTreeMap::<u8, usize>::new());
    for _ in 0..300 {
        let from = 1 + rng.below(3) as u8;
        let to = 1 + (from + rng.below(2) as u8) % 3;
        let burst = rng.bernoulli(0.5);
        let line = if burst {
            format!("AT*SEND,200,{to},{}\r", "b".repeat(200))
        } else {
            format!("AT*SENDIM,20,{to},ack,{}\r", "i".repeat(20))
        };
        let already = rig.received[&from].len();
        rig.write(from, line.as_bytes());
        rig.run(Duration::from_millis(50));
        let accepted = rig.received[&from][already..].windows(4).any(|bytes| bytes == b"OK\r\n");
        *if burst { &mut bursts } else { &mut instants }.entry(from).or_default() += usize::from(accepted);
        rig.run(Duration::from_millis(rng.below(20_000) as u64));
    }
    rig.run(600 * SECOND);
    for node in 1..=3 {
        let text = rig.take(node);
        let received = tally(&text);
        let count = |keyword| received.get(keyword).copied().unwrap_or_default();
        assert_eq!(count("DELIVERED") + count("FAILED"), bursts[&node], "bursts of {node}, seed {seed}: {received:?}");
        assert_eq!(
            count("DELIVEREDIM") + count("FAILEDIM"),
            instants[&node],
            "messages of {node}, seed {seed}: {received:?}"
        );
        assert!(count("DELIVERED") > 0 && count("DELIVEREDIM") > 0, "{received:?}");
        assert!(rig.request(node, "AT?S\r").contains(": INITIATION LISTEN\r\n"));
    }
}

#[test]
fn everything_is_reported_once_in_a_harbour() {
    (1..=4).for_each(|seed| soak(crate::channel::presets::shallow_harbour(), seed));
}

#[test]
fn everything_is_reported_once_under_ice() {
    (1..=4).for_each(|seed| soak(crate::channel::presets::under_ice(), seed));
}

#[test]
fn everything_is_reported_once_where_bits_flip() {
    (1..=4).for_each(|seed| soak(ChannelConfig { corruption: 0.2, ..ChannelConfig::default() }, seed));
}
