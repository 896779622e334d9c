//! The command port: the input of each host, the mode of the port, and the form of the lines it writes.

use super::Interpreter;
use crate::modem::emulator::HostId;
use crate::modem::s2c::input::{HostInput, InputParser, ReadMode};
use std::collections::BTreeMap;
use std::time::Duration;

/// Whether a port of the `AT` interpreter passes raw data.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum PortMode {
    Data,
    Command,
}

#[derive(Debug)]
pub(crate) struct CommandPort {
    interpreter: Interpreter,
    mode: PortMode,
    parsers: BTreeMap<HostId, InputParser>,
    /// The host whose command is being carried out.
    requester: HostId,
}

impl CommandPort {
    pub(crate) fn new(interpreter: Interpreter) -> Self {
        Self { interpreter, mode: PortMode::Data, parsers: BTreeMap::new(), requester: HostId::FIRST }
    }

    pub(crate) fn requester(&self) -> HostId {
        self.requester
    }

    pub(crate) fn set_mode(&mut self, mode: PortMode) {
        self.mode = mode;
    }

    pub(crate) fn in_data_mode(&self) -> bool {
        self.interpreter == Interpreter::At && self.mode == PortMode::Data
    }

    /// Takes bytes of a host, which becomes the requester.
    pub(crate) fn push(&mut self, host: HostId, bytes: &[u8], at: Duration) {
        self.requester = host;
        self.parsers.entry(host).or_default().push(bytes, at);
    }

    /// The next complete input of a host; a command may change how the rest is read.
    pub(crate) fn next_input(&mut self, host: HostId) -> Option<HostInput> {
        let mode = self.read_mode();
        self.parsers.get_mut(&host)?.next(mode)
    }

    /// The time at which silence gives the unfinished input of a host another meaning.
    pub(crate) fn timeout(&self, host: HostId) -> Option<Duration> {
        self.parsers.get(&host).and_then(|parser| parser.timeout(self.read_mode()))
    }

    pub(crate) fn handle_timeout(&mut self, host: HostId, at: Duration) -> Option<HostInput> {
        let mode = self.read_mode();
        self.requester = host;
        self.parsers.get_mut(&host).and_then(|parser| parser.handle_timeout(at, mode))
    }

    pub(crate) fn forget(&mut self, host: HostId) {
        self.parsers.remove(&host);
    }

    /// A line to a host: plain, or wrapped as `+++AT<name>:<length>:<body>` while the port is in data mode.
    pub(crate) fn line(&self, name: &str, body: &[u8]) -> Vec<u8> {
        let mut line = Vec::with_capacity(body.len() + 24);
        if self.in_data_mode() {
            line.extend(format!("+++AT{name}:{}:", body.len()).bytes());
        }
        line.extend(body);
        line.extend(b"\r\n");
        line
    }

    fn read_mode(&self) -> ReadMode {
        if self.in_data_mode() { ReadMode::Data } else { ReadMode::Commands }
    }
}
