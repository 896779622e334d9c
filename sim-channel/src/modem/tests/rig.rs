//! Hosts at emulated modems in one water.

use crate::channel::{Channel, ChannelConfig};
use crate::modem::{Basin, Emulator};
use crate::nodes::{NodeId, Position};
use std::collections::BTreeMap;
use std::time::Duration;

pub(crate) const SECOND: Duration = Duration::from_secs(1);

/// Modems 1, 2, .. on a line, `range_m` apart, and everything that their hosts were told.
pub(crate) struct Bench {
    pub basin: Basin,
    pub told: BTreeMap<u8, Vec<u8>>,
}

impl Bench {
    pub(crate) fn join(modems: Vec<(u8, Box<dyn Emulator>)>, range_m: f64, config: ChannelConfig) -> Self {
        let mut basin = Basin::new(Channel::new(config, 1));
        let mut told = BTreeMap::new();
        for (index, (node, modem)) in modems.into_iter().enumerate() {
            basin.channel().place(NodeId(node), Position::new(range_m * index as f64, 0.0, 0.0));
            basin.add(NodeId(node), modem);
            told.insert(node, Vec::new());
        }
        Self { basin, told }
    }

    /// Puts the modems so many metres apart.
    pub(crate) fn channel_range(&mut self, range_m: f64) {
        for (index, node) in self.told.keys().enumerate() {
            self.basin.channel().place(NodeId(*node), Position::new(range_m * index as f64, 0.0, 0.0));
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
        for (node, told) in &mut self.told {
            told.extend(self.basin.poll_host_bytes(NodeId(*node)));
        }
    }

    /// All that was told to a host since last asked, as text.
    pub(crate) fn take(&mut self, node: u8) -> String {
        let bytes = std::mem::take(self.told.get_mut(&node).expect("node"));
        bytes.iter().map(|byte| char::from(*byte)).collect()
    }

    pub(crate) fn lines(&mut self, node: u8) -> Vec<String> {
        self.take(node).split_terminator("\r\n").map(str::to_string).collect()
    }

    /// Writes a line and gives the answer time to come, but nothing acoustic.
    pub(crate) fn ask(&mut self, node: u8, line: &str) -> String {
        self.take(node);
        self.write(node, line.as_bytes());
        self.run(Duration::from_millis(80) + Duration::from_millis(line.len() as u64));
        self.take(node)
    }
}

/// The first words of lines.
pub(crate) fn keywords(lines: &[String]) -> Vec<&str> {
    lines.iter().map(|line| line.split(',').next().unwrap_or_default()).collect()
}
