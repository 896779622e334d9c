//! Frames: what one modem transmission carries.

use super::ack::AckStatement;
use super::chunk::{ChunkKind, Chunks, push_chunk};
use super::cursor::Reader;
use super::{MAX_WINDOW, WIRE_VERSION};
use crc::{CRC_24_OPENPGP, CRC_32_ISCSI, Crc};

/// Frames shorter than this end in a 24-bit CRC, longer ones in a 32-bit one.
const LONG_FRAME: usize = 128;

static CRC24: Crc<u32> = Crc::<u32>::new(&CRC_24_OPENPGP);
static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Who speaks or is spoken to: 0 the surface, 1..=14 vehicles, 15 everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address(u8);

impl Address {
    /// The surface end.
    pub const SURFACE: Self = Self(0);

    /// The vehicle with this number; `None` outside 1..=14.
    pub fn vehicle(number: u8) -> Option<Self> {
        (1..=14).contains(&number).then_some(Self(number))
    }

    /// The number on the wire.
    pub fn number(self) -> u8 {
        self.0
    }
}

/// Keeps missions apart that share the water: it seeds every CRC, so a frame of another mission does not verify.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct MissionId(pub u32);

/// Random number of one run of one end; 0 is never drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SessionId(std::num::NonZeroU16);

impl SessionId {
    /// A session id from 16 random bits.
    pub fn from_random(bits: u16) -> Self {
        Self(std::num::NonZeroU16::new(bits).unwrap_or(std::num::NonZeroU16::MAX))
    }

    /// The number on the wire.
    pub fn get(self) -> u16 {
        self.0.get()
    }
}

/// The header of a frame.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-----+-+-+-+-+-+-------+-------+-------------------------------+
/// |ver=1|A|T|H|0|0| from  |  to   | session of the sender         |
/// +-----+-+-+-+-+-+-------+-------+-------+-------+---------------+
/// | number                        | base (1-2)    | remaining     |
/// +-------------------------------+---------------+---------------+
/// | [turn]        | [ack statement ...]           | chunks ... CRC|
/// +---------------+-------------------------------+---------------+
/// A          an ack statement is present
/// T          a turn byte is present
/// H          hello: the sender does not know the receiver's session; such a frame has no chunks
/// number     of this frame in the sender's session toward this receiver, wraps
/// base       number minus the last frame whose fate the sender knows, 1..=2048; 0..127 in one byte, else two with the
///            first one's top bit set (7 high bits, then 8 low bits)
/// remaining  frames that follow in this turn, 255 = 255 or more
/// turn       from the surface: airtime granted, in quarter seconds (0 = none);
///            from a vehicle: when it would use another turn, in quarter seconds from now (0 = at once, 255 = not known)
/// CRC        over mission id (4 bytes), the receiver's session (2 bytes, 0 in a hello) and the frame before the CRC:
///            CRC-24/OPENPGP in frames under 128 bytes, CRC-32/ISCSI in longer ones
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Header {
    /// Sender.
    pub from: Address,
    /// Receiver.
    pub to: Address,
    /// The sender's session.
    pub session: SessionId,
    /// Low 16 bits of the frame's number.
    pub number: u16,
    /// `number` minus the sender's horizon.
    pub base: u16,
    /// Frames that follow in this turn.
    pub remaining: u8,
    /// The turn byte.
    pub turn: Option<u8>,
    /// What the sender says of the frames it heard from the receiver.
    pub ack: Option<AckStatement>,
    /// Whether the sender does not know the receiver's session.
    pub hello: bool,
}

/// Why received bytes are no frame for us.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// Too short, or the header runs out of the frame.
    #[error("the frame is too short")]
    Truncated,
    /// A wire version that we do not speak.
    #[error("the frame has wire version {0}, this is version {WIRE_VERSION}")]
    Version(u8),
    /// For somebody else.
    #[error("the frame is for another address")]
    NotForUs,
    /// Corrupted, of another mission, or sealed to a session that is not ours.
    #[error("the checksum does not match")]
    Checksum,
    /// A field has a value that no sender writes.
    #[error("the frame has a field out of range")]
    BadField,
}

/// A verified frame.
#[derive(Debug, Clone)]
pub struct Frame<'a> {
    /// Its header.
    pub header: Header,
    body: &'a [u8],
}

/// Bytes of CRC at the end of a frame of `len` bytes.
pub fn crc_len(len: usize) -> usize {
    if len < LONG_FRAME { 3 } else { 4 }
}

fn seal(frame: &[u8], len: usize, mission: MissionId, to_session: u16) -> u32 {
    let crc = if len < LONG_FRAME { &CRC24 } else { &CRC32 };
    let mut digest = crc.digest();
    digest.update(&mission.0.to_be_bytes());
    digest.update(&to_session.to_be_bytes());
    digest.update(frame);
    digest.finalize()
}

impl<'a> Frame<'a> {
    /// Verifies and reads a frame; `ours` are the sessions under which we may be addressed now (one a peer).
    pub fn decode(
        bytes: &'a [u8],
        mission: MissionId,
        us: Address,
        ours: impl Fn(Address) -> SessionId,
    ) -> Result<Self, FrameError> {
        let crc_len = crc_len(bytes.len());
        let (covered, crc) =
            bytes.len().checked_sub(crc_len).and_then(|n| bytes.split_at_checked(n)).ok_or(FrameError::Truncated)?;
        let mut reader = Reader::new(covered);
        let truncated = |_| FrameError::Truncated;
        let flags = reader.u8().map_err(truncated)?;
        if flags >> 5 != WIRE_VERSION {
            return Err(FrameError::Version(flags >> 5));
        }
        let addresses = reader.u8().map_err(truncated)?;
        let (from, to) = (Address(addresses >> 4), Address(addresses & 15));
        if to != us || from == us || from.0 == 15 {
            return Err(FrameError::NotForUs);
        }
        let hello = flags & 0b100 != 0;
        let session = if hello { 0 } else { ours(from).get() };
        let received = crc.iter().fold(0u32, |acc, &b| acc << 8 | u32::from(b));
        if seal(covered, bytes.len(), mission, session) != received {
            return Err(FrameError::Checksum);
        }
        let header = Self::read_header(&mut reader, flags, from, to)?;
        Ok(Self { header, body: reader.rest() })
    }

    fn read_header(r: &mut Reader<'_>, flags: u8, from: Address, to: Address) -> Result<Header, FrameError> {
        let truncated = |_| FrameError::Truncated;
        if flags & 0b11 != 0 {
            return Err(FrameError::BadField);
        }
        let session = std::num::NonZeroU16::new(r.u16().map_err(truncated)?).ok_or(FrameError::BadField)?;
        let number = r.u16().map_err(truncated)?;
        let base = match r.u8().map_err(truncated)? {
            b if b < 128 => u16::from(b),
            b => u16::from(b & 127) << 8 | u16::from(r.u8().map_err(truncated)?),
        };
        if base == 0 || u64::from(base) > MAX_WINDOW {
            return Err(FrameError::BadField);
        }
        let remaining = r.u8().map_err(truncated)?;
        let turn = (flags & 0b1000 != 0).then(|| r.u8()).transpose().map_err(truncated)?;
        let ack = (flags & 0b1_0000 != 0).then(|| AckStatement::decode(r)).transpose().map_err(truncated)?;
        let hello = flags & 0b100 != 0;
        Ok(Header { from, to, session: SessionId(session), number, base, remaining, turn, ack, hello })
    }

    /// What the frame carries.
    pub fn chunks(&self) -> Chunks<'a> {
        Chunks::new(self.body)
    }
}

/// Writes a frame of at most a given size, chunk by chunk.
#[derive(Debug)]
pub struct FrameBuilder {
    bytes: Vec<u8>,
    size: usize,
    flags: u8,
    /// Where the count of remaining frames stands.
    remaining_at: usize,
}

impl FrameBuilder {
    /// Starts a frame of at most `size` bytes; the ack statement is written only if it fits.
    pub fn new(header: &Header, size: usize) -> Self {
        let mut bytes = Vec::with_capacity(size);
        let flags = WIRE_VERSION << 5 | u8::from(header.turn.is_some()) << 3 | u8::from(header.hello) << 2;
        bytes.extend_from_slice(&[flags, header.from.0 << 4 | header.to.0]);
        bytes.extend_from_slice(&header.session.get().to_be_bytes());
        bytes.extend_from_slice(&header.number.to_be_bytes());
        if header.base < 128 {
            bytes.push(header.base as u8);
        } else {
            bytes.extend_from_slice(&(header.base | 0x8000).to_be_bytes());
        }
        let remaining_at = bytes.len();
        bytes.push(header.remaining);
        bytes.extend(header.turn);
        let mut builder = Self { bytes, size, flags, remaining_at };
        let room = builder.room();
        if let Some(ack) = &header.ack
            && ack.encode(room, &mut builder.bytes)
        {
            builder.flags |= 0b1_0000;
        }
        builder
    }

    /// Corrects the count of frames that follow in this turn.
    pub fn set_remaining(&mut self, remaining: u8) {
        if let Some(byte) = self.bytes.get_mut(self.remaining_at) {
            *byte = remaining;
        }
    }

    /// Bytes that chunks can still take, their headers included.
    pub fn room(&self) -> usize {
        self.size.saturating_sub(self.bytes.len() + crc_len(self.size))
    }

    /// Adds a chunk; says whether it fitted.
    pub fn push(&mut self, kind: ChunkKind, payload: &[u8]) -> bool {
        push_chunk(kind, payload, self.room(), &mut self.bytes)
    }

    /// Seals the frame to the receiver's session (`None` in a hello); a full frame is padded to its size, a `short` one
    /// ends where its content ends.
    pub fn finish(mut self, mission: MissionId, to: Option<SessionId>, short: bool) -> Vec<u8> {
        if let Some(first) = self.bytes.first_mut() {
            *first = self.flags;
        }
        let full = self.size - crc_len(self.size);
        if !short || (self.bytes.len() + 3 >= LONG_FRAME) {
            self.bytes.resize(full, 0);
        }
        let len = if self.bytes.len() == full { self.size } else { self.bytes.len() + 3 };
        let crc = seal(&self.bytes, len, mission, to.map_or(0, SessionId::get));
        let crc_bytes = crc.to_be_bytes();
        self.bytes.extend_from_slice(crc_bytes.get(4 - crc_len(len)..).unwrap_or_default());
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MISSION: MissionId = MissionId(0x5CE7_0001);

    fn header() -> Header {
        Header {
            from: Address(1),
            to: Address::SURFACE,
            session: SessionId::from_random(0x1234),
            number: 0x00FF,
            base: 3,
            remaining: 2,
            turn: None,
            ack: Some(AckStatement { horizon_low: 5, lost: vec![] }),
            hello: false,
        }
    }

    fn decode(bytes: &[u8], session: u16) -> Result<Frame<'_>, FrameError> {
        Frame::decode(bytes, MISSION, Address::SURFACE, |_| SessionId::from_random(session))
    }

    #[test]
    fn golden_bytes_of_a_small_map_frame() {
        let mut b = FrameBuilder::new(&header(), 64);
        assert!(b.push(ChunkKind::Map, &[0xAA, 0xBB]));
        let bytes = b.finish(MISSION, Some(SessionId::from_random(0x4321)), true);
        assert_eq!(bytes[..13], [0x30, 0x10, 0x12, 0x34, 0x00, 0xFF, 3, 2, 0x00, 0x50, 0x22, 0xAA, 0xBB]);
        assert_eq!(bytes[13..], [0x75, 0xbd, 0x8e]);
        let frame = decode(&bytes, 0x4321).unwrap();
        assert_eq!(frame.header, header());
    }

    #[test]
    fn a_frame_of_64_bytes_spends_at_most_14_on_everything_but_payload() {
        let mut b = FrameBuilder::new(&header(), 64);
        let payload = vec![1; room_for_payload_of(&b)];
        assert!(b.push(ChunkKind::Map, &payload));
        assert!(payload.len() >= 50, "{} bytes of payload", payload.len());
        assert_eq!(b.finish(MISSION, None, false).len(), 64);
    }

    fn room_for_payload_of(b: &FrameBuilder) -> usize {
        super::super::room_for_payload(b.room())
    }

    #[test]
    fn frames_of_another_mission_or_session_do_not_verify() {
        let bytes = FrameBuilder::new(&header(), 64).finish(MISSION, Some(SessionId::from_random(7)), false);
        assert!(decode(&bytes, 7).is_ok());
        assert_eq!(decode(&bytes, 8).err(), Some(FrameError::Checksum));
        let other = Frame::decode(&bytes, MissionId(9), Address::SURFACE, |_| SessionId::from_random(7));
        assert_eq!(other.err(), Some(FrameError::Checksum));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = decode(&bytes, 1);
        }

        #[test]
        fn a_flipped_bit_is_noticed(size in 32usize..300, bit in 0usize..256, short: bool) {
            let mut bytes = FrameBuilder::new(&header(), size).finish(MISSION, Some(SessionId::from_random(7)), short);
            let bit = bit % (bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(decode(&bytes, 7).is_err());
        }
    }
}
