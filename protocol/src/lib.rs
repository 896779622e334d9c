//! The protocol between the two ends of scenecast: wire format, map coding, replicated state, link, schedule and medium
//! access.
//!
//! The crate does no IO: bytes and time come in as arguments, and frames and events come out of `poll_` functions. A
//! host drives one end, [`link::VehicleLink`] or [`link::SurfaceLink`], in a loop:
//!
//! 1. It hands in what has happened: `handle_frame` for received bytes, `handle_transmit_outcome` when the modem is
//!    done.
//! 2. It takes events from `poll_event` until there are none.
//! 3. It takes the next frame from `poll_transmit`, if there is one, and gives it to the modem.
//! 4. It sleeps until the next input, or until the time that `poll_timeout` names.

#![warn(missing_docs)]
// Received bytes must not panic. Modules that index state the reason where they are declared.
#![cfg_attr(
    not(test),
    deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

mod bytes;
pub mod coordinates;
pub mod directive;
pub mod exemplar;
#[allow(clippy::indexing_slicing)] // A cell's place is less than the size of its tile.
mod grid;
pub mod link;
pub mod mac;
pub mod map;
pub mod map_codec;
pub mod object;
mod random;
pub mod schedule;
pub mod seal;
pub mod time;
pub mod wire;
