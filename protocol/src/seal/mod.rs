//! The cryptography of authentic frames: keys, tags, and nothing of the frames themselves.
//!
//! One primitive does all: Ascon-AEAD128 (NIST SP 800-232), as `prf.rs` says for sub-keys and tags and as the
//! standard says for frames.
//!
//! ```text
//! mission key (16 secret bytes, the key file)
//!   |-- fingerprint     32 bits for people
//!   |-- hello key       tags of frames that are sent before both ends know each other's run
//!   +-- session root
//!         +-- session key     one pair of runs of one surface and one vehicle, encrypted or not
//!               +-- tags and encryption of frames, by direction and frame number
//! ```

mod key;
mod prf;
mod session;
mod text;

#[cfg(test)]
mod tests;

pub use key::MissionKey;
pub use session::{Direction, SessionKey};
pub use text::KeyError;

/// What proves that a frame comes from a holder of the key: the first 8 bytes of the 16 of Ascon-AEAD128.
///
/// A guess is right once in 2^64. A truncated tag is one of the options of SP 800-232.
pub type Tag = [u8; TAG_BYTES];

/// Bytes of a [`Tag`].
pub const TAG_BYTES: usize = 8;
