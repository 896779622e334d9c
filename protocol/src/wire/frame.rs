//! Frames, the unit of transmission, and their seals.

use super::FrameError;
use super::chunk::{ChunkKind, Chunks, has_second_byte, push_chunk, to_the_end};
use super::fields::{Address, MissionId, SessionId};
use super::header::{FrameKind, Header};
use crate::bytes::Reader;
use crate::seal::{Direction, LinkKey, SessionKey, TAG_BYTES, Tag};
use crc::{CRC_24_OPENPGP, CRC_32_ISCSI, Crc, Digest};
use std::borrow::Cow;

/// The check of a hello, the same in every version from 2 on.
static CRC24: Crc<u32> = Crc::<u32>::new(&CRC_24_OPENPGP);
/// The check of a numbered frame.
static CRC32: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// The end of a frame, which proves its integrity or its authenticity.
#[derive(Debug, Clone, Copy)]
pub enum Seal<'a> {
    /// The CRC of a hello, over the mission, the receiver's session (0 if it is not known) and the frame.
    Crc(MissionId, u16),
    /// The CRC of a numbered frame, over the mission, the runs of the receiver and of the sender, the low 16 bits of the number, and
    /// the frame.
    Run {
        /// The mission of both ends.
        mission: MissionId,
        /// The session of the receiver's run.
        to: SessionId,
        /// The session of the sender's run.
        from: SessionId,
        /// The number, which does not wrap.
        number: u64,
    },
    /// The tag of a hello: mission, the receiver's session and nonce (0 if they are not known) and the frame.
    Hello(&'a LinkKey, MissionId, u16, u64),
    /// The tag of a numbered frame; the number does not wrap.
    Session(&'a SessionKey, Direction, u64),
}

impl Seal<'_> {
    /// The seal of a complaint about a hello of this session: the same whatever key and mission the ends have.
    pub const fn complaint(session: u16) -> Self {
        Self::Crc(MissionId(0), session)
    }

    /// The length of the seal in bytes.
    pub const fn bytes(keyed: bool, kind: FrameKind) -> usize {
        match (keyed, kind) {
            (true, _) => TAG_BYTES,
            (false, FrameKind::Hello) => 3,
            (false, FrameKind::Numbered) => 4,
        }
    }

    /// The CRC of a frame whose bytes before it are `parts`, as the frame ends in it; `None` of a tag.
    pub fn crc(&self, parts: &[&[u8]]) -> Option<impl Iterator<Item = u8> + use<>> {
        let (mut digest, unused) = match *self {
            Self::Crc(mission, session) => (begin(&CRC24, mission, &[session]), 1),
            Self::Run { mission, to, from, number } => {
                (begin(&CRC32, mission, &[to.get(), from.get(), number as u16]), 0)
            }
            Self::Hello(..) | Self::Session(..) => return None,
        };
        parts.iter().for_each(|part| digest.update(part));
        Some(digest.finalize().to_be_bytes().into_iter().skip(unused))
    }

    fn hello_parts<'p>(
        mission: &'p [u8; 4],
        session: &'p [u8; 2],
        nonce: &'p [u8; 8],
        frame: &'p [u8],
    ) -> [&'p [u8]; 4] {
        [mission, session, nonce, frame]
    }

    /// Appends the seal of a frame whose chunks begin at `body_at`.
    fn close(&self, bytes: &mut Vec<u8>, body_at: usize) {
        match *self {
            Self::Crc(..) | Self::Run { .. } => {
                let crc = self.crc(&[bytes]);
                bytes.extend(crc.into_iter().flatten());
            }
            Self::Hello(key, mission, session, nonce) => {
                let (m, s, n) = (mission.0.to_be_bytes(), session.to_be_bytes(), nonce.to_be_bytes());
                let tag = key.hello_tag(&Self::hello_parts(&m, &s, &n, bytes));
                bytes.extend_from_slice(&tag);
            }
            Self::Session(key, direction, number) => {
                let (head, body) = bytes.split_at_mut(body_at);
                let tag: Tag = key.seal(direction, number, head, body);
                bytes.extend_from_slice(&tag);
            }
        }
    }
}

/// Begins a CRC with what is not sent: the mission, and words of 16 bits.
fn begin(crc: &'static Crc<u32>, mission: MissionId, words: &[u16]) -> Digest<'static, u32> {
    let mut digest = crc.digest();
    digest.update(&mission.0.to_be_bytes());
    words.iter().for_each(|word| digest.update(&word.to_be_bytes()));
    digest
}

/// A frame whose header was read and which is not verified yet.
#[derive(Debug, Clone)]
pub struct Envelope<'a> {
    /// The header, which may be forged.
    pub header: Header,
    /// The wire version of the sender; only a hello can have another one than [`WIRE_VERSION`].
    pub version: u8,
    head: &'a [u8],
    body: &'a [u8],
    end: &'a [u8],
}

/// A frame whose seal was verified.
#[derive(Debug, Clone)]
pub struct Frame<'a> {
    /// The header, verified together with the chunks.
    pub header: Header,
    /// The whole number of a numbered frame, 0 of a hello.
    pub number: u64,
    body: Cow<'a, [u8]>,
}

impl<'a> Envelope<'a> {
    /// Reads the header of a frame; `to_us` selects our addresses.
    pub fn decode(bytes: &'a [u8], to_us: impl Fn(Address) -> bool) -> Result<Self, FrameError> {
        let (keyed, kind) = bytes.first().map_or((false, FrameKind::Hello), |&flags| Header::kind_of(flags));
        let end = bytes.len().checked_sub(Seal::bytes(keyed, kind)).ok_or(FrameError::Truncated)?;
        let (covered, end) = bytes.split_at_checked(end).ok_or(FrameError::Truncated)?;
        let mut reader = Reader::new(covered);
        let header = Header::decode(&mut reader, to_us)?;
        let body = reader.rest();
        let head = covered.get(..covered.len() - body.len()).ok_or(FrameError::Truncated)?;
        let version = head.first().map_or(0, |flags| Header::version_of(*flags));
        Ok(Self { header, version, head, body, end })
    }

    /// The frame, if this seal verifies it.
    pub fn open(&self, seal: &Seal<'_>) -> Option<Frame<'a>> {
        let mut body = Cow::Borrowed(self.body);
        let sound = match *seal {
            Seal::Crc(..) => !self.header.keyed && self.header.kind().is_hello() && self.crc_matches(seal),
            Seal::Run { .. } => !self.header.keyed && !self.header.kind().is_hello() && self.crc_matches(seal),
            Seal::Hello(key, mission, session, nonce) => {
                let (m, s, n) = (mission.0.to_be_bytes(), session.to_be_bytes(), nonce.to_be_bytes());
                let frame = [self.head, self.body].concat();
                let parts = Seal::hello_parts(&m, &s, &n, &frame);
                self.header.keyed && <&Tag>::try_from(self.end).is_ok_and(|tag| key.verify_hello(&parts, tag))
            }
            Seal::Session(key, direction, number) => {
                self.header.keyed && key.open(direction, number, self.head, body.to_mut(), self.end)
            }
        };
        let number = match *seal {
            Seal::Run { number, .. } | Seal::Session(_, _, number) => number,
            Seal::Crc(..) | Seal::Hello(..) => 0,
        };
        sound.then(|| Frame { header: self.header.clone(), number, body })
    }

    /// Whether a vehicle complains that it cannot verify a hello of this session. Everybody can write this frame.
    pub fn is_complaint(&self, session: u16) -> bool {
        self.open(&Seal::complaint(session)).is_some_and(|frame| frame.chunks().next().is_none())
    }

    /// The chunks before they are verified: they may be damaged, forged or encrypted.
    pub fn unverified_chunks(&self) -> Chunks<'_> {
        Chunks::new(self.body)
    }

    fn crc_matches(&self, seal: &Seal<'_>) -> bool {
        seal.crc(&[self.head, self.body]).is_some_and(|crc| crc.eq(self.end.iter().copied()))
    }
}

impl Frame<'_> {
    /// The chunks of the frame in order.
    pub fn chunks(&self) -> Chunks<'_> {
        Chunks::new(&self.body)
    }
}

/// Writes a frame of at most a given size, chunk by chunk.
///
/// ```
/// use scenecast_protocol::wire::{
///     Address, ChunkKind, Envelope, FrameBuilder, Header, MissionId, Seal, SessionId,
/// };
///
/// let header = Header::numbered(Address::vehicle(1).unwrap(), Address::SURFACE, 1, 1);
/// let [to, from] = [0xBEEF, 0x1234].map(SessionId::from_random);
/// let seal = Seal::Run { mission: MissionId(7), to, from, number: 1 };
/// let mut builder = FrameBuilder::new(&header, 64);
/// assert!(builder.push(ChunkKind::Map, &[1, 2, 3]));
/// let bytes = builder.finish(&seal, true);
///
/// let frame = Envelope::decode(&bytes, |to| to == Address::SURFACE).unwrap().open(&seal).unwrap();
/// assert_eq!(frame.chunks().next().unwrap().payload, [1, 2, 3]);
/// ```
#[derive(Debug)]
pub struct FrameBuilder {
    bytes: Vec<u8>,
    size: usize,
    kind: FrameKind,
    seal_bytes: usize,
    remaining: u8,
    turn: Option<u8>,
    /// The bits of the turn byte that have the ack statement.
    heard: u8,
    /// Where `remaining` and turn byte go.
    turn_at: usize,
    /// The highest `remaining` that there is room for. The frame has its byte wherever it was kept free: the last chunk may reach
    /// to the end of the frame.
    most_remaining: u8,
    body_at: usize,
    /// Where the last chunk begins.
    last_chunk: Option<usize>,
}

impl FrameBuilder {
    /// Starts a frame of at most `size` bytes; the acknowledgement statement is written only if it fits.
    pub fn new(header: &Header, size: usize) -> Self {
        let mut bytes = Vec::with_capacity(size);
        let turn_at = header.encode(&mut bytes);
        let (kind, remaining, turn, heard) = (header.kind(), header.remaining, header.turn, header.heard());
        let seal_bytes = Seal::bytes(header.keyed, kind);
        let (most_remaining, body_at, last_chunk) = (remaining, 0, None);
        let mut builder = Self {
            bytes,
            size,
            kind,
            seal_bytes,
            remaining,
            turn,
            heard,
            turn_at,
            most_remaining,
            body_at,
            last_chunk,
        };
        let room = builder.room();
        if let Some(ack) = &header.ack
            && heard == 0
            && ack.encode(room, &mut builder.bytes)
            && let Some(flags) = builder.bytes.first_mut()
        {
            *flags |= Header::ACK_FLAG;
        }
        builder.body_at = builder.bytes.len();
        builder
    }

    /// Keeps room for a `remaining` of up to `most`, so that [`Self::set_remaining`] may follow the chunks.
    #[must_use]
    pub fn in_turn(mut self, most: u8) -> Self {
        self.most_remaining = self.most_remaining.max(most);
        self
    }

    /// Sets how much of this turn follows the frame: from a vehicle in frames, from the surface in units of 32 bits on air.
    pub fn set_remaining(&mut self, remaining: u8) {
        self.most_remaining = self.most_remaining.max(remaining);
        self.remaining = remaining;
    }

    /// Sets the turn byte, if there is room for it.
    pub fn set_turn(&mut self, turn: u8) {
        if self.turn.is_some() || self.room() > 0 {
            self.turn = Some(turn);
        }
    }

    /// Bytes that chunks can still take, their headers included.
    pub fn room(&self) -> usize {
        self.size.saturating_sub(self.bytes.len() + self.turn_bytes() + self.seal_bytes)
    }

    fn has_remaining_byte(&self) -> bool {
        self.kind.is_hello() || self.most_remaining > Header::FEW
    }

    fn turn_bytes(&self) -> usize {
        usize::from(self.turn.is_some()) + usize::from(self.has_remaining_byte())
    }

    /// Whether it has no chunk yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.last_chunk.is_none()
    }

    /// Adds a chunk; returns whether it fitted.
    pub fn push(&mut self, kind: ChunkKind, payload: &[u8]) -> bool {
        let (at, room) = (self.bytes.len(), self.room());
        let fits = push_chunk(kind, payload, room, &mut self.bytes);
        self.last_chunk = if fits { Some(at) } else { self.last_chunk };
        fits
    }

    /// The length of the finished frame in bytes.
    pub fn len(&self, short: bool) -> usize {
        let open = usize::from(self.open_chunk().is_some());
        if short { self.bytes.len() + self.turn_bytes() + self.seal_bytes - open } else { self.size }
    }

    /// Where the last chunk begins, if it needs no second byte of length in a short frame.
    fn open_chunk(&self) -> Option<usize> {
        self.last_chunk.filter(|&at| self.bytes.get(at).is_some_and(|head| has_second_byte(*head)))
    }

    /// Seals the frame. A `short` frame ends where its content ends; any other is padded to its size.
    pub fn finish(mut self, seal: &Seal<'_>, short: bool) -> Vec<u8> {
        let content = self.len(short) - self.seal_bytes;
        if let Some(at) = self.open_chunk().filter(|_| short) {
            to_the_end(at, &mut self.bytes);
        }
        self.body_at += self.turn_bytes();
        let has_byte = self.has_remaining_byte();
        let turn = self.turn.map(|turn| self.heard | turn);
        Header::end_turn(&mut self.bytes, self.turn_at, self.remaining, has_byte, turn);
        self.bytes.resize(content, 0);
        seal.close(&mut self.bytes, self.body_at);
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    use super::super::{AckForm, AckStatement, Stamp, room_for_payload};
    use super::*;
    use crate::seal::MissionKey;
    use proptest::prelude::*;
    use std::time::Duration;

    const MISSION: MissionId = MissionId(0x5CE7_0001);

    fn header() -> Header {
        let ack = Some(AckStatement::new(5, vec![], AckForm::Near));
        Header { remaining: 2, ack, ..Header::numbered(Address::vehicle(1).unwrap(), Address::SURFACE, 0xFF, 3) }
    }

    /// The seal of a frame to the run `to`, from the run 1234.
    fn run(to: u16, number: u64) -> Seal<'static> {
        let [to, from] = [to, 0x1234].map(SessionId::from_random);
        Seal::Run { mission: MISSION, to, from, number }
    }

    fn envelope(bytes: &[u8]) -> Result<Envelope<'_>, FrameError> {
        Envelope::decode(bytes, |to| to == Address::SURFACE)
    }

    fn verifies(bytes: &[u8], seal: &Seal<'_>) -> bool {
        envelope(bytes).is_ok_and(|e| e.open(seal).is_some())
    }

    fn key() -> LinkKey {
        MissionKey::from_bytes([7; 16]).vehicle(1)
    }

    #[test]
    fn golden_bytes_of_a_small_map_frame() {
        let mut b = FrameBuilder::new(&header(), 64);
        assert!(b.push(ChunkKind::Map, &[0xAA, 0xBB]));
        let bytes = b.finish(&run(0x4321, 0x1FF), true);
        assert_eq!(bytes[..7], [0xF0, 0xA1, 0xFF, 0x28, 0x22, 0xAA, 0xBB]);
        assert_eq!(bytes[7..], [0x53, 0x46, 0x0F, 0xD7]);
        let read = envelope(&bytes).unwrap();
        assert_eq!(read.header.number_near(0x190), 0x1FF);
        let frame = read.open(&run(0x4321, 0x1FF)).unwrap();
        assert_eq!((frame.header, frame.number), (header(), 0x1FF));
    }

    #[test]
    fn a_far_base_has_two_bytes_and_so_has_the_number() {
        let far = Header { number: 0x1234, base: 0x7FF, remaining: 0, ack: None, ..header() };
        let bytes = FrameBuilder::new(&far, 64).finish(&run(7, 0x51234), true);
        assert_eq!(bytes[..6], [0x80, 0x81, 0x87, 0xFF, 0x12, 0x34]);
        assert!(envelope(&[0x80, 0x81, 0x80, 0x7F, 0, 0, 1, 2, 3, 4]).is_err(), "127 in two bytes");
        assert!(envelope(&[0x80, 0x81, 3, 0, 1, 2, 3, 4]).is_err(), "3 in a byte");
        let read = envelope(&bytes).unwrap();
        assert_eq!(read.header.number_near(0x50FFF), 0x51234);
        assert_eq!(read.open(&run(7, 0x51234)).unwrap().header, far);
    }

    #[test]
    fn few_remaining_frames_take_no_byte_and_a_turn_byte_fits_late() {
        let frame = |most: u8, remaining: u8, turn: Option<u8>| {
            let mut builder = FrameBuilder::new(&Header { remaining: 0, ..header() }, 64).in_turn(most);
            assert!(builder.push(ChunkKind::Map, &[1, 2]));
            builder.set_remaining(remaining);
            turn.into_iter().for_each(|turn| builder.set_turn(turn));
            let bytes = builder.finish(&run(7, 255), true);
            let header = envelope(&bytes).unwrap().open(&run(7, 255)).unwrap().header;
            assert_eq!((header.remaining, header.turn), (remaining, turn));
            bytes.len()
        };
        assert_eq!([frame(6, 0, None), frame(6, 6, None), frame(7, 0, None), frame(9, 9, Some(3))], [11, 11, 12, 13]);
        let mut full = FrameBuilder::new(&Header { remaining: 0, ..header() }, 64);
        assert!(full.push(ChunkKind::Map, &vec![1; room_for_payload(full.room())]));
        full.set_turn(3);
        let bytes = full.finish(&run(7, 255), false);
        assert_eq!((bytes.len(), envelope(&bytes).unwrap().header.turn), (64, None));
    }

    #[test]
    fn a_turn_byte_of_a_vehicle_has_a_statement_without_losses() {
        let frame = |turn: u8, horizon: u64| {
            let ack = Some(AckStatement::new(horizon, vec![], AckForm::InTurn));
            let header = Header { remaining: 0, turn: Some(turn), ack, ..header() };
            let bytes = FrameBuilder::new(&header, 64).finish(&run(7, 255), true);
            assert_eq!(envelope(&bytes).unwrap().header, header);
            bytes
        };
        assert_eq!(frame(0, 4)[..4], [0xE8, 0x81, 0xFF, 0x80]);
        assert_eq!(frame(31, 7)[..4], [0xE8, 0x81, 0xFF, 0xFF]);
        assert!(envelope(&[0xE8, 0x81, 9, 0x61, 0, 0, 0, 0]).is_err(), "no low bits of a horizon");
        assert!(envelope(&[0xF8, 0x81, 9, 0xE1, 0x28, 0, 0, 0, 0]).is_err(), "two statements");
    }

    #[test]
    fn only_hellos_are_read_of_version_2() {
        let map = [0x50, 0x10, 0x12, 0x34, 0x00, 0xFF, 3, 2, 0x00, 0x50, 0x22, 0xAA, 0xBB, 0x00, 0xF6, 0x3D];
        assert_eq!(envelope(&map).unwrap_err(), FrameError::Version(2));
        let hello = [0x44, 0x10, 0x12, 0x34, 0, 0, 1, 0, 0x4A, 0xC0, 0x2B];
        let read = envelope(&hello).unwrap();
        assert_eq!((read.version, read.header.session.map(SessionId::get)), (2, Some(0x1234)));
        assert!(read.open(&Seal::Crc(MISSION, 0xBEEF)).is_some_and(|frame| frame.chunks().next().is_none()));
    }

    #[test]
    fn golden_bytes_of_a_keyed_hello() {
        let stamp = Stamp::Surface { clock_ms: 5, one_way: Some(Duration::from_millis(7)) };
        let session = SessionId::from_random(0x1234);
        let hello = Header {
            turn: Some(9),
            stamp: Some(stamp),
            nonce: Some(0x0102_0304_0506_0708),
            keyed: true,
            ..Header::hello(Address::SURFACE, Address::vehicle(2).unwrap(), session)
        };
        let bytes = FrameBuilder::new(&hello, 64).finish(&Seal::Hello(&key(), MISSION, 0, 0), true);
        let expected = [0x8F, 0x02, 0x12, 0x34, 0, 0, 1, 0, 9, 0, 0, 5, 0, 7, 1, 2, 3, 4, 5, 6, 7, 8];
        assert_eq!(bytes[..22], expected);
        assert_eq!(bytes.len(), 30);
        let read = Envelope::decode(&bytes, |to| to.number() == 2).unwrap();
        assert_eq!(read.open(&Seal::Hello(&key(), MISSION, 0, 0)).unwrap().header, hello);
        assert!(read.open(&Seal::Hello(&key(), MISSION, 0, 1)).is_none(), "another run's nonce");
    }

    #[test]
    fn a_frame_of_64_bytes_has_50_bytes_of_payload() {
        let mut b = FrameBuilder::new(&header(), 64);
        let payload = vec![1; room_for_payload(b.room())];
        assert!(b.push(ChunkKind::Map, &payload));
        assert!(payload.len() >= 50, "{} bytes of payload", payload.len());
        assert_eq!(b.finish(&run(1, 255), false).len(), 64);
    }

    #[test]
    fn the_last_chunk_of_a_short_frame_has_one_byte_of_length() {
        let length = |chunks: usize, short: bool| {
            let mut builder = FrameBuilder::new(&header(), 200);
            (0..chunks).for_each(|_| assert!(builder.push(ChunkKind::Map, &[5; 30])));
            builder.finish(&run(7, 255), short).len()
        };
        let none = length(0, true);
        assert_eq!([1, 2].map(|chunks| length(chunks, true) - none), [31, 32 + 31]);
        assert_eq!(length(1, false), 200);
    }

    #[test]
    fn frames_of_another_mission_or_session_do_not_verify() {
        let bytes = FrameBuilder::new(&header(), 64).finish(&run(7, 255), false);
        assert!(verifies(&bytes, &run(7, 255)));
        assert!(!verifies(&bytes, &run(8, 255)), "another run of the receiver");
        assert!(!verifies(&bytes, &run(7, 511)), "another number with these low bits");
        let Seal::Run { to, number, .. } = run(7, 255) else { return };
        let from = SessionId::from_random(0x1235);
        assert!(!verifies(&bytes, &Seal::Run { mission: MISSION, to, from, number }), "another run of the sender");
        let from = SessionId::from_random(0x1234);
        assert!(!verifies(&bytes, &Seal::Run { mission: MissionId(9), to, from, number }));
        assert!(!verifies(&bytes, &Seal::Crc(MISSION, 7)));
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            verifies(&bytes, &Seal::Crc(MISSION, 1));
            verifies(&bytes, &run(1, 4));
            verifies(&bytes, &Seal::Hello(&key(), MISSION, 1, 1));
            verifies(&bytes, &Seal::Session(&key().session(1, 1, 2, 3, true), Direction::Up, 4));
        }

        #[test]
        fn a_flipped_bit_is_noticed(
            size in 32usize..300, fill in 0usize..300, bit: usize, short: bool, keyed: bool, (most, remaining) in (0u8..9, 0u8..9),
        ) {
            let session = key().session(1, 1, 2, 3, fill % 2 == 0);
            let seal = if keyed { Seal::Session(&session, Direction::Up, 255) } else { run(7, 255) };
            let header = Header { keyed, remaining: 0, ..header() };
            let mut b = FrameBuilder::new(&header, size).in_turn(most);
            // Often it fills the frame to the last byte.
            let payload = vec![5; fill.min(room_for_payload(b.room()))];
            prop_assert!(b.push(ChunkKind::Map, &payload));
            b.set_remaining(remaining.min(most));
            let announced = b.len(short);
            let mut bytes = b.finish(&seal, short);
            prop_assert_eq!(bytes.len(), announced);
            prop_assert!(bytes.len() <= size);
            {
                let frame = envelope(&bytes).unwrap().open(&seal).unwrap();
                prop_assert_eq!(frame.chunks().next().map(|c| c.payload.to_vec()), Some(payload));
            }
            let bit = bit % (bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
            prop_assert!(!verifies(&bytes, &seal));
        }
    }
}
