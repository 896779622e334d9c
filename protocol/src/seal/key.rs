//! The mission key, the keys of vehicles that are derived from it, and those derived from these.

use super::ascon::{Secret, ShortTagged, join, mac, prf};
use super::{SessionKey, Tag};
use ascon_aead::aead::{AeadInOut, KeyInit};
use std::fmt;
use zeroize::Zeroizing;

/// Nonces under the mission key. Each is used once with the same data, so that the results are independent.
const FINGERPRINT: &[u8; 16] = b"scenecast-print1";
const VEHICLE: &[u8; 16] = b"scenecast-vehic1";
const CALL: &[u8; 16] = b"scenecast-calls1";

/// Nonces under the key of a vehicle or of the calls, likewise.
const HELLO: &[u8; 16] = b"scenecast-hello1";
const SESSION: &[u8; 16] = b"scenecast-sessn1";
const NONCE: &[u8; 16] = b"scenecast-nonce1";

/// The nonce of every hello tag. The hello key encrypts no data; see `prf`.
const HELLO_NONCE: &[u8; 16] = &[0; 16];

/// The secret of a mission, 16 bytes that the surface holds; wiped from memory when dropped.
///
/// ```
/// use scenecast_protocol::seal::MissionKey;
///
/// let key = MissionKey::from_bytes(*b"0123456789abcdef");
/// let file = key.to_text();
/// assert!(file.starts_with("scenecast-key 2 30313233"));
/// let read = MissionKey::parse(&file)?;
/// assert_eq!(read.fingerprint(), key.fingerprint());
/// # Ok::<(), scenecast_protocol::seal::KeyError>(())
/// ```
#[derive(Clone)]
pub struct MissionKey {
    bytes: Secret,
}

impl MissionKey {
    /// A key of 16 bytes, which must come from the operating system's random source.
    pub fn from_bytes(bytes: [u8; 16]) -> Self {
        Self { bytes: Zeroizing::new(bytes) }
    }

    pub(super) fn bytes(&self) -> &[u8; 16] {
        &self.bytes
    }

    /// 32 bits by which people check that both ends hold the same key; they do not reveal it.
    pub fn fingerprint(&self) -> u32 {
        let [a, b, c, d, ..] = *prf(&self.bytes, FINGERPRINT, &[]);
        u32::from_be_bytes([a, b, c, d])
    }

    /// The key of a vehicle, by its address. It reveals neither the mission key nor the key of another vehicle.
    pub fn vehicle(&self, address: u8) -> LinkKey {
        LinkKey { bytes: prf(&self.bytes, VEHICLE, &[address]) }
    }

    /// The key of discovery calls, which all vehicles hold.
    pub fn calls(&self) -> LinkKey {
        LinkKey { bytes: prf(&self.bytes, CALL, &[]) }
    }
}

/// The secret of the link between the surface and one vehicle, or of the calls to all; wiped from memory when dropped.
#[derive(Clone, PartialEq, Eq)]
pub struct LinkKey {
    bytes: Secret,
}

impl LinkKey {
    pub(super) fn from_bytes(bytes: [u8; 16]) -> Self {
        Self { bytes: Zeroizing::new(bytes) }
    }

    pub(super) fn bytes(&self) -> &[u8; 16] {
        &self.bytes
    }

    /// The tag of a hello frame, over `parts` and their lengths.
    ///
    /// It proves that a holder of the key wrote them, at any time: replayed parts verify again.
    pub fn hello_tag(&self, parts: &[&[u8]]) -> Tag {
        mac(&self.hello_cipher(), HELLO_NONCE, &join(parts)).into()
    }

    /// Whether `tag` is the tag of `parts`; takes the same time for every wrong tag.
    pub fn verify_hello(&self, parts: &[&[u8]], tag: &Tag) -> bool {
        let tag = (*tag).into();
        let nothing: &mut [u8] = &mut [];
        self.hello_cipher().decrypt_inout_detached(&(*HELLO_NONCE).into(), &join(parts), nothing.into(), &tag).is_ok()
    }

    fn hello_cipher(&self) -> ShortTagged {
        ShortTagged::new(&(*prf(&self.bytes, HELLO, &[])).into())
    }

    /// The nonce of a run, from a number that no other run of this key draws. Who does not hold the key foresees none from others.
    pub fn nonce(&self, drawn: u64) -> u64 {
        let root = prf(&self.bytes, NONCE, &[]);
        let [a, b, c, d, e, f, g, h, ..] = *prf(&root, &u128::from(drawn).to_be_bytes(), &[]);
        u64::from_be_bytes([a, b, c, d, e, f, g, h])
    }

    /// The key of a session: of the surface's run that drew `surface_nonce`, and the run of `vehicle` that drew
    /// `vehicle_nonce`.
    ///
    /// Each end draws its 64 bits at random when it starts. If one of the two is fresh, the key is new. Then neither
    /// end accepts frames of an earlier run, and no frame is encrypted twice under the same nonce.
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

impl fmt::Debug for LinkKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("LinkKey")
    }
}

/// The keys of one vehicle, as its key file has them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VehicleKey {
    /// The address of the vehicle that they are for.
    pub address: u8,
    /// The fingerprint of the mission key that they are derived from.
    pub mission: u32,
    pub(super) link: LinkKey,
    pub(super) calls: LinkKey,
}

impl VehicleKey {
    /// The keys of the vehicle at an address.
    pub fn derive(mission: &MissionKey, address: u8) -> Self {
        let (link, calls) = (mission.vehicle(address), mission.calls());
        Self { address, mission: mission.fingerprint(), link, calls }
    }

    /// The key of the vehicle's link.
    pub fn link(&self) -> &LinkKey {
        &self.link
    }

    /// The key of the calls to all vehicles.
    pub fn calls(&self) -> &LinkKey {
        &self.calls
    }
}

/// What an end holds: the mission key, or the keys of one vehicle alone.
#[derive(Debug, Clone)]
pub enum HeldKey {
    /// It opens the link of every vehicle. A surface needs it.
    Mission(MissionKey),
    /// It opens the link of one vehicle alone.
    Vehicle(VehicleKey),
}

impl HeldKey {
    /// The keys of a vehicle. An end that holds those of another one has no better ones, and no frame verifies.
    pub fn vehicle(&self, address: u8) -> VehicleKey {
        match self {
            Self::Mission(key) => VehicleKey::derive(key, address),
            Self::Vehicle(key) => key.clone(),
        }
    }

    /// The key of discovery calls.
    pub fn calls(&self) -> LinkKey {
        match self {
            Self::Mission(key) => key.calls(),
            Self::Vehicle(key) => key.calls.clone(),
        }
    }

    /// The fingerprint of the mission key.
    pub fn fingerprint(&self) -> u32 {
        match self {
            Self::Mission(key) => key.fingerprint(),
            Self::Vehicle(key) => key.mission,
        }
    }
}
