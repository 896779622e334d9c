//! Acknowledgement statements: a receiver's verdict on the peer's frames.

use crate::bytes::{BitReader, BitWriter, Reader, Truncated};

/// The most frames that a sender may have outstanding, so that a 12-bit horizon is unambiguous.
pub const MAX_WINDOW: u64 = 2048;

/// A final verdict on every frame up to a horizon.
///
/// It states: "Of the frames numbered up to `horizon` I hold all but `lost`." A receiver never accepts a frame that it
/// has declared lost. So both ends agree forever on the fate of every frame up to a horizon, and map chunks can build
/// on it.
///
/// ```text
///  0                   1
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5
/// +-----------------------+-------+-----------------+--------------------+
/// | horizon, low 12 bits  |  len  | [len2, 8 bits]  | loss code          |
/// +-----------------------+-------+-----------------+--------------------+
/// len      0..14: bytes of loss code; 15: len2 has the number (15..255)
/// loss code, most significant bit first:
///   1 bit       0: bitmap; 1: Rice code
///   bitmap      bit i (from 0): 1 = frame horizon-i is lost; frames past the end are held
///   Rice        for each lost frame downward from the horizon: frames held since the previous lost one, as quotient
///               (value / 8) in ones, a zero, then the remainder in 3 bits; ones to the end of the bytes are padding
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AckStatement {
    /// Low 12 bits of the highest frame number judged.
    pub horizon_low: u16,
    /// Distances of the lost frames below the horizon, ascending.
    pub lost: Vec<u16>,
}

impl AckStatement {
    /// Appends the statement if it takes at most `room` bytes; returns whether it did.
    pub fn encode(&self, room: usize, out: &mut Vec<u8>) -> bool {
        let code = encode_losses(&self.lost);
        let long = code.len() >= 15;
        if code.len() > 255 || 2 + usize::from(long) + code.len() > room {
            return false;
        }
        let len = if long { 15 } else { code.len() as u16 };
        out.extend_from_slice(&((self.horizon_low << 4) | len).to_be_bytes());
        if long {
            out.push(code.len() as u8);
        }
        out.extend_from_slice(&code);
        true
    }

    /// Decodes a statement; the rest stays in `reader`.
    pub fn decode(reader: &mut Reader<'_>) -> Result<Self, Truncated> {
        let word = reader.u16()?;
        let len = match word & 15 {
            15 => usize::from(reader.u8()?),
            n => usize::from(n),
        };
        Ok(Self { horizon_low: word >> 4, lost: decode_losses(reader.take(len)?) })
    }
}

/// Bits of the remainder in a Rice code.
const RICE_BITS: u32 = 3;

fn encode_losses(lost: &[u16]) -> Vec<u8> {
    let Some(&last) = lost.last() else { return Vec::new() };
    let mut bitmap = BitWriter::default();
    bitmap.bit(false);
    let mut next = lost.iter().peekable();
    for i in 0..=last {
        bitmap.bit(next.next_if(|&&l| l == i).is_some());
    }
    let (rice, bitmap) = (rice(lost), bitmap.into_bytes());
    if rice.len() < bitmap.len() { rice } else { bitmap }
}

fn rice(lost: &[u16]) -> Vec<u8> {
    let mut bits = BitWriter::default();
    bits.bit(true);
    let mut from = 0;
    for &l in lost {
        let gap = u64::from(l) - from;
        (0..gap >> RICE_BITS).for_each(|_| bits.bit(true));
        bits.bit(false);
        bits.put(gap, RICE_BITS);
        from = u64::from(l) + 1;
    }
    while !bits.len().is_multiple_of(8) {
        bits.bit(true);
    }
    bits.into_bytes()
}

fn decode_losses(code: &[u8]) -> Vec<u16> {
    let mut bits = BitReader::new(code);
    match bits.bit() {
        None => Vec::new(),
        Some(false) => {
            let each = (0..).map_while(|at| Some((at, bits.bit()?)));
            each.filter_map(|(at, is_lost)| is_lost.then_some(at)).collect()
        }
        Some(true) => {
            let (mut at, mut lost) = (0, Vec::new());
            while let Some(gap) = take_gap(&mut bits).filter(|gap| at + gap < 2 * MAX_WINDOW) {
                at += gap;
                lost.push(at as u16);
                at += 1;
            }
            lost
        }
    }
}

/// The next number of a Rice code; `None` at its end.
fn take_gap(bits: &mut BitReader<'_>) -> Option<u64> {
    let mut quotient = 0;
    while bits.bit()? {
        quotient += 1;
    }
    Some(quotient << RICE_BITS | bits.take(RICE_BITS)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn round_trip(statement: &AckStatement) -> AckStatement {
        let mut bytes = Vec::new();
        assert!(statement.encode(1000, &mut bytes));
        let mut reader = Reader::new(&bytes);
        let back = AckStatement::decode(&mut reader).unwrap();
        assert!(reader.rest().is_empty());
        back
    }

    #[test]
    fn a_clean_turn_is_acknowledged_in_two_bytes() {
        let mut bytes = Vec::new();
        assert!(AckStatement { horizon_low: 0xABC, lost: vec![] }.encode(2, &mut bytes));
        assert_eq!(bytes, [0xAB, 0xC0]);
    }

    #[test]
    fn golden_bytes_of_two_losses() {
        let mut bytes = Vec::new();
        assert!(AckStatement { horizon_low: 7, lost: vec![1, 4] }.encode(20, &mut bytes));
        assert_eq!(bytes, [0x00, 0x71, 0b0010_0100]);
    }

    #[test]
    fn fifty_losses_in_500_frames_take_under_40_bytes() {
        let lost: Vec<u16> = (0..50).map(|i| i * 10 + (i * 7 % 5)).collect();
        let mut bytes = Vec::new();
        assert!(AckStatement { horizon_low: 0, lost }.encode(40, &mut bytes));
    }

    proptest! {
        #[test]
        fn statements_round_trip(horizon_low in 0u16..4096, lost in proptest::collection::btree_set(0u16..600, 0..120)) {
            let statement = AckStatement { horizon_low, lost: lost.into_iter().collect() };
            prop_assert_eq!(round_trip(&statement), statement);
        }

        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
            if let Ok(s) = AckStatement::decode(&mut Reader::new(&bytes)) {
                prop_assert!(s.lost.windows(2).all(|w| w[0] < w[1]));
            }
        }
    }
}
