//! Emulated modems: what a host sees at the serial or TCP port, and what they put on the shared water.
//!
//! An emulator is a state machine without IO: host bytes and acoustic arrivals go in with a `now`, host bytes and
//! transmissions come out. [`Basin`] joins several of them by a [`Channel`](crate::Channel).

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

mod agenda;
mod basin;
#[cfg(test)]
mod bench;
mod crc;
mod fault;
#[cfg(test)]
mod flood;
pub mod micromodem;
mod port;
pub mod s2c;
pub mod transparent;

pub use basin::Basin;
pub use fault::Fault;
pub use port::Port;

use crate::{Arrival, Duration, Onset};

/// An emulated modem.
pub trait Emulator: Send {
    /// The line to the host.
    fn port(&self) -> &Port;

    /// The line to the host.
    fn port_mut(&mut self) -> &mut Port;

    /// Takes what the host wrote. What does not fit into `host_room` is lost, as on a line without flow control.
    fn handle_host_bytes(&mut self, bytes: &[u8], now: Duration) {
        self.port_mut().accept(bytes, now);
        self.handle_timeout(now);
    }

    /// How many bytes the host may write now.
    fn host_room(&self) -> usize {
        self.port().room()
    }

    /// What has reached the host by `now`, paced by the baud rate.
    fn poll_host_bytes(&mut self, now: Duration) -> Vec<u8> {
        self.port_mut().poll_output(now)
    }

    /// When `poll_host_bytes` has something to give.
    fn poll_host_timeout(&self) -> Option<Duration> {
        self.port().next_output()
    }

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
