//! Acknowledgement statements: a receiver's verdict on the peer's frames.

use crate::bytes::{BitReader, BitWriter, Reader, Truncated};

/// The most frames that a sender may have outstanding, so that a 12-bit horizon is unambiguous.
pub const MAX_WINDOW: u64 = 2048;

/// A final verdict on every frame up to a horizon.
///
/// It states: "Of the frames numbered up to `horizon` I hold all but `lost`." A receiver never accepts a frame that it
/// has declared lost. So both ends agree forever on the fate of every frame up to a horizon, and map chunks can build
/// on it. The shortest form is three bits of a vehicle's turn byte ([`Header`](super::Header)); the others are:
///
/// ```text
///  0 1 2 3 4 5 6 7
/// +-+-------+-----+
/// |0|horizon|lost |    near: low 4 bits of the horizon; whether the first, second and third frame below it are lost
/// +-+-------+-----+
///  0                   1
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5
/// +-+-----------------------+-----+-----------------+--------------------+
/// |1| horizon, low 12 bits  | len | [len2, 8 bits]  | loss code          |
/// +-+-----------------------+-----+-----------------+--------------------+
/// len      0..6: bytes of loss code; 7: len2 has the number (7..255)
/// loss code, most significant bit first:
///   1 bit       0: bitmap; 1: Rice code
///   bitmap      bit i (from 0): 1 = frame horizon-i is lost; frames past the end are held
///   Rice        for each lost frame downward from the horizon: frames held since the previous lost one, as quotient
///               (value / 8) in ones, a zero, then the remainder in 3 bits; ones to the end of the bytes are padding
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct AckStatement {
    /// The highest frame number judged.
    pub horizon: Horizon,
    /// Distances of the lost frames below the horizon, ascending; of a near one only 1 to 3.
    pub lost: Vec<u16>,
}

/// The low bits of the highest frame number that a statement judges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Horizon {
    /// Low 2 bits, in the turn byte: it is at most 3 after the highest number whose verdict the sender of the frames knows, and no
    /// frame is lost.
    InTurn(u8),
    /// Low 4 bits: it is at most 15 after the highest number whose verdict the sender of the frames knows.
    Near(u8),
    /// Low 12 bits, for a horizon or for lost frames that the shorter forms cannot name.
    Far(u16),
}

/// The forms of a statement, the shortest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AckForm {
    /// In three bits of a vehicle's turn byte, so that it takes no bytes of its own; it names no lost frame.
    InTurn,
    /// One byte: 4 bits of the horizon, and for each of the 3 frames below it whether it is lost.
    Near,
    /// Two bytes or more: 12 bits of the horizon, and a code of any lost frames below it.
    Far,
}

impl AckForm {
    /// The shortest form in which a statement may have a horizon so far after the highest number whose verdict is known; `has_turn`
    /// is whether the frame has the turn byte of a vehicle.
    pub(crate) fn shortest(ahead: u64, has_turn: bool) -> Self {
        match ahead {
            0..=3 if has_turn => Self::InTurn,
            0..=15 => Self::Near,
            _ => Self::Far,
        }
    }
}

impl Horizon {
    /// The bits as they are sent.
    pub fn low(self) -> u16 {
        match self {
            Self::InTurn(low) | Self::Near(low) => low.into(),
            Self::Far(low) => low,
        }
    }

    /// How many low bits of the horizon are sent.
    pub fn bits(self) -> u32 {
        match self {
            Self::InTurn(_) => 2,
            Self::Near(_) => 4,
            Self::Far(_) => 12,
        }
    }

    /// How far it is after `known`, the highest number whose verdict is known, modulo its bits.
    pub(crate) fn ahead_of(self, known: u64) -> u64 {
        u64::from(self.low().wrapping_sub(known as u16)) & ((1 << self.bits()) - 1)
    }
}

impl AckStatement {
    /// A statement on the frames up to `horizon`, in this form or the shortest longer one that can name the lost ones.
    pub fn new(horizon: u64, lost: Vec<u16>, shortest: AckForm) -> Self {
        let is_near = lost.iter().all(|distance| NEAR_LOST.contains(distance));
        let horizon = match shortest {
            AckForm::InTurn if lost.is_empty() => Horizon::InTurn(horizon as u8 & 3),
            AckForm::InTurn | AckForm::Near if is_near => Horizon::Near(horizon as u8 & 0xF),
            _ => Horizon::Far(horizon as u16 & 0xFFF),
        };
        Self { horizon, lost }
    }

    /// Appends the statement if it takes at most `room` bytes; returns whether it did. One in the turn byte takes none.
    pub fn encode(&self, room: usize, out: &mut Vec<u8>) -> bool {
        let before = out.len();
        match self.horizon {
            Horizon::InTurn(_) => {}
            Horizon::Near(low) => {
                let bits = self.lost.iter().filter(|&&lost| lost > 0).fold(0, |bits, &lost| bits | 8u8 >> lost.min(4));
                out.push(low << 3 | bits);
            }
            Horizon::Far(low) => {
                let code = encode_losses(&self.lost);
                let is_long = code.len() >= LONG_CODE;
                if code.len() > 255 {
                    return false;
                }
                let len = if is_long { LONG_CODE as u16 } else { code.len() as u16 };
                out.extend_from_slice(&(FAR | low << 3 | len).to_be_bytes());
                out.extend(is_long.then_some(code.len() as u8));
                out.extend_from_slice(&code);
            }
        }
        let fits = out.len() - before <= room;
        if !fits {
            out.truncate(before);
        }
        fits
    }

    /// Decodes a statement; the rest stays in `reader`.
    pub fn decode(reader: &mut Reader<'_>) -> Result<Self, Truncated> {
        let first = reader.u8()?;
        if u16::from(first) << 8 & FAR == 0 {
            let lost = NEAR_LOST.filter(|distance| first & 8 >> distance != 0).collect();
            return Ok(Self { horizon: Horizon::Near(first >> 3), lost });
        }
        let word = u16::from(first) << 8 | u16::from(reader.u8()?);
        let len = match usize::from(word & 7) {
            LONG_CODE => usize::from(reader.u8()?),
            n => n,
        };
        Ok(Self { horizon: Horizon::Far(word >> 3 & 0xFFF), lost: decode_losses(reader.take(len)?) })
    }
}

/// The first bit of a statement that is not near.
const FAR: u16 = 0x8000;
/// The distances of lost frames that a near statement can name.
const NEAR_LOST: std::ops::RangeInclusive<u16> = 1..=3;
/// From here on the length of the loss code has a byte of its own.
const LONG_CODE: usize = 7;

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

    fn golden(horizon: u64, lost: Vec<u16>, form: AckForm, bytes: &[u8]) {
        let (statement, mut written) = (AckStatement::new(horizon, lost, form), Vec::new());
        assert!(!statement.encode(bytes.len() - 1, &mut written) && written.is_empty());
        assert!(statement.encode(bytes.len(), &mut written));
        assert_eq!((&written[..], round_trip(&statement)), (bytes, statement));
    }

    #[test]
    fn a_clean_turn_is_acknowledged_in_one_byte() {
        golden(0xABC, vec![], AckForm::Near, &[0x60]);
        golden(0xABC, vec![], AckForm::Far, &[0xD5, 0xE0]);
    }

    #[test]
    fn golden_bytes_of_two_losses() {
        golden(7, vec![1, 3], AckForm::Near, &[0x3D]);
        golden(7, vec![1, 4], AckForm::Near, &[0x80, 0x39, 0b0010_0100]);
        golden(7, vec![0], AckForm::Near, &[0x80, 0x39, 0b0100_0000]);
    }

    #[test]
    fn fifty_losses_in_500_frames_take_under_40_bytes() {
        let lost: Vec<u16> = (0..50).map(|i| i * 10 + (i * 7 % 5)).collect();
        let mut bytes = Vec::new();
        assert!(AckStatement::new(0, lost, AckForm::Near).encode(40, &mut bytes));
    }

    proptest! {
        #[test]
        fn statements_round_trip(
            horizon: u64, is_near: bool, lost in proptest::collection::btree_set(0u16..600, 0..120),
        ) {
            let form = if is_near { AckForm::Near } else { AckForm::Far };
            let statement = AckStatement::new(horizon, lost.into_iter().collect(), form);
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
