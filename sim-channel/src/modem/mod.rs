//! Emulated modems, with the serial or TCP port that a host sees and the signals on the shared channel.
//!
//! An emulator is a state machine without IO: host bytes and acoustic arrivals go in with a `now`, host bytes and
//! transmissions come out. [`Basin`] joins several of them by a [`Channel`](crate::Channel).
//!
//! | module | modem |
//! |---|---|
//! | [`s2c`] | EvoLogics S2C: instant messages and burst connections, AT and NET interpreters, USBL |
//! | [`micromodem`] | WHOI Micromodem 1 and 2: NMEA sentences, cycles at rates 0 to 6, flexible data, pings |
//! | [`transparent`] | a raw byte pipe |

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

mod basin;
mod emulator;
pub mod micromodem;
pub mod s2c;
#[cfg(test)]
mod tests;
pub mod transparent;

pub use basin::Basin;
pub use emulator::{Emulator, Fault, HostId, ModemEvent, Transmission};
