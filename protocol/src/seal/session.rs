//! The key of a session, which seals and opens frames.

use super::Tag;
use super::ascon::{Secret, ShortTagged, encrypt, join, mac};
use ascon_aead::aead::{AeadInOut, KeyInit};
use std::fmt;

/// The direction of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Direction {
    /// From the surface to the vehicle.
    Down,
    /// From the vehicle to the surface.
    Up,
}

/// Seals and opens the frames of one session; wiped from memory when dropped.
///
/// A frame has a head, which stays readable, and a body, which an encrypting session encrypts. Both are authenticated,
/// and so are the direction and the number.
///
/// ```
/// use scenecast_protocol::seal::{Direction, MissionKey};
///
/// let key = MissionKey::from_bytes([9; 16]).vehicle(1).session(7, 1, 0xAAAA, 0xBBBB, true);
/// let mut body = *b"hold";
/// let tag = key.seal(Direction::Down, 1, b"head", &mut body);
/// assert_ne!(&body, b"hold", "the session encrypts");
/// assert!(key.open(Direction::Down, 1, b"head", &mut body, &tag));
/// assert_eq!(&body, b"hold");
/// ```
pub struct SessionKey {
    cipher: ShortTagged,
    encrypt: bool,
}

impl SessionKey {
    pub(super) fn new(key: &Secret, encrypt: bool) -> Self {
        Self { cipher: ShortTagged::new(&(**key).into()), encrypt }
    }

    /// The tag of a frame. An encrypting session encrypts `body` in place.
    ///
    /// `number` counts the frames of this direction without wrapping, and must never be used again with other content:
    /// two bodies encrypted under one number would reveal their difference.
    pub fn seal(&self, direction: Direction, number: u64, head: &[u8], body: &mut [u8]) -> Tag {
        let nonce = nonce(direction, number);
        let tag = if self.encrypt {
            encrypt(&self.cipher, &nonce, head, body)
        } else {
            mac(&self.cipher, &nonce, &join(&[head, body]))
        };
        tag.into()
    }

    /// Whether the frame is as it was sealed. If so, an encrypting session decrypts `body` in place.
    ///
    /// If not, an encrypted body is filled with zeros, and any other is left as it was. A tag of a length other than 8
    /// bytes is wrong. Takes the same time for every wrong tag.
    pub fn open(&self, direction: Direction, number: u64, head: &[u8], body: &mut [u8], tag: &[u8]) -> bool {
        let Ok(tag) = Tag::try_from(tag) else {
            if self.encrypt {
                body.fill(0);
            }
            return false;
        };
        let nonce = nonce(direction, number).into();
        let opened = if self.encrypt {
            self.cipher.decrypt_inout_detached(&nonce, head, body.into(), &tag.into())
        } else {
            let nothing: &mut [u8] = &mut [];
            self.cipher.decrypt_inout_detached(&nonce, &join(&[head, body]), nothing.into(), &tag.into())
        };
        opened.is_ok()
    }
}

impl fmt::Debug for SessionKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SessionKey").field("encrypt", &self.encrypt).finish_non_exhaustive()
    }
}

/// The nonce of a frame.
///
/// ```text
/// byte 0           0 down, 1 up
/// bytes 1 to 7     0
/// bytes 8 to 15    number, the most significant byte first
/// ```
fn nonce(direction: Direction, number: u64) -> [u8; 16] {
    let up = u128::from(direction == Direction::Up);
    (up << 120 | u128::from(number)).to_be_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_a_nonce() {
        assert_eq!(nonce(Direction::Down, 0x0102_0304_0506_0708), [0, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(nonce(Direction::Up, 1), [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]);
    }
}
