//! The address of the port of a modem or an instrument.

use std::fmt;
use std::path::PathBuf;

/// Where a modem or an instrument is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PortAddress {
    /// A serial device and its speed, bit/s.
    Serial(String, u32),
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
            Self::Serial(device, baud) => write!(f, "{device} at {baud} bit/s"),
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
