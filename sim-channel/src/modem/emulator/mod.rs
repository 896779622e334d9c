//! The interface of every emulated modem, the faults that are injected into one, and the parts that all makes share.

pub(crate) mod board;
mod serial_line;

use crate::channel::{Arrival, Onset};
use std::time::Duration;

/// One of the hosts at a modem. A TCP port takes several hosts, a serial line only the first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct HostId(u32);

impl HostId {
    /// The host that is always attached.
    pub const FIRST: HostId = HostId(0);
}

/// An emulated modem, driven by its host, by the channel and by time.
///
/// ```text
///   host bytes  -> handle_host_bytes   +----------+   poll_host_bytes -> host bytes
///   arrivals    -> handle_arrival      | Emulator |   poll_transmit   -> channel
///   time        -> handle_timeout      +----------+   poll_timeout    -> next call
/// ```
///
/// Every `now` is the time since the start of the run and never goes back. [`Basin`](super::Basin) drives several
/// emulators on one channel.
///
/// ```
/// use sim_channel::Duration;
/// use sim_channel::modem::s2c::{S2c, S2cConfig};
/// use sim_channel::modem::{Emulator, HostId};
///
/// let mut modem = S2c::new(S2cConfig { baud: None, ..S2cConfig::new(5) });
/// modem.handle_host_bytes(HostId::FIRST, b"AT?AL\r", Duration::ZERO);
/// assert_eq!(modem.poll_host_bytes(HostId::FIRST, Duration::ZERO), b"5\r\n");
/// ```
pub trait Emulator: Send {
    /// Attaches another host to the port. It receives every notification, and the replies to its own commands.
    fn attach(&mut self) -> HostId;

    /// Detaches a host; the first host always stays.
    fn detach(&mut self, host: HostId);

    /// Takes bytes that a host wrote.
    ///
    /// Bytes beyond [`host_room`](Self::host_room) are lost, as on a line without flow control.
    fn handle_host_bytes(&mut self, host: HostId, bytes: &[u8], now: Duration);

    /// Number of bytes that a host may write now.
    #[must_use]
    fn host_room(&self, host: HostId) -> usize;

    /// Takes the bytes that have reached a host by `now`, paced by the baud rate.
    #[must_use]
    fn poll_host_bytes(&mut self, host: HostId, now: Duration) -> Vec<u8>;

    /// Time at which more bytes will have reached any host; `None` if none are on their way.
    #[must_use]
    fn poll_host_timeout(&self) -> Option<Duration>;

    /// Takes the beginning of a signal at this modem.
    ///
    /// Without this call the modem reports the beginning of the signal together with its end.
    fn handle_onset(&mut self, onset: &Onset, now: Duration);

    /// Takes the end of a reception at this modem, delivered or lost.
    fn handle_arrival(&mut self, arrival: &Arrival, now: Duration);

    /// The next transmission that the modem puts on air at `now`; call until `None`, after every other call.
    #[must_use]
    fn poll_transmit(&mut self, now: Duration) -> Option<Transmission>;

    /// The next event for the owner of port and transducer; call until `None`, after every other call.
    #[must_use]
    fn poll_event(&mut self) -> Option<ModemEvent>;

    /// Time at which [`handle_timeout`](Self::handle_timeout) must be called; `None` if no task is scheduled.
    #[must_use]
    fn poll_timeout(&self) -> Option<Duration>;

    /// Passes time up to `now` and runs the tasks that are due.
    fn handle_timeout(&mut self, now: Duration);

    /// Injects a fault at `now`.
    fn inject(&mut self, fault: Fault, now: Duration);
}

/// A frame to put on air.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// The frame, in the layout that emulators of the same kind share.
    pub bytes: Vec<u8>,
    /// Length of the signal, from its first wave to its last.
    pub airtime: Duration,
}

/// An action that an emulator requests from the owner of its port and transducer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum ModemEvent {
    /// Close the TCP connections of the hosts; a serial line stays open.
    HangUp,
    /// The transmission on air has ended in the middle; no receiver can decode it.
    CutShort,
}

/// A fault to inject; durations count from the moment of injection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Fault {
    /// Refuses every message for this long, with `BUSY` (S2C) or an error (Micromodem).
    Busy(Duration),
    /// Restarts; settings that were not stored and queued messages are lost.
    Reboot,
    /// Sends this many bytes of noise to each host.
    Garbage(u16),
    /// Drops the rear half of the bytes that are on their way to each host.
    HalfLine,
    /// Neither reads nor writes for this long; the bytes that wait come afterwards.
    Freeze(Duration),
    /// Uses this address instead of the configured one.
    WrongAddress(u8),
    /// The supply fails: a transmission is cut short, then the modem restarts.
    BrownOut,
    /// Accepts up to a megabyte of data before it reports a full buffer.
    BigBuffer,
}
