//! The vehicle's backlog.

use crate::bytes::{Reader, Truncated};

/// The approximate number of bytes that the vehicle still has to send.
///
/// ```text
/// byte  bits  field                 unit, range
///  0    4     labels of the map     value v
///  0    4                           shift s: v x 2^s bytes, rounded up, at most 491 520
///  1    8     all else              layers and images, in the same way
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Backlog {
    /// Bytes of labels of the map.
    pub map_bytes: u32,
    /// Bytes of layers and images.
    pub other_bytes: u32,
}

impl Backlog {
    /// Length on the wire in bytes.
    pub const BYTES: usize = 2;

    pub(super) fn encode(self) -> [u8; Self::BYTES] {
        [self.map_bytes, self.other_bytes].map(code)
    }

    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Self, Truncated> {
        Ok(Self { map_bytes: value(r.u8()?), other_bytes: value(r.u8()?) })
    }
}

/// A value of four bits, rounded up, and the number of doublings.
fn code(bytes: u32) -> u8 {
    let shift = (0..16u32).find(|&shift| bytes.div_ceil(1 << shift) < 16);
    shift.map_or(u8::MAX, |shift| (bytes.div_ceil(1 << shift) << 4 | shift) as u8)
}

fn value(code: u8) -> u32 {
    u32::from(code >> 4) << (code & 15)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_a_backlog() {
        let coded = |map_bytes, other_bytes| Backlog { map_bytes, other_bytes }.encode();
        assert_eq!(coded(0, 1), [0x00, 0x10]);
        assert_eq!(coded(15, 16), [0xF0, 0x81]);
        assert_eq!(coded(500, u32::MAX), [0x86, 0xFF]);
    }

    proptest! {
        #[test]
        fn a_backlog_is_rounded_up_by_at_most_an_eighth(bytes in 0u32..=491_520) {
            let back = value(code(bytes));
            prop_assert!(back >= bytes && back - bytes <= bytes / 8, "{bytes} became {back}");
        }
    }
}
