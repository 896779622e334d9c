//! A pair of emulated WHOI Micromodems in a basin: a ping, then a packet of three frames with acknowledgements. The host
//! of modem 1 replies to each data request (`CADRQ`) of its modem with the next frame.
//!
//! `cargo run -p sim-channel --example micromodem_pair`

use sim_channel::modem::Basin;
use sim_channel::modem::micromodem::{Micromodem, MicromodemConfig};
use sim_channel::{Channel, ChannelConfig, Duration, NodeId, NodePosition};

fn main() {
    let mut basin = Basin::new(Channel::new(ChannelConfig::default(), 1));
    for (address, x_m) in [(1, 0.0), (2, 1450.0)] {
        basin.channel().place(NodeId(address), NodePosition::new(x_m, 0.0, 8.0));
        basin.add(NodeId(address), Box::new(Micromodem::new(MicromodemConfig::new(address))));
    }
    let mut host = Host { basin, frames: vec!["6669727374", "7365636F6E64", "7468697264"], input: Default::default() };

    println!("A ping: CAMPR holds the one-way travel time in seconds.");
    host.write("CCMPC,1,2");
    host.run(Duration::from_secs(6));

    println!("\nA packet at rate 1: three frames, each acknowledged by CAACK.");
    host.write("CCCYC,0,1,2,1,1,3");
    host.run(Duration::from_secs(10));
}

/// Host of modem 1, with the frames that it still has to send; it prints the lines of both modems.
struct Host {
    basin: Basin,
    frames: Vec<&'static str>,
    input: [String; 2],
}

impl Host {
    fn write(&mut self, body: &str) {
        let checksum = body.bytes().fold(0, |sum, byte| sum ^ byte);
        let now = self.basin.now();
        println!("{:7.3} s  host 1 > ${body}*{checksum:02X}", now.as_secs_f64());
        self.basin.handle_host_bytes(NodeId(1), format!("${body}*{checksum:02X}\r\n").as_bytes(), now);
    }

    /// The host loop: jumps from event to event and reads the lines that have reached the hosts.
    fn run(&mut self, length: Duration) {
        let end = self.basin.now() + length;
        while let Some(at) = self.basin.poll_timeout().filter(|at| *at <= end) {
            self.basin.advance(at);
            for number in [1, 2] {
                let bytes = self.basin.poll_host_bytes(NodeId(number));
                self.input[usize::from(number) - 1].push_str(&String::from_utf8_lossy(&bytes));
                self.read_lines(number);
            }
        }
        self.basin.advance(end);
    }

    fn read_lines(&mut self, number: u8) {
        while let Some((line, rest)) = self.input[usize::from(number) - 1].split_once("\r\n") {
            let (line, rest) = (line.to_string(), rest.to_string());
            println!("{:7.3} s  host {number} < {line:.80}", self.basin.now().as_secs_f64());
            self.input[usize::from(number) - 1] = rest;
            if line.starts_with("$CADRQ") && !self.frames.is_empty() {
                let frame = self.frames.remove(0);
                self.write(&format!("CCTXD,1,2,1,{frame}"));
            }
        }
    }
}
