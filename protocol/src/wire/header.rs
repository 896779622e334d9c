//! The header of a frame.

use super::ack::AckStatement;
use super::frame::FrameError;
use super::stamp::Stamp;
use super::{MAX_WINDOW, WIRE_VERSION};
use crate::bytes::Reader;
use std::num::NonZeroU16;

/// The address of an end: 0 is the surface, 1..=14 are vehicles, 15 is everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address(u8);

impl Address {
    /// The address of the surface end.
    pub const SURFACE: Self = Self(0);
    /// All vehicles; never a sender.
    pub const EVERYBODY: Self = Self(15);

    /// The vehicle with this number; `None` outside 1..=14.
    pub fn vehicle(number: u8) -> Option<Self> {
        (1..=14).contains(&number).then_some(Self(number))
    }

    /// Whether it is the address of a vehicle.
    pub fn is_vehicle(self) -> bool {
        (1..=14).contains(&self.0)
    }

    /// The number on the wire, 0..=15.
    pub fn number(self) -> u8 {
        self.0
    }
}

/// Separates missions on one channel. It enters every seal, so a frame of another mission does not verify.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct MissionId(pub u32);

/// A random number of one run of one end; never 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(NonZeroU16);

impl SessionId {
    /// A session id from 16 random bits; 0 becomes 65 535.
    pub fn from_random(bits: u16) -> Self {
        Self(NonZeroU16::new(bits).unwrap_or(NonZeroU16::MAX))
    }

    /// The number on the wire, never 0.
    pub fn get(self) -> u16 {
        self.0.get()
    }
}

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
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-----+-+-+-+-+-+-------+-------+-------------------------------+
/// |ver=3|A|T|H|S|K| from  |  to   | session of the sender         |
/// +-----+-+-+-+-+-+-------+-------+-------+-------+---------------+
/// | number                        | base (1-2)    | remaining     |
/// +-------------------------------+---------------+---------------+
/// | [turn]        | [stamp, 5 or 6 bytes] | [nonce, 8 bytes]      |
/// +---------------+-----------------------+-----------------------+
/// | [ack statement ...]           | chunks ...    | CRC or tag    |
/// +-------------------------------+---------------+---------------+
/// A          an ack statement is present
/// T          a turn byte is present
/// H          hello: the sender names its session; such a frame has no ack statement and no chunks
/// S          a time stamp is present
/// K          keyed: the frame ends in a tag of 8 bytes under the mission's key instead of a CRC; a hello then has a nonce
/// number     of this frame in the pair of sessions, wraps; the first is 1. In a hello: 0
/// base       number minus the last frame whose fate the sender knows, 1..=2048; 0..127 in one byte, else two with the
///            first one's top bit set (7 high bits, then 8 low bits). In a hello: 1
/// remaining  from the surface: bits on air that follow in this turn, divided by 32, rounded up, 255 = that or more;
///            from a vehicle: frames that follow in this turn, 255 = 255 or more
/// turn       from the surface: airtime granted, in quarter seconds (0 = none), in a call: time to answer in;
///            from a vehicle: when it would use another turn, in quarter seconds from now (0 = at once, 255 = not known)
/// nonce      random number of the sender's run, for the key of the pair of runs
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// The address of the sending end.
    pub from: Address,
    /// The receiving end, or everybody.
    pub to: Address,
    /// The session of the sender's run.
    pub session: SessionId,
    /// Low 16 bits of the frame's number; 0 in a hello.
    pub number: u16,
    /// `number` minus the sender's horizon, 1..=2048.
    pub base: u16,
    /// Bits or frames that follow in this turn, as above.
    pub remaining: u8,
    /// The turn byte, as above.
    pub turn: Option<u8>,
    /// The sender's clock at transmission.
    pub stamp: Option<Stamp>,
    /// The random number of the sender's run; only in a keyed hello.
    pub nonce: Option<u64>,
    /// The verdict on the receiver's frames.
    pub ack: Option<AckStatement>,
    /// Whether the frame opens a session or belongs to one.
    pub kind: FrameKind,
    /// Whether the frame ends in a tag instead of a CRC.
    pub keyed: bool,
}

/// Header and seal of a hello have the same layout in every version from this one on.
const FIRST_COMMON_HELLO: u8 = 2;

const ACK: u8 = 0b1_0000;
const TURN: u8 = 0b1000;
const HELLO: u8 = 0b100;
const STAMP: u8 = 0b10;
const KEYED: u8 = 0b1;

impl Header {
    /// Reads the header of a frame if `to_us` selects its receiver; the frame is not verified yet.
    pub(super) fn decode(r: &mut Reader<'_>, to_us: impl Fn(Address) -> bool) -> Result<Self, FrameError> {
        let flags = r.u8()?;
        let (version, is_hello) = (flags >> 5, flags & HELLO != 0);
        if version != WIRE_VERSION && !(is_hello && version >= FIRST_COMMON_HELLO) {
            return Err(FrameError::Version(version));
        }
        let addresses = r.u8()?;
        let (from, to) = (Address(addresses >> 4), Address(addresses & 15));
        if !to_us(to) || from == to || from == Address::EVERYBODY {
            return Err(FrameError::NotForUs);
        }
        let session = SessionId(NonZeroU16::new(r.u16()?).ok_or(FrameError::BadField)?);
        let number = r.u16()?;
        let base = match r.u8()? {
            b if b < 128 => u16::from(b),
            b => u16::from(b & 127) << 8 | u16::from(r.u8()?),
        };
        if base == 0 || u64::from(base) > MAX_WINDOW {
            return Err(FrameError::BadField);
        }
        let remaining = r.u8()?;
        let has = |bit: u8| flags & bit != 0;
        let (kind, keyed) = (FrameKind::hello_if(has(HELLO)), has(KEYED));
        let turn = has(TURN).then(|| r.u8()).transpose()?;
        let stamp = has(STAMP).then(|| Stamp::decode(from, r)).transpose()?;
        let nonce = (kind.is_hello() && keyed).then(|| r.u64()).transpose()?;
        let ack = has(ACK).then(|| AckStatement::decode(r)).transpose()?;
        Ok(Self { from, to, session, number, base, remaining, turn, stamp, nonce, ack, kind, keyed })
    }

    /// The first byte without the bit of the acknowledgement statement.
    pub(super) fn flags(&self) -> u8 {
        let bit = |on: bool, bit: u8| if on { bit } else { 0 };
        WIRE_VERSION << 5
            | bit(self.turn.is_some(), TURN)
            | bit(self.kind.is_hello(), HELLO)
            | bit(self.stamp.is_some(), STAMP)
            | bit(self.keyed, KEYED)
    }

    /// Appends everything up to the acknowledgement statement; returns the index of the `remaining` byte.
    pub(super) fn encode(&self, out: &mut Vec<u8>) -> usize {
        out.extend_from_slice(&[self.flags(), self.from.0 << 4 | self.to.0]);
        out.extend_from_slice(&self.session.get().to_be_bytes());
        out.extend_from_slice(&self.number.to_be_bytes());
        if self.base < 128 {
            out.push(self.base as u8);
        } else {
            out.extend_from_slice(&(self.base | 0x8000).to_be_bytes());
        }
        let remaining_at = out.len();
        out.push(self.remaining);
        out.extend(self.turn);
        if let Some(stamp) = &self.stamp {
            stamp.encode(out);
        }
        if let Some(nonce) = self.nonce {
            out.extend_from_slice(&nonce.to_be_bytes());
        }
        remaining_at
    }

    /// The bit that marks an acknowledgement statement.
    pub(super) const ACK_FLAG: u8 = ACK;
}
