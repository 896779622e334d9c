//! The offer of the next key of a vehicle, under its present one.

use super::ascon::prf;
use super::key::{LinkKey, VehicleKey};
use crate::bytes::{Reader, Truncated};

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
    use super::super::key::MissionKey;
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
