//! The properties of the emulated modem, and whether it runs, receives and accepts messages.

use crate::usbl::UsblConfig;
use std::time::Duration;

/// The command interpreter of a port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Interpreter {
    /// `AT`: raw burst data, with commands escaped by `+++` between them.
    At,
    /// `NET`: commands only, and messages as `RECV..` lines.
    Net,
}

/// The properties of an emulated S2C modem; fixed while it runs.
#[derive(Clone, PartialEq, Debug)]
pub struct S2cConfig {
    /// Local address after the first start, 1..=254.
    pub address: u8,
    /// Remote address of raw data after the first start, 1..=254; 0 for none.
    pub remote: u8,
    /// The command interpreter of the port.
    pub interpreter: Interpreter,
    /// Baud rate, 8N1; `None` without pacing, as over TCP.
    pub baud: Option<u32>,
    /// Raw acoustic bit rate of bursts, bit/s.
    pub bit_rate: u32,
    /// Accuracy of the USBL head; `None` for a modem without a head.
    pub usbl: Option<UsblConfig>,
    /// Whether the head measures angles only: it then reports `USBLANGLES` instead of `USBLLONG`.
    pub angles_only: bool,
    /// Longest one-way travel time for which the modem waits, microseconds.
    pub max_propagation_us: u32,
    /// Whether settings need `AT@CTRL` first, as newer firmware requires.
    pub needs_control: bool,
    /// Time from a reset until the modem accepts bytes, ms.
    pub boot_ms: u32,
    /// Seed of the errors of the head and of the noise that `Fault::Garbage` writes.
    pub seed: u64,
}

impl S2cConfig {
    /// A modem with `address` on a NET port at 19200 baud, without a USBL head.
    #[must_use]
    pub fn new(address: u8) -> Self {
        Self {
            address,
            remote: 0,
            interpreter: Interpreter::Net,
            baud: Some(19_200),
            bit_rate: 13_000,
            usbl: None,
            angles_only: false,
            max_propagation_us: 2_500_000,
            needs_control: false,
            boot_ms: 3_000,
            seed: u64::from(address),
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) enum ReceiverMode {
    #[default]
    Listen,
    Noise,
    Deaf,
}

/// Changed by `ATA`, `ATN` and `ATD`, by a restart, and by the fault `Busy`.
#[derive(Debug, Default)]
pub(crate) struct Condition {
    receiver: ReceiverMode,
    booting: bool,
    refuses_until: Duration,
}

impl Condition {
    pub(crate) fn booting() -> Self {
        Self { booting: true, ..Self::default() }
    }

    pub(crate) fn is_booting(&self) -> bool {
        self.booting
    }

    pub(crate) fn on_booted(&mut self) {
        self.booting = false;
    }

    pub(crate) fn receiver(&self) -> ReceiverMode {
        self.receiver
    }

    pub(crate) fn set_receiver(&mut self, mode: ReceiverMode) {
        self.receiver = mode;
    }

    pub(crate) fn receives(&self) -> bool {
        !self.booting && self.receiver == ReceiverMode::Listen
    }

    pub(crate) fn refuse_until(&mut self, until: Duration) {
        self.refuses_until = until;
    }

    /// The reply to every message command while none is accepted.
    pub(crate) fn refusal(&self, now: Duration) -> Option<&'static str> {
        if now < self.refuses_until {
            return Some("BUSY BACKOFF STATE");
        }
        (self.receiver != ReceiverMode::Listen).then_some("ERROR PHY OFF")
    }
}
