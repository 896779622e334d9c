//! The interface of every emulated modem, and the parts that all makes of modem share.

pub(crate) mod board;
pub(crate) mod crc;
mod fault;
mod serial_line;
mod task_queue;

pub use fault::Fault;

use crate::channel::{Arrival, Onset};
use std::time::Duration;

/// One of the hosts at a modem: a TCP port takes several, a serial line has the first alone.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct Host(u32);

impl Host {
    /// The host that is always there.
    pub const FIRST: Host = Host(0);
}

/// An emulated modem.
pub trait Emulator: Send {
    /// Another host at the same port: it gets every notification, and the answers to what it asks itself.
    fn attach(&mut self) -> Host;

    /// The host is gone.
    fn detach(&mut self, host: Host);

    /// Takes what a host wrote. What does not fit into `host_room` is lost, as on a line without flow control.
    fn handle_host_bytes(&mut self, host: Host, bytes: &[u8], now: Duration);

    /// How many bytes a host may write now.
    fn host_room(&self, host: Host) -> usize;

    /// What has reached a host by `now`, paced by the baud rate.
    fn poll_host_bytes(&mut self, host: Host, now: Duration) -> Vec<u8>;

    /// When `poll_host_bytes` has something to give for any host.
    fn poll_host_timeout(&self) -> Option<Duration>;

    /// Takes the beginning of a signal at this modem. Without it the beginning is told together with the end.
    fn handle_onset(&mut self, onset: &Onset, now: Duration);

    /// Takes the end of a reception at this modem, heard or not.
    fn handle_arrival(&mut self, arrival: &Arrival, now: Duration);

    /// What the modem puts on air at `now`; call until `None`, after every other call.
    fn poll_transmit(&mut self, now: Duration) -> Option<Transmission>;

    /// What the surroundings of the modem must do; call until `None`, after every other call.
    fn poll_event(&mut self) -> Option<ModemEvent>;

    /// When `handle_timeout` has something to do.
    fn poll_timeout(&self) -> Option<Duration>;

    /// Lets time pass.
    fn handle_timeout(&mut self, now: Duration);

    /// Breaks something.
    fn inject(&mut self, fault: Fault, now: Duration);
}

/// Bytes to put on air, and how long they take.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmission {
    /// What the other emulators of this kind understand.
    pub bytes: Vec<u8>,
    /// From the first wave to the last.
    pub airtime: Duration,
}

/// What an emulator asks of whoever holds its port and its transducer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ModemEvent {
    /// Close the TCP connection of the host; a serial line stays open.
    HangUp,
    /// The transmission on air ended in the middle: nobody can read it.
    CutShort,
}
