//! Texts of bytes that reach the surface in parts: descriptions of layers, names of labels, the tree of labels, content in force.

use crate::bytes::Reader;
use crc::{CRC_16_IBM_3740, Crc};

/// Consecutive bytes of a text.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +-------------------------------+-+-+-----------+---------------+
/// | digest of the text            |L|W| first (6 bits, or 14)     | bytes ...
/// +-------------------------------+-+-+-----------+---------------+
/// ```
/// * L: the text ends with this part.
/// * first: place of the first byte of the part in the text; 6 bits if W is 0, 14 if it is 1, and then above 63.
/// * at least one byte.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TextPart<'a> {
    /// The digest of the whole text.
    pub digest: u16,
    /// Place of the first of the bytes, at most [`Self::MAX_FIRST`].
    pub first: u16,
    /// Whether the bytes are the last ones.
    pub is_last: bool,
    /// Bytes of the text from `first` on, at least one.
    pub bytes: &'a [u8],
}

impl<'a> TextPart<'a> {
    /// Bytes before those of a text of at most [`Self::SHORT_TEXT`] bytes.
    pub const HEAD: usize = 3;
    /// Most bytes before those of any text.
    pub const LONG_HEAD: usize = Self::HEAD + 1;
    /// Most bytes of a text whose parts all have the shorter head.
    pub const SHORT_TEXT: usize = 64;
    /// The highest place of a part.
    pub const MAX_FIRST: u16 = (1 << 14) - 1;
    const LAST: u8 = 0x80;
    const WIDE: u8 = 0x40;

    /// Reads a part; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let mut r = Reader::new(bytes);
        let (digest, head) = (r.u16().ok()?, r.u8().ok()?);
        let (is_last, is_wide) = (head & Self::LAST != 0, head & Self::WIDE != 0);
        let mut first = u16::from(head & !(Self::LAST | Self::WIDE));
        if is_wide {
            first = first << 8 | u16::from(r.u8().ok()?);
        }
        let is_shortest = is_wide == (usize::from(first) >= Self::SHORT_TEXT);
        let part = Self { digest, first, is_last, bytes: r.rest() };
        (is_shortest && !part.bytes.is_empty()).then_some(part)
    }

    /// The bytes of the part.
    pub fn encode(&self) -> Vec<u8> {
        let last = if self.is_last { Self::LAST } else { 0 };
        let [high, low] = (self.first & Self::MAX_FIRST).to_be_bytes();
        let mut out = self.digest.to_be_bytes().to_vec();
        match usize::from(self.first) < Self::SHORT_TEXT {
            true => out.push(last | low),
            false => out.extend([last | Self::WIDE | high, low]),
        }
        out.extend_from_slice(self.bytes);
        out
    }

    /// Fingerprint of a text: CRC-16/IBM-3740, or 1 where that is 0.
    pub fn digest_of(text: &[u8]) -> u16 {
        const CRC: Crc<u16> = Crc::<u16>::new(&CRC_16_IBM_3740);
        CRC.checksum(text).max(1)
    }
}

/// The vehicle's side: sends a text in parts that fit the frames, each until it is known to have arrived, one at a time.
#[derive(Debug)]
pub(in crate::map) struct TextSender {
    text: Vec<u8>,
    digest: u16,
    /// Bytes that the surface is known to hold.
    held: usize,
    is_on_air: bool,
}

impl TextSender {
    /// Fewer bytes of a text are not worth the head of a chunk, unless they are the last ones.
    const MIN_PART: usize = 8;

    /// A text of at most [`TextPart::SHORT_TEXT`] bytes.
    pub(super) fn new(text: Vec<u8>) -> Self {
        Self { digest: TextPart::digest_of(&text), text, held: 0, is_on_air: false }
    }

    pub(super) fn digest(&self) -> u16 {
        self.digest
    }

    fn missing(&self) -> usize {
        self.text.len() - self.held
    }

    pub(super) fn is_complete(&self) -> bool {
        self.missing() == 0
    }

    /// Bytes that may be sent now.
    pub(super) fn backlog_bytes(&self) -> usize {
        if self.is_on_air || self.is_complete() { 0 } else { self.missing() + TextPart::HEAD }
    }

    /// The next part in at most `room` bytes, and how many of the text it has.
    pub(super) fn next_part(&mut self, room: usize) -> Option<(Vec<u8>, usize)> {
        let rest = self.text.get(self.held..).filter(|rest| !rest.is_empty() && !self.is_on_air)?;
        let n = room.checked_sub(TextPart::HEAD)?.min(rest.len());
        let bytes = rest.get(..n).filter(|_| n >= Self::MIN_PART.min(rest.len()))?;
        let part = TextPart { digest: self.digest, first: self.held as u16, is_last: n == rest.len(), bytes };
        self.is_on_air = true;
        Some((part.encode(), n))
    }

    /// The fate of the part on the air, which has `bytes` of the text, is known.
    pub(super) fn handle_fate(&mut self, bytes: usize, delivered: bool) {
        if std::mem::take(&mut self.is_on_air) && delivered {
            self.held += bytes.min(self.missing());
        }
    }

    pub(super) fn handle_peer_restart(&mut self) {
        (self.held, self.is_on_air) = (0, false);
    }
}

/// The surface's side: the parts that are here, from the first byte on.
#[derive(Debug, Default)]
pub(crate) struct TextAssembly {
    digest: u16,
    text: Vec<u8>,
}

impl TextAssembly {
    /// Takes a part of a text of at most `most` bytes. `None` if it does not continue the others, or if all of them together do not
    /// have its digest; else the text, once it is whole.
    pub(crate) fn take(&mut self, part: &TextPart<'_>, most: usize) -> Option<Option<Vec<u8>>> {
        if part.first == 0 {
            (self.digest, self.text) = (part.digest, Vec::new());
        }
        let fits = usize::from(part.first) == self.text.len() && part.digest == self.digest;
        if !fits || self.text.len() + part.bytes.len() > most {
            return None;
        }
        self.text.extend_from_slice(part.bytes);
        if !part.is_last {
            return Some(None);
        }
        let text = std::mem::take(&mut self.text);
        (TextPart::digest_of(&text) == self.digest).then_some(Some(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sender(text: &[u8]) -> TextSender {
        TextSender::new(text.to_vec())
    }

    fn take(assembly: &mut TextAssembly, part: &[u8]) -> Option<Option<Vec<u8>>> {
        assembly.take(&TextPart::decode(part).expect("a part"), TextPart::SHORT_TEXT)
    }

    #[test]
    fn golden_bytes_of_a_part() {
        let part = TextPart { digest: 0xBEEF, first: 8, is_last: true, bytes: &[1, 2] };
        assert_eq!(part.encode(), [0xBE, 0xEF, 0x88, 1, 2]);
        assert_eq!(TextPart::decode(&part.encode()), Some(part));
        let far = TextPart { first: 300, is_last: false, ..part };
        assert_eq!(far.encode(), [0xBE, 0xEF, 0x41, 0x2C, 1, 2]);
        assert_eq!(TextPart::decode(&far.encode()), Some(far));
        assert_eq!((TextPart::digest_of(b"123456789"), TextPart::digest_of(&[])), (0x29B1, 0xFFFF));
        for bytes in [&[][..], &[0xBE, 0xEF, 0x88], &[0, 0, 0x40, 1], &[0, 0, 0x40, 63, 1], &[0, 0, 0x41, 1]] {
            assert_eq!(TextPart::decode(bytes), None, "{bytes:02X?}");
        }
    }

    #[test]
    fn a_text_arrives_in_frames_of_any_size() {
        let text: Vec<u8> = (0..64).collect();
        for room in 11..80 {
            let (mut sender, mut assembly, mut whole) = (sender(&text), TextAssembly::default(), None);
            for turn in 0.. {
                let Some((part, n)) = sender.next_part(room) else { break };
                assert!(part.len() <= room && sender.next_part(room).is_none());
                let is_lost = turn % 3 == 1;
                if !is_lost {
                    whole = take(&mut assembly, &part).expect("it continues the others");
                }
                sender.handle_fate(n, !is_lost);
            }
            assert_eq!((whole.as_ref(), sender.is_complete()), (Some(&text), true), "{room}");
        }
        assert_eq!(sender(&text).next_part(10), None);
    }

    #[test]
    fn parts_that_do_not_belong_together_are_refused() {
        let text = b"twenty bytes of text";
        let mut sender = sender(text);
        let (first, n) = sender.next_part(14).unwrap();
        sender.handle_fate(n, true);
        let (second, _) = sender.next_part(60).unwrap();
        let mut assembly = TextAssembly::default();
        assert_eq!(take(&mut assembly, &second), None, "the first part is not here");
        assert_eq!(take(&mut assembly, &first), Some(None));
        let mut other = second.clone();
        other[1] ^= 1;
        assert_eq!(take(&mut assembly, &other), None, "of another text");
        assert_eq!(take(&mut assembly, &second), Some(Some(text.to_vec())));
        assert_eq!(take(&mut assembly, &first), Some(None));
        let mut damaged = second;
        *damaged.last_mut().unwrap() ^= 1;
        assert_eq!(take(&mut assembly, &damaged), None, "not what its digest stands for");
    }

    proptest! {
        #[test]
        fn any_part_is_taken_or_refused(parts in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..70), 0..9)) {
            let mut assembly = TextAssembly::default();
            for bytes in &parts {
                let Some(part) = TextPart::decode(bytes) else { continue };
                prop_assert_eq!(&part.encode(), bytes);
                let _ = assembly.take(&part, TextPart::SHORT_TEXT);
            }
        }
    }
}
