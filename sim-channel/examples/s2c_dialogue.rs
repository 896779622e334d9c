//! A host at an emulated EvoLogics S2C: it configures its modem and sends an instant message and burst data to a second
//! modem 900 m away.
//!
//! `cargo run -p sim-channel --example s2c_dialogue`

use sim_channel::modem::Basin;
use sim_channel::modem::s2c::{S2c, S2cConfig};
use sim_channel::{Channel, ChannelConfig, Duration, NodeId, NodePosition};

const HOST: NodeId = NodeId(1);
const PEER: NodeId = NodeId(2);

fn main() {
    let mut basin = Basin::new(Channel::new(ChannelConfig::default(), 1));
    for (node, x_m) in [(HOST, 0.0), (PEER, 900.0)] {
        basin.channel().place(node, NodePosition::new(x_m, 0.0, 5.0));
        basin.add(node, Box::new(S2c::new(S2cConfig::new(node.0))));
    }

    println!("Set-up: a query, a setting, extended notifications, and the status.");
    for command in ["AT?AL", "AT!L1", "AT@ZX1", "AT?S"] {
        write(&mut basin, command);
        run(&mut basin, Duration::from_millis(700));
    }

    println!("\nAn acknowledged instant message: half a second of airtime, 0.6 s of travel, and the acknowledgement.");
    write(&mut basin, "AT*SENDIM,21,2,ack,surface at waypoint 7");
    run(&mut basin, Duration::from_secs(4));
    println!("  travel time, us:");
    write(&mut basin, "AT?T");
    run(&mut basin, Duration::from_secs(1));

    println!("\nBurst data: the modems set up a connection, and the pool delivers the record.");
    write(&mut basin, &format!("AT*SEND,600,2,{}", "x".repeat(600)));
    run(&mut basin, Duration::from_secs(8));
    println!("\nRefused: there is no node 99 in a network of 14.");
    write(&mut basin, "AT*SENDIM,2,99,ack,hi");
    run(&mut basin, Duration::from_secs(1));
}

fn write(basin: &mut Basin, command: &str) {
    let now = basin.now();
    println!("{:7.3} s  host > {}", now.as_secs_f64(), shortened(command));
    basin.handle_host_bytes(HOST, format!("{command}\r").as_bytes(), now);
}

/// The host loop: passes `length` of virtual time and prints each line when its end has reached a host.
fn run(basin: &mut Basin, length: Duration) {
    let end = basin.now() + length;
    let mut unfinished = [(HOST, "host <", String::new()), (PEER, "peer <", String::new())];
    while let Some(at) = basin.poll_timeout().filter(|at| *at <= end) {
        basin.advance(at);
        for (node, name, text) in &mut unfinished {
            text.push_str(&String::from_utf8_lossy(&basin.poll_host_bytes(*node)));
            while let Some((line, rest)) = text.split_once("\r\n") {
                println!("{:7.3} s  {name} {}", at.as_secs_f64(), shortened(line));
                *text = rest.to_string();
            }
        }
    }
    basin.advance(end);
}

fn shortened(line: &str) -> String {
    if line.len() > 72 { format!("{}..", &line[..70]) } else { line.to_string() }
}
