//! Speed of emulated modems in virtual time on one core.
//!
//! `cargo bench -p sim-channel --bench basin`

use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::modem::{Basin, Emulator};
use sim_channel::{Channel, Duration, NodeId, NodePosition, presets};

const HOUR: Duration = Duration::from_secs(3600);
const NODES: u8 = 15;

fn main() {
    divan::main();
}

/// Fifteen S2C in a harbour: a pair keeps its burst pool full, each other modem sends an acknowledged message in turn.
#[divan::bench(sample_count = 3)]
fn hour_of_fifteen_s2c() -> usize {
    run(
        |address| Box::new(S2c::new(S2cConfig::new(address))),
        |second, node| {
            if node <= 2 {
                return [b"AT*SEND,1000,".as_slice(), if node == 1 { b"2," } else { b"1," }, &[b'x'; 1000], b"\r"]
                    .concat();
            }
            let has_turn = second % u64::from(NODES) == u64::from(node);
            if has_turn {
                format!("AT*SENDIM,32,{},force,{}\r", node % NODES + 1, "x".repeat(32)).into_bytes()
            } else {
                Vec::new()
            }
        },
    )
}

/// Fifteen Micromodems that take turns with packets of three frames, acknowledged.
#[divan::bench(sample_count = 3)]
fn hour_of_fifteen_micromodems() -> usize {
    run(
        |address| Box::new(Micromodem::new(MicromodemConfig::new(address))),
        |second, node| {
            let (turn, step) = (second / 12 % u64::from(NODES) + 1, second % 12);
            let other = node % NODES + 1;
            match (turn == u64::from(node), step) {
                (true, 0) => format!("$CCCYC,0,{node},{other},1,1,3\r\n").into_bytes(),
                (true, 1..=3) => format!("$CCTXD,{node},{other},1,{}\r\n", "5a".repeat(64)).into_bytes(),
                _ => Vec::new(),
            }
        },
    )
}

/// Runs an hour; returns the number of bytes that all hosts have received.
fn run(modem: impl Fn(u8) -> Box<dyn Emulator>, host_bytes: impl Fn(u64, u8) -> Vec<u8>) -> usize {
    let mut basin = Basin::new(Channel::new(presets::shallow_harbour(), 1));
    for address in 1..=NODES {
        basin.channel().place(NodeId(address), NodePosition::new(120.0 * f64::from(address), 0.0, 5.0));
        basin.add(NodeId(address), modem(address));
    }
    let mut received = 0;
    for second in 0..HOUR.as_secs() {
        let end = Duration::from_secs(second);
        for node in (1..=NODES).map(NodeId) {
            basin.handle_host_bytes(node, &host_bytes(second, node.0), end);
        }
        while let Some(at) = basin.poll_timeout().filter(|at| *at <= end + Duration::from_secs(1)) {
            let now = basin.now();
            basin.advance(at.max(now));
            received += (1..=NODES).map(|node| basin.poll_host_bytes(NodeId(node)).len()).sum::<usize>();
        }
    }
    assert!(received > 10_000);
    received
}
