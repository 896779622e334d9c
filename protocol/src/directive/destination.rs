//! The destination: a place to which the vehicle goes at once, before it resumes its survey.

use crate::bytes::{Reader, Truncated, put24};
use crate::coordinates::DecimetrePoint;

/// A place of the world frame to which the vehicle goes at once. There it resumes its survey. A hold, an abort, the
/// fence and the limits come before it.
///
/// ```text
/// byte  bits  field   unit, range
///  0-2  24    x east  decimetres, two's complement, within 838 860.7 m
///  3-5  24    y north decimetres, two's complement
/// ```
/// Without bytes, the order withdraws the destination.
///
/// Source: surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Destination {
    /// The place; `None` withdraws it.
    pub place: Option<DecimetrePoint>,
}

impl Destination {
    pub(super) fn encode(self, out: &mut Vec<u8>) {
        for coordinate in self.place.iter().flat_map(|place| [place.east_dm, place.north_dm]) {
            put24(out, coordinate as u32);
        }
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        if r.rest().is_empty() {
            return Ok(Self::default());
        }
        Ok(Self { place: Some(DecimetrePoint::new(r.i24()?, r.i24()?)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::directive::{Slot, SlotId, VersionedSlot};

    #[test]
    fn golden_bytes_of_a_destination() {
        let place = Some(DecimetrePoint::new(-3, 1200));
        for (destination, bytes) in [
            (Destination { place }, &[0x01, 0, 7, 0xFF, 0xFF, 0xFD, 0, 4, 0xB0][..]),
            (Destination::default(), &[0x01, 0, 7]),
        ] {
            let slot = Slot::Destination(destination);
            assert_eq!(VersionedSlot::encode(7, &slot), bytes);
            let back = VersionedSlot { id: SlotId::Destination, version: 7, content: Some(slot) };
            assert_eq!(VersionedSlot::decode(bytes), Ok(back));
        }
        let short = VersionedSlot::decode(&[0x01, 0, 7, 1, 2, 3]).map(|slot| slot.content);
        assert_eq!(short, Ok(None), "refused by its name");
    }
}
