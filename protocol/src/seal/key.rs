//! The mission key, the keys of vehicles that are derived from it, and those derived from these, by Ascon-AEAD128 as a keyed
//! function: the tag of an empty plaintext.

use super::{SessionKey, Tag};
use ascon_aead::TruncatedAsconAead128;
use ascon_aead::aead::array::ArraySize;
use ascon_aead::aead::array::typenum::{IsGreaterOrEqual, IsLessOrEqual};
use ascon_aead::aead::consts::{True, U4, U8, U16};
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

pub(super) type ShortTagged = TruncatedAsconAead128<U8>;

pub(super) type Secret = Zeroizing<[u8; 16]>;

/// A pseudorandom function of `nonce` and `data` under `key`: the whole tag of an empty plaintext with `data`
/// associated.
///
/// It is sound even if a nonce is used again with other data. A repeated nonce endangers Ascon through the key stream,
/// which an empty plaintext never reveals. The rest is a sponge that starts from a keyed permutation, absorbs 16 bytes
/// at a time over 192 hidden bits, and ends in a permutation between two additions of the key, of which only the tag is
/// revealed: a pseudorandom function up to about 2^96 calls and 2^128 guesses of the key. Proofs with repeated nonces:
/// Lefevre and Mennink, "Generic Security of the Ascon Mode: On the Power of Key Blinding", SAC 2024 (eprint 2023/796)
/// and "SoK: Security of the Ascon Modes" (eprint 2024/1969).
pub(super) fn prf(key: &[u8; 16], nonce: &[u8; 16], data: &[u8]) -> Secret {
    Zeroizing::new(mac::<U16>(&TruncatedAsconAead128::new(&(*key).into()), nonce, data).into())
}

/// The tag of `data` with an empty plaintext.
pub(super) fn mac<N>(
    cipher: &TruncatedAsconAead128<N>,
    nonce: &[u8; 16],
    data: &[u8],
) -> ascon_aead::aead::Tag<TruncatedAsconAead128<N>>
where
    N: ArraySize + IsLessOrEqual<U16, Output = True> + IsGreaterOrEqual<U4, Output = True>,
{
    encrypt(cipher, nonce, data, &mut [])
}

/// Encrypts `body` in place; the tag covers it and `data`.
#[allow(clippy::expect_used)]
pub(super) fn encrypt<N>(
    cipher: &TruncatedAsconAead128<N>,
    nonce: &[u8; 16],
    data: &[u8],
    body: &mut [u8],
) -> ascon_aead::aead::Tag<TruncatedAsconAead128<N>>
where
    N: ArraySize + IsLessOrEqual<U16, Output = True> + IsGreaterOrEqual<U4, Output = True>,
{
    cipher
        .encrypt_inout_detached(&(*nonce).into(), data, body.into())
        .expect("the only error is a length of 2^64 bytes, which no slice has")
}

/// Joins parts so that their boundaries count too: each follows its length in 4 bytes, the most significant first.
pub(super) fn join(parts: &[&[u8]]) -> Vec<u8> {
    let mut joined = Vec::with_capacity(parts.iter().map(|p| p.len() + 4).sum());
    for part in parts {
        joined.extend_from_slice(&(part.len() as u32).to_be_bytes());
        joined.extend_from_slice(part);
    }
    joined
}

#[cfg(test)]
mod tests {
    use super::*;

    fn counting<const N: usize>() -> [u8; N] {
        std::array::from_fn(|i| i as u8)
    }

    fn hex(text: &str) -> Vec<u8> {
        text.as_bytes().chunks(2).map(|d| u8::from_str_radix(str::from_utf8(d).unwrap(), 16).unwrap()).collect()
    }

    /// Known answers of the standard's Ascon-AEAD128, from the designers' reference code (github.com/ascon/ascon-c,
    /// crypto_aead/asconaead128/LWC_AEAD_KAT_128_128.txt, Count = 1, 2, 34 and 1089): key and nonce are 00 01 .. 0F.
    #[test]
    fn the_variant_is_that_of_the_standard() {
        let (long, byte, none) = (&counting::<32>()[..], &[0][..], &[][..]);
        let vectors = [
            (none, none, "4427D64B8E1E1451FC445960F0839BB0"),
            (none, byte, "103AB79D913A0321287715A979BB8585"),
            (byte, none, "E79F58F1F541FC51B5D438F8E1DD03F147"),
            (
                long,
                long,
                "4C086D27A3B51A2333CFC7F22172A9BCAD88B8D4D77E50622D788345FA7BEE4468915D3F9422289F2349D6A3B4160397",
            ),
        ];
        for (plain, data, expected) in vectors {
            let (mut body, expected) = (plain.to_vec(), hex(expected));
            let key = counting::<16>().into();
            let tag = encrypt(&TruncatedAsconAead128::<U16>::new(&key), &counting(), data, &mut body);
            assert_eq!([&body, &tag[..]].concat(), expected);
            let mut body = plain.to_vec();
            let short = encrypt(&ShortTagged::new(&key), &counting(), data, &mut body);
            assert_eq!([&body, &short[..]].concat(), expected[..plain.len() + 8], "a short tag is a cut one");
        }
    }

    #[test]
    fn the_function_is_the_tag_of_an_empty_plaintext() {
        let out = prf(&Zeroizing::new(counting()), &counting(), &[0]);
        assert_eq!(out.to_vec(), hex("103AB79D913A0321287715A979BB8585"));
    }

    #[test]
    fn joined_parts_keep_their_boundaries() {
        assert_eq!(join(&[b"ab", b"", b"c"]), [0, 0, 0, 2, b'a', b'b', 0, 0, 0, 0, 0, 0, 0, 1, b'c']);
        assert_ne!(join(&[b"ab", b"c"]), join(&[b"a", b"bc"]));
    }
}
