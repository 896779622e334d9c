//! The address of the port of a modem or an instrument.

use std::fmt;
use std::path::PathBuf;

/// Data bits, parity and stop bits of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SerialFormat {
    #[default]
    EightNoneOne,
    EightNoneTwo,
    EightEvenOne,
    EightOddOne,
    SevenEvenOne,
    SevenOddOne,
}

impl SerialFormat {
    pub const ALL: [Self; 6] = [
        Self::EightNoneOne,
        Self::EightNoneTwo,
        Self::EightEvenOne,
        Self::EightOddOne,
        Self::SevenEvenOne,
        Self::SevenOddOne,
    ];

    /// The usual short form.
    pub fn name(self) -> &'static str {
        match self {
            Self::EightNoneOne => "8N1",
            Self::EightNoneTwo => "8N2",
            Self::EightEvenOne => "8E1",
            Self::EightOddOne => "8O1",
            Self::SevenEvenOne => "7E1",
            Self::SevenOddOne => "7O1",
        }
    }
}

/// How a serial device stops the other end from sending.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FlowControl {
    #[default]
    None,
    /// By the lines RTS and CTS.
    Hardware,
    /// By the bytes XON and XOFF.
    Software,
}

impl FlowControl {
    pub const ALL: [Self; 3] = [Self::None, Self::Hardware, Self::Software];

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Hardware => "hardware",
            Self::Software => "software",
        }
    }
}

/// A serial line: its speed, and how bytes go over it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SerialLine {
    /// Speed, bit/s.
    pub baud: u32,
    pub format: SerialFormat,
    pub flow: FlowControl,
    /// Whether the line RTS is up, where flow control does not use it.
    pub rts: bool,
    /// Whether the line DTR is up.
    pub dtr: bool,
}

impl SerialLine {
    /// A usual line of this speed: 8N1 without flow control, RTS down and DTR up.
    pub fn of_speed(baud: u32) -> Self {
        Self { baud, format: SerialFormat::default(), flow: FlowControl::default(), rts: false, dtr: true }
    }
}

impl fmt::Display for SerialLine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bit/s", self.baud)?;
        if self.format != SerialFormat::default() {
            write!(f, " {}", self.format.name())?;
        }
        if self.flow != FlowControl::default() {
            write!(f, " with {} flow control", self.flow.name())?;
        }
        Ok(())
    }
}

/// Where a modem or an instrument is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PortAddress {
    /// A serial device.
    Serial(String, SerialLine),
    /// An address to listen on.
    Listen(String),
    /// An address to connect to.
    Connect(String),
    /// Datagrams: an address to receive at, and one to send to; without the first any port, without the second
    /// to the sender that is listened to.
    Datagrams(String, String),
    /// A file to append to.
    File(PathBuf),
}

impl fmt::Display for PortAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(device, line) => write!(f, "{device} at {line}"),
            Self::Listen(address) => write!(f, "listening on {address}"),
            Self::Connect(address) => f.write_str(address),
            Self::Datagrams(own, remote) => {
                let or_any = |text: &str| if text.is_empty() { "any" } else { text }.to_owned();
                write!(f, "datagrams, own address {}, to {}", or_any(own), or_any(remote))
            }
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}
