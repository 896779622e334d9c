//! The key of a mission, and what comes from it.

use super::prf::{Secret, ShortTagged, join, mac, prf};
use super::{SessionKey, Tag};
use ascon_aead::aead::{AeadInOut, KeyInit};
use std::fmt;
use zeroize::Zeroizing;

/// Nonces under the mission key: each is used once, with nothing associated, so what comes from one says nothing of another.
const FINGERPRINT: &[u8; 16] = b"scenecast-print1";
const HELLO: &[u8; 16] = b"scenecast-hello1";
const SESSION: &[u8; 16] = b"scenecast-sessn1";

/// The nonce of every hello tag: under the hello key nothing is ever encrypted, see `prf`.
const HELLO_NONCE: &[u8; 16] = &[0; 16];

/// The secret of a mission, 16 bytes that both ends hold; wiped from memory when dropped.
#[derive(Clone)]
pub struct MissionKey {
    bytes: Secret,
}

impl MissionKey {
    /// A key of 16 bytes; they must come from the operating system's random source.
    pub fn from_bytes(bytes: [u8; 16]) -> Self {
        Self { bytes: Zeroizing::new(bytes) }
    }

    pub(super) fn bytes(&self) -> &[u8; 16] {
        &self.bytes
    }

    /// 32 bits by which people see that both ends hold the same key; they do not give the key away.
    pub fn fingerprint(&self) -> u32 {
        let [a, b, c, d, ..] = *prf(&self.bytes, FINGERPRINT, &[]);
        u32::from_be_bytes([a, b, c, d])
    }

    /// The tag of a frame that says hello, over `parts` and where each of them ends.
    ///
    /// It proves a holder of the key, not the present: parts heard again verify again.
    pub fn hello_tag(&self, parts: &[&[u8]]) -> Tag {
        mac(&self.hello_cipher(), HELLO_NONCE, &join(parts)).into()
    }

    /// Whether `tag` is the one of `parts`; takes the same time for every wrong tag.
    pub fn verify_hello(&self, parts: &[&[u8]], tag: &Tag) -> bool {
        let tag = (*tag).into();
        let nothing: &mut [u8] = &mut [];
        self.hello_cipher().decrypt_inout_detached(&(*HELLO_NONCE).into(), &join(parts), nothing.into(), &tag).is_ok()
    }

    fn hello_cipher(&self) -> ShortTagged {
        ShortTagged::new(&(*prf(&self.bytes, HELLO, &[])).into())
    }

    /// The key of one pair of runs: of the surface that drew `surface_nonce` and of `vehicle` that drew `vehicle_nonce`.
    ///
    /// Each end draws its 64 bits at random when it starts. While one of the two is fresh the key is new, so neither
    /// end accepts frames of an earlier run, and none is encrypted twice under the same nonce.
    pub fn session(
        &self,
        mission: u32,
        vehicle: u8,
        surface_nonce: u64,
        vehicle_nonce: u64,
        encrypt: bool,
    ) -> SessionKey {
        let root = prf(&self.bytes, SESSION, &[]);
        let nonce = (u128::from(surface_nonce) << 64 | u128::from(vehicle_nonce)).to_be_bytes();
        let [a, b, c, d] = mission.to_be_bytes();
        SessionKey::new(&prf(&root, &nonce, &[a, b, c, d, vehicle, u8::from(encrypt)]), encrypt)
    }
}

impl fmt::Debug for MissionKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MissionKey({:08x})", self.fingerprint())
    }
}
