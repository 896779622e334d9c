//! Modems: drivers without IO, and the account of bits on air.
//!
//! | module | is |
//! |---|---|
//! | [`Driver`] | the trait of every driver: bytes in, bytes out |
//! | [`s2c`], [`micromodem`], [`paced`] | the drivers; `paced` is for pipes, TCP and UDP |
//! | [`framing`] | frames in a stream of bytes |
//! | [`PortListener`] | what is wrong at a port whose modem does not get ready |
//! | [`Station`] | a driver as the link sees it, shared by rehearsals and processes |

mod configured;
mod driver;
pub mod framing;
mod listener;
pub mod micromodem;
pub mod paced;
pub mod s2c;
mod station;

pub use configured::{address_book, driver, modem_of_process};
pub use driver::{Class, Destination, Driver, Event, Reception, Refusal, Token};
pub use listener::{PortFinding, PortListener, Speaker};
pub use station::{AddressBook, ModemEvent, PIPE_FRAMING_BITS, Station};
