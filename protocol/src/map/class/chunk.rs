//! Class chunks: parts of the name and the colour of a label.

use crate::map::{MAX_LABEL, TextPart};

/// A part of the entry of a label.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---------------+-------------------------------+-+-+-----------+
/// | label         | digest of the entry           |L|W| first     | bytes ...
/// +---------------+-------------------------------+-+-+-----------+
/// ```
/// * label: 1 to 254.
/// * from the digest of the entry on: a part of it ([`TextPart`]).
///
/// Source: vehicle, for each label with a name, before or after the cells that have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClassChunk<'a> {
    /// The label of the entry.
    pub label: u8,
    /// A part of the entry, whose digest is [`TextPart::digest_of`].
    pub part: TextPart<'a>,
}

impl<'a> ClassChunk<'a> {
    /// Bytes before the part: the label of the entry.
    pub const HEAD: usize = 1;

    /// Reads a chunk; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&label, part) = bytes.split_first()?;
        let part = TextPart::decode(part)?;
        (1..=MAX_LABEL).contains(&label).then_some(Self { label, part })
    }

    /// The bytes of the chunk.
    pub fn encode(&self) -> Vec<u8> {
        [&[self.label], &self.part.encode()[..]].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_a_class_chunk() {
        let part = TextPart { digest: 0xBEEF, first: 8, is_last: true, bytes: &[1, 2] };
        let chunk = ClassChunk { label: 3, part };
        assert_eq!(chunk.encode(), [3, 0xBE, 0xEF, 0x88, 1, 2]);
        assert_eq!(ClassChunk::decode(&chunk.encode()), Some(chunk));
        for bytes in [&[][..], &[3, 0xBE, 0xEF, 0x88], &[0, 0, 0, 0, 1], &[255, 0, 0, 0, 1], &[3, 0, 0, 0x40, 1]] {
            assert_eq!(ClassChunk::decode(bytes), None, "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn a_class_chunk_reads_back(bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            if let Some(chunk) = ClassChunk::decode(&bytes) {
                prop_assert_eq!(chunk.encode(), bytes);
            }
        }
    }
}
