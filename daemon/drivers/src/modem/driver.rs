//! The trait of every modem driver: bytes in, bytes out, no IO.

use bytes::Bytes;
use scenecast_core::{ModemAddress, UsblLine};
use scenecast_protocol::link::Cycle;
use scenecast_protocol::mac::ModemProfile;
use scenecast_protocol::time::Instant;

/// Names a transmission from [`Driver::send`] to its end.
pub type Token = u64;

/// How urgent a transmission is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Urgent: never queued behind bulk in the modem.
    Command,
    /// Acknowledgements: a later one replaces an earlier one that was not sent.
    Service,
    /// The rest, in the order in which it was given.
    Bulk,
}

/// Whom a transmission is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Destination {
    Modem(ModemAddress),
    Everybody,
}

/// Why a transmission is not taken.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// It is larger than the modem carries.
    #[error("a frame of {bytes} bytes is larger than the modem's {most}")]
    TooLong { bytes: usize, most: usize },
    #[error("a frame without bytes")]
    Empty,
    /// The modem cannot reach this destination.
    #[error("{0:?} is no address that this modem can send to: {1}")]
    NoSuchAddress(Destination, &'static str),
    /// The modem is not there, or not yet set up.
    #[error("the modem is not ready")]
    NotReady,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reception {
    /// The sender; `None` where the modem does not report it.
    pub src: Option<ModemAddress>,
    pub bytes: Bytes,
    /// Signal quality in the modem's unit; higher is better.
    pub quality: Option<i32>,
    /// Slant range to the sender, metres.
    pub range_m: Option<f64>,
}

/// An event of a driver.
///
/// Each accepted token gets one of `Sent` (if it is not acknowledged), `Delivered`, `Failed` and `Unknown`.
#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The modem is set up: it takes transmissions.
    Ready,
    /// The modem took the transmission.
    Accepted(Token),
    /// The modem refuses for now; the driver tries again.
    Busy(Token),
    /// It has left the transducer.
    Sent(Token),
    /// The other modem has it.
    Delivered(Token),
    /// It did not get there.
    Failed(Token),
    Unknown(Token),
    Received(Reception),
    /// A position of another modem.
    Usbl(UsblLine),
    /// The modem asks for at most so many frames of a cycle ([`scenecast_protocol::mac::Access::Polled`]).
    Poll(u32),
    /// Bits on air of the modem's own repeats.
    Repeated(u64),
    /// The modem or its port was lost, with all that it held. [`Self::Ready`] follows when it is back.
    Reset,
    /// Something that a person must change, in his words: a wrong address, a setting that is not taken.
    Refused(String),
}

/// A driver: a state machine between the link and the bytes of a port.
///
/// The host handles all events before it polls output: the link's frames answer the modem's requests.
pub trait Driver: Send {
    /// How the medium is shared, and units of transmission.
    fn profile(&self) -> ModemProfile;

    fn is_ready(&self) -> bool;

    fn send(&mut self, dst: Destination, bytes: Vec<u8>, class: Class, now: Instant) -> Result<Token, Refusal>;

    /// Whether a cycle may begin; only modems that poll have any.
    fn may_begin_cycle(&self, _now: Instant) -> bool {
        false
    }

    /// Has the modem begin a cycle between these two.
    fn begin_cycle(&mut self, _from: ModemAddress, _to: Destination, _cycle: Cycle, _now: Instant) {}

    fn handle_open(&mut self, now: Instant);

    /// The port was closed, or failed.
    fn handle_closed(&mut self, now: Instant);

    fn handle_bytes(&mut self, bytes: &[u8], now: Instant);

    fn handle_timeout(&mut self, now: Instant);

    /// When [`Self::handle_timeout`] has something to do.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Bytes for the port; to be asked until there are none, after everything else.
    fn poll_output(&mut self, now: Instant) -> Option<Vec<u8>>;

    fn poll_event(&mut self) -> Option<Event>;

    /// Whether the port has been silent for so long that it should be opened again.
    fn wants_reopening(&self, _now: Instant) -> bool {
        false
    }
}

/// Bytes of a frame that `most` allows.
pub(super) fn check_length(bytes: usize, most: usize) -> Result<(), Refusal> {
    match bytes {
        0 => Err(Refusal::Empty),
        _ if bytes > most => Err(Refusal::TooLong { bytes, most }),
        _ => Ok(()),
    }
}
