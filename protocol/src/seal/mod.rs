//! The cryptography of authentic frames: keys and tags.
//!
//! All of it uses one primitive, Ascon-AEAD128 (NIST SP 800-232): for frames as the standard defines it, for sub-keys
//! and tags as the function `prf` in `ascon.rs` explains.
//!
//! ```text
//! mission key (16 secret bytes, the surface's key file)
//!   |-- fingerprint     32 bits for people
//!   |-- key of calls    tags of the calls to all vehicles
//!   +-- key of a vehicle, by its address (with that of calls: the vehicle's key file)
//!         |-- key stream      hides the next key of the vehicle, while it is offered
//!         |-- hello key       tags of frames that are sent before both ends know each other's run
//!         +-- session root
//!               +-- session key     one pair of runs of one surface and one vehicle, encrypted or not
//!                     +-- tags and encryption of frames, by direction and frame number
//! ```

mod ascon;
mod key;
mod session;
mod text;

pub use key::{HeldKey, KeyOffer, LinkKey, MissionKey, VehicleKey};
pub use session::{Direction, SessionKey};
pub use text::{KeyError, KeyFile};

/// The proof that a frame comes from a holder of the key: the first 8 of the 16 tag bytes of Ascon-AEAD128.
///
/// A guess succeeds with probability 2^-64. SP 800-232 permits truncated tags.
pub type Tag = [u8; TAG_BYTES];

/// The length of a [`Tag`] in bytes.
pub const TAG_BYTES: usize = 8;

#[cfg(test)]
mod tests;
