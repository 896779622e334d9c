//! Modems: drivers without IO, and the account of what goes on air.
//!
//! | module | is |
//! |---|---|
//! | [`Driver`] | what every driver is: bytes in, bytes out |
//! | [`s2c`], [`micromodem`], [`paced`] | the drivers; `paced` is for pipes, TCP and UDP |
//! | [`framing`] | frames in a stream of bytes |
//! | [`Station`] | a driver as the link sees it; what rehearsals and processes share |

mod driver;
pub mod framing;
mod kinds;
pub mod micromodem;
pub mod paced;
pub mod s2c;
mod station;

pub use driver::{Class, Destination, Driver, Event, Reception, Refusal, Token};
pub use kinds::{address_book, driver, modem_of_process};
pub use station::{AddressBook, ModemEvent, PIPE_FRAMING_BITS, Station};
