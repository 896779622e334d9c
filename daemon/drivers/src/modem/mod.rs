//! Modems: drivers without IO, and the account of bits on air.
//!
//! | module | is |
//! |---|---|
//! | [`Driver`] | the trait of every driver: bytes in, bytes out |
//! | [`s2c`], [`micromodem`], [`paced`] | the drivers; `paced` is for pipes, TCP and UDP |
//! | [`framing`] | frames in a stream of bytes |
//! | [`Station`] | a driver as the link sees it, shared by rehearsals and processes |

mod driver;
pub mod framing;
pub mod micromodem;
pub mod paced;
pub mod s2c;
mod station;

pub use driver::{
    Class, Destination, Driver, Event, Reception, Refusal, Token, address_book, driver, modem_of_process,
};
pub use station::{AddressBook, ModemEvent, PIPE_FRAMING_BITS, Station};
