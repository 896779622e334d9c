//! Chunks, the content of a frame.

/// The kinds of chunks that a frame can carry.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ChunkKind {
    /// A patch of the label map.
    Map,
    /// Position, mode and path of the vehicle.
    Pose,
    /// One slot of the directive.
    Slot,
    /// A part of an object that is larger than a frame.
    Object,
    /// The vehicle's report on its map and on the directive.
    Report,
    /// A patch of a layer of the map, or a digest of the surface's copy of one.
    Layer,
    /// The introduction of a hello's sender.
    Introduction,
    /// A part of the content in force of a slot.
    InForce,
    /// The digests of the content in force that the surface holds, as a request for the rest.
    Inquiry,
    /// Faults, intent, registration and trail of a pose.
    Details,
    /// A part of the name and the colour of a label.
    LabelClass,
    /// A part of the tree of labels.
    LabelTree,
    /// The introduction of another surface that calls the vehicle.
    Caller,
    /// A part of the next key of the vehicle.
    NextKey,
}

/// The code after which the first byte of the payload names the kind.
const EXTENDED: u8 = 7;

impl ChunkKind {
    const ALL: [Self; 14] = [
        Self::Map,
        Self::Pose,
        Self::Slot,
        Self::Object,
        Self::Report,
        Self::Layer,
        Self::Introduction,
        Self::InForce,
        Self::Inquiry,
        Self::Details,
        Self::LabelClass,
        Self::LabelTree,
        Self::Caller,
        Self::NextKey,
    ];

    /// The code in the header of the chunk, and the byte that begins the payload of an extended kind.
    fn code(self) -> (u8, Option<u8>) {
        match self {
            Self::Map => (1, None),
            Self::Pose => (2, None),
            Self::Slot => (3, None),
            Self::Object => (4, None),
            Self::Report => (5, None),
            Self::Layer => (6, None),
            Self::Introduction => (EXTENDED, Some(0)),
            Self::InForce => (EXTENDED, Some(1)),
            Self::Inquiry => (EXTENDED, Some(2)),
            Self::Details => (EXTENDED, Some(3)),
            Self::LabelClass => (EXTENDED, Some(4)),
            Self::LabelTree => (EXTENDED, Some(5)),
            Self::Caller => (EXTENDED, Some(6)),
            Self::NextKey => (EXTENDED, Some(7)),
        }
    }
}

/// One chunk of a frame.
///
/// ```text
///  0 1 2 3 4 5 6 7
/// +-----+---------+----------------+-----------+
/// |kind | length  | [more length]  | payload   |
/// +-----+---------+----------------+-----------+
/// kind     0 end of the frame's content, 1 map, 2 pose, 3 slot, 4 object, 5 report, 6 layer;
///          7 extended: the first byte of the payload is 0 introduction, 1 content in force, 2 inquiry, 3 details of a pose, 4 class, 5 tree, 6 caller,
///          7 next key;
///          any other value, or no payload: skipped
/// length   0..26 bytes of payload; 27..30: 27 + 256 x (length - 27) + next byte; 31: to the end of the frame
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Chunk<'a> {
    /// The kind, which names the format of the payload.
    pub kind: ChunkKind,
    /// The payload, without the header and without the byte of an extended kind.
    pub payload: &'a [u8],
}

/// Bytes that the header of a chunk takes when `payload` bytes go into `room`.
fn chunk_header_len(payload: usize, room: usize) -> usize {
    match payload {
        0..=26 => 1,
        n if n + 1 == room => 1,
        _ => 2,
    }
}

/// The longest payload of a chunk in bytes.
const MAX_PAYLOAD: usize = 27 + 1023;

/// The longest payload of a single chunk in `room` bytes, at most 1050; every shorter payload fits too.
pub fn room_for_payload(room: usize) -> usize {
    room.saturating_sub(1).min(MAX_PAYLOAD)
}

/// Appends a chunk to a frame body that can still take `room` bytes; returns whether it fitted.
pub(super) fn push_chunk(kind: ChunkKind, payload: &[u8], room: usize, out: &mut Vec<u8>) -> bool {
    let (code, extended) = kind.code();
    let n = payload.len() + usize::from(extended.is_some());
    if n + chunk_header_len(n, room) > room || n > MAX_PAYLOAD {
        return false;
    }
    let head = code << 5;
    match n {
        0..=26 => out.push(head | n as u8),
        n if n + 1 == room => out.push(head | 31),
        _ => out.extend_from_slice(&[head | (27 + ((n - 27) >> 8)) as u8, (n - 27) as u8]),
    }
    out.extend(extended);
    out.extend_from_slice(payload);
    true
}

/// Whether a second byte of length follows the first byte of a chunk.
pub(super) fn has_second_byte(head: u8) -> bool {
    (27..31).contains(&(head & 31))
}

/// Leaves out the second byte of the length of a chunk at `at`, which goes to the end of `out`.
pub(super) fn to_the_end(at: usize, out: &mut Vec<u8>) {
    if let Some(head) = out.get_mut(at).filter(|head| has_second_byte(**head)) {
        *head |= 31;
        out.remove(at + 1);
    }
}

/// The chunks of a received frame, in order; ends at the first malformed one. Chunks of unknown kinds are skipped.
#[derive(Debug, Clone, Default)]
pub struct Chunks<'a> {
    body: &'a [u8],
}

impl<'a> Chunks<'a> {
    pub(super) fn new(body: &'a [u8]) -> Self {
        Self { body }
    }

    /// Whether every chunk of the frame is well formed.
    pub fn are_sound(&self) -> bool {
        let mut all = self.clone();
        while all.next().is_some() {}
        all.body.is_empty()
    }

    /// The code and the payload of the next chunk, and the bytes after it.
    fn split(&self) -> Option<(u8, &'a [u8], &'a [u8])> {
        let (&head, rest) = self.body.split_first()?;
        if head >> 5 == 0 {
            return Some((0, &[], &[]));
        }
        let (len, rest) = match head & 31 {
            31 => (rest.len(), rest),
            n @ 27..=30 => {
                let (low, rest) = rest.split_first()?;
                (27 + usize::from(n - 27) * 256 + usize::from(*low), rest)
            }
            n => (usize::from(n), rest),
        };
        let (payload, rest) = rest.split_at_checked(len)?;
        Some((head >> 5, payload, rest))
    }
}

/// The chunk with this code and payload; `None` if its kind is unknown.
fn known(code: u8, payload: &[u8]) -> Option<Chunk<'_>> {
    let (extended, payload) = match code {
        EXTENDED => payload.split_first().map(|(&kind, payload)| (Some(kind), payload))?,
        _ => (None, payload),
    };
    let kind = ChunkKind::ALL.into_iter().find(|kind| kind.code() == (code, extended))?;
    Some(Chunk { kind, payload })
}

impl<'a> Iterator for Chunks<'a> {
    type Item = Chunk<'a>;

    fn next(&mut self) -> Option<Chunk<'a>> {
        loop {
            let (code, payload, rest) = self.split()?;
            self.body = rest;
            if code == 0 {
                return None;
            }
            if let Some(chunk) = known(code, payload) {
                return Some(chunk);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_last_chunk_filling_the_frame_has_a_short_header() {
        let mut out = Vec::new();
        assert!(push_chunk(ChunkKind::Map, &[7; 200], 201, &mut out));
        assert_eq!((out.len(), out[0]), (201, 0b001_11111));
    }

    #[test]
    fn every_payload_fits_that_is_not_larger_than_its_room() {
        for room in 1..=1024 {
            for n in 0..=room_for_payload(room) {
                let mut out = Vec::new();
                assert!(push_chunk(ChunkKind::Map, &vec![7; n], room, &mut out), "{n} bytes in {room}");
                out.resize(room, 0);
                assert_eq!(Chunks::new(&out).next().map(|c| c.payload.len()), Some(n));
            }
        }
    }

    #[test]
    fn unknown_kinds_are_skipped_by_their_length() {
        let mut body = Vec::new();
        assert!(push_chunk(ChunkKind::Introduction, &[1, 2, 3], 40, &mut body));
        assert_eq!(body, [0b111_00100, 0, 1, 2, 3]);
        body.extend([0b111_00011, 200, 9, 9, 0b111_00000]);
        assert!(push_chunk(ChunkKind::Pose, &[4], 20, &mut body));
        let chunks = Chunks::new(&body);
        assert!(chunks.are_sound());
        let kinds: Vec<_> = chunks.map(|chunk| (chunk.kind, chunk.payload)).collect();
        assert_eq!(kinds, [(ChunkKind::Introduction, &[1, 2, 3][..]), (ChunkKind::Pose, &[4][..])]);
    }

    proptest! {
        #[test]
        fn chunks_come_back_in_order(sizes in proptest::collection::vec(0usize..400, 0..6), slack in 0usize..40) {
            let room = sizes.iter().sum::<usize>() + 3 * sizes.len() + slack;
            let mut body = Vec::new();
            for (i, &n) in sizes.iter().enumerate() {
                let left = room - body.len();
                prop_assert!(push_chunk(ChunkKind::Map, &vec![i as u8; n], left, &mut body));
            }
            body.resize(room, 0);
            let chunks = Chunks::new(&body);
            prop_assert!(chunks.are_sound());
            let back: Vec<usize> = chunks.map(|c| c.payload.len()).collect();
            prop_assert_eq!(back, sizes);
        }

        #[test]
        fn any_body_ends(body in proptest::collection::vec(any::<u8>(), 0..400)) {
            prop_assert!(Chunks::new(&body).count() <= body.len());
        }
    }
}
