//! Emulated modems: what a host sees at the serial or TCP port, and what they put on the shared channel.
//!
//! An emulator is a state machine without IO: host bytes and acoustic arrivals go in with a `now`, host bytes and
//! transmissions come out. [`Basin`] joins several of them by a [`Channel`](crate::Channel).

#![cfg_attr(not(test), deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used))]

mod basin;
mod emulator;
pub mod micromodem;
pub mod s2c;
#[cfg(test)]
mod tests;
pub mod transparent;

pub use basin::Basin;
pub use emulator::{Emulator, Fault, Host, ModemEvent, Transmission};
