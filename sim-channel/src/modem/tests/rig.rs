//! Hosts at emulated modems in one basin.

use crate::channel::{Channel, ChannelConfig};
use crate::modem::{Basin, Emulator};
use crate::nodes::{NodeId, NodePosition};
use std::collections::BTreeMap;
use std::time::Duration;

pub(crate) const SECOND: Duration = Duration::from_secs(1);

/// Modems 1, 2, .. on a line, `range_m` apart, and the bytes that their hosts have received.
pub(crate) struct EmulatorRig {
    pub basin: Basin,
    pub received: BTreeMap<u8, Vec<u8>>,
}

impl EmulatorRig {
    pub(crate) fn join(modems: Vec<(u8, Box<dyn Emulator>)>, range_m: f64, config: ChannelConfig) -> Self {
        let mut basin = Basin::new(Channel::new(config, 1));
        let mut received = BTreeMap::new();
        for (index, (node, modem)) in modems.into_iter().enumerate() {
            basin.channel().place(NodeId(node), NodePosition::new(range_m * index as f64, 0.0, 0.0));
            basin.add(NodeId(node), modem);
            received.insert(node, Vec::new());
        }
        Self { basin, received }
    }

    /// Places the modems `range_m` metres apart.
    pub(crate) fn set_spacing(&mut self, range_m: f64) {
        for (index, node) in self.received.keys().enumerate() {
            self.basin.channel().place(NodeId(*node), NodePosition::new(range_m * index as f64, 0.0, 0.0));
        }
    }

    pub(crate) fn write(&mut self, node: u8, bytes: &[u8]) {
        let now = self.basin.now();
        self.basin.handle_host_bytes(NodeId(node), bytes, now);
    }

    pub(crate) fn run(&mut self, length: Duration) {
        let end = self.basin.now() + length;
        while let Some(at) = self.basin.poll_timeout().filter(|at| *at <= end) {
            self.basin.advance(at.max(self.basin.now()));
            self.collect();
        }
        self.basin.advance(end);
        self.collect();
    }

    fn collect(&mut self) {
        for (node, received) in &mut self.received {
            received.extend(self.basin.poll_host_bytes(NodeId(*node)));
        }
    }

    /// Takes the bytes that a host has received since the last call, as text.
    pub(crate) fn take(&mut self, node: u8) -> String {
        let bytes = std::mem::take(self.received.get_mut(&node).expect("node"));
        bytes.iter().map(|byte| char::from(*byte)).collect()
    }

    pub(crate) fn lines(&mut self, node: u8) -> Vec<String> {
        self.take(node).split_terminator("\r\n").map(str::to_string).collect()
    }

    /// Writes a line and returns the reply, after a time too short for anything acoustic.
    pub(crate) fn request(&mut self, node: u8, line: &str) -> String {
        self.take(node);
        self.write(node, line.as_bytes());
        self.run(Duration::from_millis(80) + Duration::from_millis(line.len() as u64));
        self.take(node)
    }
}

/// The first field of each line.
pub(crate) fn keywords(lines: &[String]) -> Vec<&str> {
    lines.iter().map(|line| line.split(',').next().unwrap_or_default()).collect()
}
