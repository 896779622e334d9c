//! What kind of S2C modem is emulated.

use crate::usbl::UsblConfig;

/// Which of the two command interpreters a port has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Interpreter {
    /// `AT`: raw burst data between commands, which are escaped by `+++`.
    At,
    /// `NET`: commands only.
    Net,
}

/// The make of an emulated modem, fixed while it runs.
#[derive(Clone, PartialEq, Debug)]
pub struct S2cConfig {
    /// Local address after the first start, 1..=254.
    pub address: u8,
    /// Remote address of raw data after the first start, 0..=254; 0 for none.
    pub remote: u8,
    /// The interpreter of the port.
    pub interpreter: Interpreter,
    /// Baud rate, 8N1; `None` for TCP.
    pub baud: Option<u32>,
    /// Raw acoustic bit rate of bursts, bit/s.
    pub bit_rate: u32,
    /// A USBL head with that accuracy, or none.
    pub usbl: Option<UsblConfig>,
    /// A head that cannot range tells `USBLANGLES` instead of `USBLLONG`.
    pub angles_only: bool,
    /// Farthest that is waited for, as one-way travel in microseconds.
    pub max_propagation_us: u32,
    /// Whether settings need `AT@CTRL` first, as newer firmware asks.
    pub needs_control: bool,
    /// Time from reset to the first byte.
    pub boot_ms: u32,
    /// Seeds the noise of the head and of the line.
    pub seed: u64,
}

impl S2cConfig {
    /// A modem of that address on a NET port at 19200 baud, without a USBL head.
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
