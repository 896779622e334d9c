//! The parts that every service of the modem uses: configuration, settings, the port to the hosts and the transmitter.
//!
//! A service (instant messages, bursts, reception, positions) owns its own state and borrows this base for the length of
//! one call. The base never calls a service.

mod config;
mod frame;
mod settings;
pub(crate) mod timing;
mod transmitter;

use crate::modem::emulator::board::ModemBoard;
use crate::modem::emulator::{HostId, Transmission};
use crate::modem::s2c::input::{HostInput, InputParser, ReadMode};
use crate::random::RandomStream;
pub(crate) use config::{Condition, ReceiverMode};
pub use config::{Interpreter, S2cConfig};
pub(crate) use frame::{FrameKind, Network, PendingFix, ReceivedSignal, S2cFrame, VELOCITY};
pub(crate) use settings::{PortOptions, SettingError, Settings};
use std::collections::BTreeMap;
use std::time::Duration;
pub(crate) use transmitter::{AfterSending, QueuedFrame, S2cTask, Transmitter};

/// Settings, port, transmitter and clock of one emulated S2C.
#[derive(Debug)]
pub(crate) struct S2cBase {
    pub config: S2cConfig,
    pub board: ModemBoard<S2cTask>,
    pub port: CommandPort,
    pub settings: Settings,
    /// The settings that `AT&W` saved; a restart loads them.
    pub stored: Settings,
    pub options: PortOptions,
    pub condition: Condition,
    pub transmitter: Transmitter,
    /// Physical clock of the modem minus virtual time.
    clock_offset: Duration,
}

impl S2cBase {
    pub(crate) fn new(config: S2cConfig) -> Self {
        const PURPOSE: u64 = 0x52c;
        let settings = Settings::factory(config.address, config.remote);
        Self {
            board: ModemBoard::new(config.baud, RandomStream::new(config.seed, &[PURPOSE])),
            port: CommandPort::new(config.interpreter),
            stored: settings.clone(),
            settings,
            options: PortOptions::default(),
            condition: Condition::default(),
            transmitter: Transmitter::default(),
            clock_offset: Duration::ZERO,
            config,
        }
    }

    pub(crate) fn address(&self) -> u8 {
        self.settings.byte("AL")
    }

    /// The modem's physical clock in microseconds; 32 bits, so that it wraps every 71.6 minutes.
    pub(crate) fn clock_us(&self, now: Duration) -> u32 {
        self.clock(now).as_micros() as u32
    }

    pub(crate) fn clock(&self, now: Duration) -> Duration {
        now + self.clock_offset
    }

    /// Makes the clock show `time` at `now`, or `now` if `time` is earlier.
    pub(crate) fn set_clock(&mut self, time: Duration, now: Duration) {
        self.clock_offset = time.saturating_sub(now);
    }

    /// The properties that decide which modems receive this one.
    pub(crate) fn network(&self) -> Network {
        Network {
            highest: self.settings.byte("AM"),
            carrier: self.settings.byte("C"),
            packet_ms: u16::try_from(self.settings.get("ZP")).unwrap_or(u16::MAX),
        }
    }

    /// A frame to `dst` without payload.
    pub(crate) fn frame(&self, kind: FrameKind, dst: u8) -> S2cFrame {
        S2cFrame::new(kind, self.address(), dst, self.network())
    }

    /// Whether a message may be sent to `dst`: to another node of the network, or to 255 where broadcast is allowed.
    pub(crate) fn may_address(&self, dst: u8, broadcast_allowed: bool) -> bool {
        let node = (1..=self.settings.byte("AM")).contains(&dst) && dst != self.address();
        node || (dst == 255 && broadcast_allowed)
    }

    /// The protocol id of a command, or the one that `!ZS` sets.
    pub(crate) fn protocol_id(&self, pid: Option<u8>) -> u8 {
        pid.unwrap_or_else(|| self.settings.byte("ZS"))
    }

    /// Time that `packets` full data packets take on air.
    pub(crate) fn packet_time(&self, packets: u8) -> Duration {
        Duration::from_millis(u64::from(self.settings.get("ZP"))) * u32::from(packets)
    }

    /// Replies to the command `name` (without its parameters); only the host that wrote it receives the reply.
    pub(crate) fn reply(&mut self, name: &str, body: impl AsRef<[u8]>, now: Duration) {
        let line = self.port.line(name, body.as_ref());
        self.board.write_to(self.port.requester(), &line, now);
    }

    /// A reply that is never wrapped: `ERROR WRONG FORMAT` in command mode, and the `OK` of an escape.
    pub(crate) fn reply_unwrapped(&mut self, body: &str, now: Duration) {
        self.board.write_to(self.port.requester(), format!("{body}\r\n").as_bytes(), now);
    }

    /// Sends a notification to every host.
    pub(crate) fn notify(&mut self, body: impl AsRef<[u8]>, now: Duration) {
        let line = self.port.line("", body.as_ref());
        self.board.write_to_all(&line, now);
    }

    /// Sends a notification if `@ZX1` has switched the extended ones on.
    pub(crate) fn notify_extended(&mut self, body: impl AsRef<[u8]>, now: Duration) {
        if self.options.extended() {
            self.notify(body, now);
        }
    }

    /// Queues a frame behind those that wait for the transducer.
    pub(crate) fn send(&mut self, frame: S2cFrame, airtime: Duration, label: &'static str, then: AfterSending) {
        self.transmitter.push(QueuedFrame { frame, airtime, label, then });
    }

    /// The next frame, if the transducer is free and the modem has booted.
    pub(crate) fn begin_transmission(&mut self, now: Duration) -> Option<Transmission> {
        if self.condition.is_booting() {
            return None;
        }
        let QueuedFrame { frame, airtime, label, then } = self.transmitter.begin(now)?;
        self.notify_extended(format!("SENDSTART,{},{label},{},0", frame.dst, airtime.as_micros()), now);
        self.board.schedule(now + airtime, S2cTask::Sent { dst: frame.dst, label, airtime, then });
        Some(Transmission { bytes: frame.encode(), airtime })
    }
}

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
