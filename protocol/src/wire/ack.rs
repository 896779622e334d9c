//! Acknowledgement statements: a receiver's verdict on the peer's frames.

use crate::bytes::{Reader, Truncated};

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

fn encode_losses(lost: &[u16]) -> Vec<u8> {
    let Some(&last) = lost.last() else { return Vec::new() };
    let mut bitmap = BitWriter::default();
    bitmap.push(0, 1);
    let mut next = lost.iter().peekable();
    for i in 0..=last {
        let hit = next.next_if(|&&l| l == i).is_some();
        bitmap.push(u32::from(hit), 1);
    }
    let (rice, bitmap) = (rice(lost), bitmap.finish(false));
    if rice.len() < bitmap.len() { rice } else { bitmap }
}

/// Bits of the remainder in a Rice code.
const RICE_BITS: u32 = 3;

fn rice(lost: &[u16]) -> Vec<u8> {
    let mut bits = BitWriter::default();
    bits.push(1, 1);
    let mut from = 0u32;
    for &l in lost {
        let gap = u32::from(l) - from;
        for _ in 0..gap >> RICE_BITS {
            bits.push(1, 1);
        }
        bits.push(0, 1);
        bits.push(gap & ((1 << RICE_BITS) - 1), RICE_BITS);
        from = u32::from(l) + 1;
    }
    bits.finish(true)
}

fn decode_losses(code: &[u8]) -> Vec<u16> {
    let mut bits = code.iter().flat_map(|b| (0..8).rev().map(move |i| u32::from(b >> i & 1)));
    let mut pull = |n: u32| (0..n).try_fold(0u32, |acc, _| bits.next().map(|b| acc << 1 | b));
    let mut lost = Vec::new();
    match pull(1) {
        None => {}
        Some(0) => {
            let mut at = 0u16;
            while let Some(bit) = pull(1) {
                if bit == 1 {
                    lost.push(at);
                }
                at += 1;
            }
        }
        Some(_) => {
            let mut at = 0u32;
            loop {
                let mut quotient = 0;
                let ended = loop {
                    match pull(1) {
                        Some(1) => quotient += 1,
                        Some(_) => break false,
                        None => break true,
                    }
                };
                let Some(low) = (!ended).then(|| pull(RICE_BITS)).flatten() else { break };
                at += (quotient << RICE_BITS) + low;
                if u64::from(at) >= 2 * MAX_WINDOW {
                    break;
                }
                lost.push(at as u16);
                at += 1;
            }
        }
    }
    lost
}

#[derive(Default)]
struct BitWriter {
    bytes: Vec<u8>,
    used: u32,
}

impl BitWriter {
    fn push(&mut self, value: u32, bits: u32) {
        for i in (0..bits).rev() {
            if self.used.is_multiple_of(8) {
                self.bytes.push(0);
            }
            if let Some(last) = self.bytes.last_mut() {
                *last |= ((value >> i & 1) as u8) << (7 - self.used % 8);
            }
            self.used += 1;
        }
    }

    fn finish(mut self, pad: bool) -> Vec<u8> {
        while pad && !self.used.is_multiple_of(8) {
            self.push(1, 1);
        }
        self.bytes
    }
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
