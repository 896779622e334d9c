//! The mission key, the keys of vehicles that are derived from it, those derived from these, and the offer of the next key of a
//! vehicle under its present one.

use super::ascon::{Secret, ShortTagged, join, mac, prf};
use super::{SessionKey, Tag};
use crate::bytes::{Reader, Truncated};
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

/// The nonce of the key stream, under the present key of the vehicle. It is used once with each part of each next key.
const OFFER: &[u8; 16] = b"scenecast-offer1";

/// The numbers of the two parts.
const LINK: u8 = 0;
const CALLS: u8 = 1;

impl VehicleKey {
    /// The length of a part in bytes.
    pub const PART_BYTES: usize = 21;

    /// The two parts in which this key, the next one, is offered to a vehicle that holds `present`; each is a chunk of the surface.
    ///
    /// ```text
    ///  0               1               5                              21
    /// +---------------+---------------+------------------------------+
    /// | part          | mission       | secret                       |
    /// +---------------+---------------+------------------------------+
    /// part     0: the next key of the vehicle, 1: the next key of the calls
    /// mission  fingerprint of the next mission key
    /// secret   the 16 bytes of the key, xor PRF(present key of the vehicle, "scenecast-offer1", part, mission)
    /// ```
    ///
    /// The tag of the frame protects it from change; the secret is hidden also where frames are not encrypted. Two next keys with one
    /// fingerprint would use a key stream twice, by chance once in 2^32.
    pub fn offer(&self, present: &LinkKey) -> [Vec<u8>; 2] {
        [(LINK, &self.link), (CALLS, &self.calls)].map(|(part, key)| {
            let head = [&[part][..], &self.mission.to_be_bytes()].concat();
            let hidden = hide(present, &head, *key.bytes());
            [head, hidden.to_vec()].concat()
        })
    }
}

/// Hides a secret in a part with this head, or shows it again.
fn hide(present: &LinkKey, head: &[u8], mut secret: [u8; 16]) -> [u8; 16] {
    secret.iter_mut().zip(prf(present.bytes(), OFFER, head).iter()).for_each(|(a, b)| *a ^= b);
    secret
}

/// The parts of an offer that a vehicle has received.
#[derive(Debug, Default)]
pub struct KeyOffer {
    mission: u32,
    link: Option<LinkKey>,
    calls: Option<LinkKey>,
}

impl KeyOffer {
    /// Takes a part; returns the next key of the vehicle at `address`, which holds `present`, once both parts are there.
    ///
    /// # Errors
    ///
    /// It has another length, or no such number.
    pub fn take(&mut self, part: &[u8], address: u8, present: &LinkKey) -> Result<Option<VehicleKey>, Truncated> {
        let mut r = Reader::new(part);
        let number = r.u8()?;
        let mission = r.u32()?;
        let hidden: [u8; 16] = r.take(16)?.try_into().map_err(|_| Truncated)?;
        if number > CALLS || !r.rest().is_empty() {
            return Err(Truncated);
        }
        if mission != self.mission {
            *self = Self { mission, ..Self::default() };
        }
        let key = LinkKey::from_bytes(hide(present, part.get(..5).unwrap_or_default(), hidden));
        match number {
            LINK => self.link = Some(key),
            _ => self.calls = Some(key),
        }
        let (Some(link), Some(calls)) = (&self.link, &self.calls) else { return Ok(None) };
        Ok(Some(VehicleKey { address, mission, link: link.clone(), calls: calls.clone() }))
    }
}

#[cfg(test)]
mod tests {
    use super::MissionKey;
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_offer_gives_the_next_key_only_to_holders_of_the_present() {
        let (present, next) = (MissionKey::from_bytes([1; 16]), MissionKey::from_bytes([2; 16]));
        let key = VehicleKey::derive(&next, 3);
        let [link, calls] = key.offer(&present.vehicle(3));
        let taken = |holder: &LinkKey| {
            let mut offer = KeyOffer::default();
            assert!(offer.take(&calls, 3, holder).unwrap().is_none());
            assert!(offer.take(&calls, 3, holder).unwrap().is_none(), "a repeated part is no second one");
            offer.take(&link, 3, holder).unwrap().unwrap()
        };
        assert!(taken(&present.vehicle(3)) == key);
        assert!(taken(&present.vehicle(2)) != key);
        assert!(
            link.windows(16)
                .chain(calls.windows(16))
                .all(|w| w != next.vehicle(3).bytes() && w != next.calls().bytes())
        );
    }

    #[test]
    fn parts_of_two_offers_are_not_joined() {
        let present = MissionKey::from_bytes([1; 16]).vehicle(3);
        let [first, second] = [2, 4].map(|byte| VehicleKey::derive(&MissionKey::from_bytes([byte; 16]), 3));
        let mut offer = KeyOffer::default();
        assert!(offer.take(&first.offer(&present)[0], 3, &present).unwrap().is_none());
        assert!(offer.take(&second.offer(&present)[1], 3, &present).unwrap().is_none());
        assert!(offer.take(&second.offer(&present)[0], 3, &present).unwrap() == Some(second));
    }

    proptest! {
        #[test]
        fn no_part_makes_it_panic(part in proptest::collection::vec(any::<u8>(), 0..40)) {
            let present = MissionKey::from_bytes([1; 16]).vehicle(3);
            let is_part = part.len() == VehicleKey::PART_BYTES && part[0] <= 1;
            prop_assert_eq!(KeyOffer::default().take(&part, 3, &present).is_ok(), is_part);
        }
    }
}
