//! Class chunks: parts of the name and the colour of a label.

use crate::map::MAX_LABEL;

/// A part of the entry of a label.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---------------+-------------------------------+-+-+-----------+
/// | label         | digest of the entry           |L|0| first     | bytes ...
/// +---------------+-------------------------------+-+-+-----------+
/// ```
/// * label: 1 to 254.
/// * L: the entry ends with this part; first: place of the first byte of the part in the entry; at least one byte.
///
/// Source: vehicle, for each label with a name, before or after the cells that have it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClassChunk<'a> {
    /// The label of the entry.
    pub label: u8,
    /// The digest of the whole entry ([`super::ClassEntry::digest_of`]).
    pub digest: u16,
    /// Place of the first of the bytes, 0 to 63.
    pub first: u8,
    /// Whether the bytes are the last ones.
    pub is_last: bool,
    /// Bytes of the entry from `first` on, at least one.
    pub bytes: &'a [u8],
}

impl<'a> ClassChunk<'a> {
    /// Bytes before those of the entry.
    pub const HEAD: usize = 4;
    const LAST: u8 = 0x80;

    /// Reads a chunk; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&[label, high, low, place], bytes) = bytes.split_first_chunk()?;
        let (digest, is_last) = (u16::from_be_bytes([high, low]), place & Self::LAST != 0);
        let chunk = Self { label, digest, first: place & !Self::LAST, is_last, bytes };
        (chunk.first < 0x40 && !bytes.is_empty() && (1..=MAX_LABEL).contains(&label)).then_some(chunk)
    }

    /// The bytes of the chunk.
    pub fn encode(&self) -> Vec<u8> {
        let [high, low] = self.digest.to_be_bytes();
        let place = self.first | if self.is_last { Self::LAST } else { 0 };
        [&[self.label, high, low, place], self.bytes].concat()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_a_class_chunk() {
        let chunk = ClassChunk { label: 3, digest: 0xBEEF, first: 8, is_last: true, bytes: &[1, 2] };
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
