//! The header of a frame, and its number: a few bits on the wire, unbounded inside.

use super::ack::{AckStatement, Horizon};
use super::fields::{Address, SessionId, Stamp};
use super::{FrameError, MAX_WINDOW, WIRE_VERSION};
use crate::bytes::Reader;
use std::num::NonZeroU16;

/// The two kinds of frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameKind {
    /// Names the session of the sender; it has neither an acknowledgement statement nor chunks, and its number is 0.
    Hello,
    /// Belongs to a session of both ends, in which it has a number.
    Numbered,
}

impl FrameKind {
    pub(crate) fn hello_if(is_hello: bool) -> Self {
        if is_hello { Self::Hello } else { Self::Numbered }
    }

    /// Whether the frame is a hello.
    pub fn is_hello(self) -> bool {
        self == Self::Hello
    }
}

/// The header of a frame.
///
/// That of a numbered frame:
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-+---+-+-+-+-+-+-+-----+-------+---------------+---------------+
/// |1|nr |A|T|0|S|K|U|more |vehicle| [base (1-2)]  | number (1-2)  |
/// +-+---+-+-+-+-+-+-+-----+-------+---------------+---------------+
/// | [remaining]   | [turn]        | [stamp, 5 or 6 bytes]         |
/// +---------------+---------------+-------------------------------+
/// | [ack statement ...]           | chunks ...    | CRC or tag    |
/// +-------------------------------+---------------+---------------+
/// ```
///
/// That of a hello, which is the same in every version from 2 on:
///
/// ```text
/// +-----+-+-+-+-+-+-------+-------+-------------------------------+
/// |ver=4|0|T|1|S|K| from  |  to   | session of the sender         |
/// +-----+-+-+-+-+-+-------+-------+---------------+---------------+
/// | 0                             | 1             | remaining     |
/// +---------------+---------------+---------------+---------------+
/// | [turn]        | [stamp, 5 or 6 bytes] | [nonce, 8 bytes]      |
/// +---------------+-----------------------+-----------------------+
/// 1          the first bit of a numbered frame of this version; that of earlier versions is 0
/// nr         near: 1..=3 is `base`, and its bytes are absent; 0: they are present
/// A          an ack statement follows, which is not in the turn byte
/// T          a turn byte is present
/// S          a time stamp is present
/// K          keyed: the frame ends in a tag of 8 bytes under the mission's key instead of a CRC; a hello then has a nonce
/// U          up: from the vehicle to the surface; otherwise from the surface to the vehicle
/// more       0..=6 is `remaining`, and its byte is absent; 7: the byte is present
/// vehicle    1 to 14
/// base       number minus the last frame whose fate the sender knows, 1..=2048; 4..=127 in one byte, else two with the
///            first one's top bit set (7 high bits, then 8 low bits)
/// number     of this frame in the pair of runs, the first is 1: its low 8 bits below a base of 128, else its low 16
/// remaining  from the surface: bits on air that follow in this turn, divided by 32, rounded up, 255 = that or more;
///            from a vehicle: frames that follow in this turn, 255 = 255 or more
/// turn       from the surface: airtime granted, in quarter seconds (0 = none), in a call: time to answer in;
///            from a vehicle in a numbered frame: heard:3 | wish:5
/// heard      4..=7: an ack statement on all frames up to a horizon with these low 2 bits; 0: not in this byte
/// wish       when the vehicle would use another turn, in quarter seconds from now: 0..=7; above, with 4 + the low 2 bits,
///            shifted by the high 3 bits less 1; 31 = 112 s or later
/// nonce      random number of the sender's run, for the key of the pair of runs
/// ```
///
/// The seal of a numbered frame covers the runs of both ends and the number, which are not sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// The address of the sending end.
    pub from: Address,
    /// The receiving end, or everybody.
    pub to: Address,
    /// The session of the sender's run, in a hello; `None` in a numbered frame.
    pub session: Option<SessionId>,
    /// The frame's number: as many low bits of it as [`Self::base`] needs; 0 in a hello.
    pub number: u16,
    /// The number minus the sender's horizon, 1..=2048; 1 in a hello.
    pub base: u16,
    /// Bits or frames that follow in this turn, as above.
    pub remaining: u8,
    /// The turn byte, as above, without `heard`.
    pub turn: Option<u8>,
    /// The sender's clock at transmission.
    pub stamp: Option<Stamp>,
    /// The random number of the sender's run; only in a keyed hello.
    pub nonce: Option<u64>,
    /// The verdict on the receiver's frames.
    pub ack: Option<AckStatement>,
    /// Whether the frame ends in a tag instead of a CRC.
    pub keyed: bool,
}

/// Header and seal of a hello have the same layout in every version from this one on.
const FIRST_COMMON_HELLO: u8 = 2;

/// The first bit of a numbered frame, and the place of the two bits after it.
const NUMBERED: u8 = 0b1000_0000;
const NEAR_SHIFT: u32 = 5;
/// Up to here the two bits of the first byte have `base`.
const MAX_NEAR: u16 = 3;
/// The second byte of a numbered frame.
const UP: u8 = 0b1000_0000;
const MORE_SHIFT: u32 = 4;
/// The three bits of the second byte for a `remaining` that has a byte of its own: this or more.
const FULL: u8 = 7;
/// From here on `base` has two bytes, and so has the number.
const LONG_BASE: u8 = 128;

fn is_long(base: u16) -> bool {
    base >= u16::from(LONG_BASE)
}

/// The turn byte of a vehicle.
const HEARD: u8 = 0b1000_0000;
const HEARD_SHIFT: u32 = 5;
const WISH: u8 = 0b1_1111;

const ACK: u8 = 0b1_0000;
const TURN: u8 = 0b1000;
const HELLO: u8 = 0b100;
const STAMP: u8 = 0b10;
const KEYED: u8 = 0b1;

impl Header {
    /// The plain header of a numbered frame, of which nothing follows in its turn.
    #[must_use]
    pub fn numbered(from: Address, to: Address, number: u64, base: u16) -> Self {
        let low = if is_long(base) { number & 0xFFFF } else { number & 0xFF } as u16;
        let (turn, stamp, nonce, ack) = (None, None, None, None);
        Self { from, to, session: None, number: low, base, remaining: 0, turn, stamp, nonce, ack, keyed: false }
    }

    /// The plain header of a hello, after which nothing follows in its turn.
    #[must_use]
    pub fn hello(from: Address, to: Address, session: SessionId) -> Self {
        Self { session: Some(session), ..Self::numbered(from, to, 0, 1) }
    }

    /// Whether the frame opens a session or belongs to one.
    pub fn kind(&self) -> FrameKind {
        FrameKind::hello_if(self.session.is_some())
    }

    /// Reads the header of a frame if `to_us` selects its receiver; the frame is not verified yet.
    pub(super) fn decode(r: &mut Reader<'_>, to_us: impl Fn(Address) -> bool) -> Result<Self, FrameError> {
        let flags = r.u8()?;
        let (version, is_hello) = (Self::version_of(flags), flags & HELLO != 0);
        if version != WIRE_VERSION && !(is_hello && version >= FIRST_COMMON_HELLO) {
            return Err(FrameError::Version(version));
        }
        let has = |bit: u8| flags & bit != 0;
        let header = if is_hello { Self::decode_hello(r)? } else { Self::decode_numbered(flags, r)? };
        if !to_us(header.to) || header.from == header.to || header.from == Address::EVERYBODY {
            return Err(FrameError::NotForUs);
        }
        let turn = has(TURN).then(|| r.u8()).transpose()?;
        let (turn, heard) = match (header.from.is_vehicle(), turn) {
            (true, Some(_)) if is_hello => (None, 0),
            (true, Some(turn)) => (Some(turn & WISH), turn & !WISH),
            (_, turn) => (turn, 0),
        };
        if heard != 0 && (has(ACK) || heard < HEARD) {
            return Err(FrameError::BadField);
        }
        let stamp = has(STAMP).then(|| Stamp::decode(header.from, r)).transpose()?;
        let nonce = (is_hello && has(KEYED)).then(|| r.u64()).transpose()?;
        let ack = match heard {
            0 => has(ACK).then(|| AckStatement::decode(r)).transpose()?,
            _ => Some(AckStatement { horizon: Horizon::InTurn(heard >> HEARD_SHIFT & 3), lost: Vec::new() }),
        };
        Ok(Self { turn, stamp, nonce, ack, keyed: has(KEYED), ..header })
    }

    fn decode_hello(r: &mut Reader<'_>) -> Result<Self, FrameError> {
        let addresses = r.u8()?;
        let session = SessionId(NonZeroU16::new(r.u16()?).ok_or(FrameError::BadField)?);
        let _number_and_base = r.take(3)?;
        let remaining = r.u8()?;
        Ok(Self { remaining, ..Self::hello(Address(addresses >> 4), Address(addresses & 15), session) })
    }

    fn decode_numbered(flags: u8, r: &mut Reader<'_>) -> Result<Self, FrameError> {
        let route = r.u8()?;
        let vehicle = Address::vehicle(route & 15).ok_or(FrameError::BadField)?;
        let (from, to) = if route & UP != 0 { (vehicle, Address::SURFACE) } else { (Address::SURFACE, vehicle) };
        // Each base has one form alone, by which the bits of the number are known.
        let near = u16::from(flags >> NEAR_SHIFT) & MAX_NEAR;
        let (least, base) = match near {
            0 => match r.u8()? {
                b if b < LONG_BASE => (MAX_NEAR + 1, u16::from(b)),
                b => (u16::from(LONG_BASE), u16::from(b - LONG_BASE) << 8 | u16::from(r.u8()?)),
            },
            near => (1, near),
        };
        if base < least || u64::from(base) > MAX_WINDOW {
            return Err(FrameError::BadField);
        }
        let number = if is_long(base) { r.u16()? } else { u16::from(r.u8()?) };
        let remaining = match route >> MORE_SHIFT & FULL {
            FULL => r.u8()?,
            few => few,
        };
        Ok(Self { remaining, ..Self::numbered(from, to, u64::from(number), base) })
    }

    /// The whole number of a numbered frame: the one nearest to `highest`, the highest number of the run so far.
    pub fn number_near(&self, highest: u64) -> u64 {
        unwrap_number(self.number, if is_long(self.base) { 16 } else { 8 }, highest)
    }

    /// Every number with the low bits that were sent, each the one nearest to `highest` with its low 16 bits.
    pub(crate) fn numbers(&self, highest: u64) -> impl Iterator<Item = u64> + use<> {
        let low = self.number & 0xFF;
        (0..if is_long(self.base) { 0 } else { 256 }).map(move |high: u16| unwrap_number(high << 8 | low, 16, highest))
    }

    /// The wire version of a frame with this first byte.
    pub(super) fn version_of(flags: u8) -> u8 {
        let is_ours = flags & HELLO == 0 && flags & NUMBERED != 0;
        if is_ours { WIRE_VERSION } else { flags >> 5 }
    }

    /// Whether a frame with this first byte is keyed, and its kind.
    pub(super) fn kind_of(flags: u8) -> (bool, FrameKind) {
        (flags & KEYED != 0, FrameKind::hello_if(flags & HELLO != 0))
    }

    /// The bits of a vehicle's turn byte that have its ack statement, 0 if it is not in the turn byte.
    pub(super) fn heard(&self) -> u8 {
        match self.ack {
            Some(AckStatement { horizon: Horizon::InTurn(low), .. }) if self.from.is_vehicle() => {
                HEARD | low << HEARD_SHIFT
            }
            _ => 0,
        }
    }

    /// The first byte without the bits of turn byte and acknowledgement statement.
    fn flags(&self) -> u8 {
        let bit = |on: bool, bit: u8| if on { bit } else { 0 };
        let first = match self.session {
            Some(_) => WIRE_VERSION << 5 | HELLO,
            None if self.base <= MAX_NEAR => NUMBERED | (self.base as u8) << NEAR_SHIFT,
            None => NUMBERED,
        };
        first | bit(self.stamp.is_some(), STAMP) | bit(self.keyed, KEYED)
    }

    /// Appends everything up to the acknowledgement statement, but for what [`Self::end_turn`] adds; returns the index of its place.
    pub(super) fn encode(&self, out: &mut Vec<u8>) -> usize {
        out.push(self.flags());
        match self.session {
            Some(session) => {
                let [high, low] = session.get().to_be_bytes();
                out.extend_from_slice(&[self.from.0 << 4 | self.to.0, high, low, 0, 0, 1]);
            }
            None => self.encode_numbered(out),
        }
        let turn_at = out.len();
        if let Some(stamp) = &self.stamp {
            stamp.encode(out);
        }
        if let Some(nonce) = self.nonce {
            out.extend_from_slice(&nonce.to_be_bytes());
        }
        turn_at
    }

    /// Adds `remaining` and the turn byte to a frame that [`Self::encode`] began, at the index that it returned. `has_byte` is
    /// whether `remaining` has a byte of its own, as in a hello and above [`Self::FEW`].
    pub(super) fn end_turn(frame: &mut Vec<u8>, at: usize, remaining: u8, has_byte: bool, turn: Option<u8>) {
        let [first, second, ..] = &mut frame[..] else { return };
        let is_hello = *first & HELLO != 0;
        *first |= if turn.is_some() { TURN } else { 0 };
        *second |= match (is_hello, has_byte) {
            (true, _) => 0,
            (false, true) => FULL << MORE_SHIFT,
            (false, false) => remaining << MORE_SHIFT,
        };
        frame.splice(at..at, has_byte.then_some(remaining).into_iter().chain(turn));
    }

    fn encode_numbered(&self, out: &mut Vec<u8>) {
        out.push(if self.from.is_vehicle() { UP | self.from.0 } else { self.to.0 });
        if is_long(self.base) {
            out.extend_from_slice(&(self.base | u16::from(LONG_BASE) << 8).to_be_bytes());
            out.extend_from_slice(&self.number.to_be_bytes());
        } else {
            out.extend((self.base > MAX_NEAR).then_some(self.base as u8));
            out.push(self.number as u8);
        }
    }

    /// The highest `remaining` without a byte of its own.
    pub(super) const FEW: u8 = FULL - 1;
    /// The bit of the first byte that marks an acknowledgement statement.
    pub(super) const ACK_FLAG: u8 = ACK;
}

/// The unbounded number nearest to `near` whose low 8 or 16 bits are `low`.
pub fn unwrap_number(low: u16, bits: u32, near: u64) -> u64 {
    let shift = 16 - bits;
    let ahead = (low.wrapping_sub(near as u16) << shift).cast_signed() >> shift;
    near.checked_add_signed(i64::from(ahead)).unwrap_or(u64::from(low))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_unwrap_across_a_wrap_of_the_counter() {
        assert_eq!(unwrap_number(3, 16, 65_530), 65_539);
        assert_eq!(unwrap_number(65_530, 16, 65_540), 65_530);
        assert_eq!(unwrap_number(5, 16, 5), 5);
        assert_eq!(unwrap_number(65_535, 16, 0), 65_535, "nothing lies before the first number");
        assert_eq!(unwrap_number(3, 8, 250), 259);
        assert_eq!(unwrap_number(250, 8, 259), 250);
        assert_eq!(unwrap_number(127, 8, 1000), 1000 - 1000 % 256 + 127);
    }
}
