//! Layer chunks: levels of a layer, their digest and the layer's description.

use super::{LayerDescriptor, LayerId};
use crate::map::TextPart;

/// A chunk about a layer.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---+---+-------+-----------------------
/// | 0 |0 0| layer | map chunk of levels ...
/// +---+---+-------+-------------------------------+
/// | 1 |0 0| layer | digest of the levels          |
/// +---+---+-------+-------------------------------+-+-+-----------+
/// | 2 |0 0| layer | digest of the descriptor      |L|W| first     | bytes ...
/// +---+---+-------+-------------------------------+-+-+-----------+
/// ```
/// * layer: its index, 0 to 15.
/// * digest of the levels: the exclusive or of the map digest of the levels that the surface is known to hold and of the
///   digest of the descriptor.
/// * from the digest of the descriptor on: a part of it ([`TextPart`]).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayerChunk<'a> {
    /// A patch of the layer.
    Patch(LayerId, &'a [u8]),
    /// Fingerprint of the layer that the surface is known to hold.
    Digest(LayerId, u16),
    /// A part of the layer's description.
    Descriptor(LayerId, TextPart<'a>),
}

impl<'a> LayerChunk<'a> {
    /// Bytes of a patch chunk before the map chunk.
    pub const PATCH_HEAD: usize = 1;
    /// Bytes of a descriptor chunk before the part.
    pub const DESCRIPTOR_HEAD: usize = 1;

    /// Reads a chunk; `None` if it makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&head, rest) = bytes.split_first()?;
        let id = LayerId::new(usize::from(head & 0x3F))?;
        match head >> 6 {
            0 => Some(Self::Patch(id, rest)),
            1 => Some(Self::Digest(id, u16::from_be_bytes(rest.try_into().ok()?))),
            2 => TextPart::decode(rest).map(|part| Self::Descriptor(id, part)),
            _ => None,
        }
    }

    /// The bytes of the chunk.
    pub fn encode(&self) -> Vec<u8> {
        match *self {
            Self::Patch(id, patch) => [&[id.index() as u8], patch].concat(),
            Self::Digest(id, digest) => [&[0x40 | id.index() as u8], &digest.to_be_bytes()[..]].concat(),
            Self::Descriptor(id, part) => [&[0x80 | id.index() as u8], &part.encode()[..]].concat(),
        }
    }

    /// The layer that it is of.
    pub fn id(&self) -> LayerId {
        match *self {
            Self::Patch(id, _) | Self::Digest(id, _) | Self::Descriptor(id, _) => id,
        }
    }
}

// A description fits one chunk of at most 48 bytes.
const _: () = assert!(LayerDescriptor::MAX_BYTES + LayerChunk::DESCRIPTOR_HEAD + TextPart::HEAD <= 48);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_layer_chunks() {
        let golden = |chunk: LayerChunk<'_>, bytes: &[u8]| {
            assert_eq!(chunk.encode(), bytes);
            assert_eq!(LayerChunk::decode(bytes), Some(chunk));
        };
        golden(LayerChunk::Patch(LayerId::CONFIDENCE, &[7]), &[0x01, 7]);
        golden(LayerChunk::Digest(LayerId::CURIOSITY, 0x27A6), &[0x42, 0x27, 0xA6]);
        let part = TextPart { digest: 0xBEEF, first: 8, is_last: true, bytes: &[1, 2] };
        golden(LayerChunk::Descriptor(LayerId::DEPTH, part), &[0x80, 0xBE, 0xEF, 0x88, 1, 2]);
        for bytes in [&[][..], &[0x10, 7], &[0xC1, 7], &[0x42, 0x27], &[0x80, 0xBE, 0xEF, 0x88], &[0x80, 1, 2, 0x48, 1]]
        {
            assert_eq!(LayerChunk::decode(bytes), None, "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn a_chunk_reads_back(head in 0u8..=255, bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            let bytes = [&[head], &bytes[..]].concat();
            if let Some(chunk) = LayerChunk::decode(&bytes) {
                prop_assert_eq!(chunk.encode(), bytes);
            }
        }
    }
}
