//! Layers: one quantity a cell beside the label, in few levels. A descriptor gives them their meaning; each is replicated by
//! itself, as the labels are.

mod descriptor;
mod set;

use super::{Cell, LabelGrid, MapSource, Replica, StateReplica, StateSource, TextPart, TextSender, UNEXPLORED};
use crate::map_codec::Codec;
use crate::time::Instant;
pub use descriptor::{Decimal, LayerDescriptor, Palette, Quantity, Spread, Steps, UpperEnd};
pub use set::{BUILT_IN_LAYERS, BuiltInLayer, LayerId, LayerMask, LayerSet};
use std::fmt;
use std::time::Duration;

/// The vehicle's side of a layer.
#[derive(Debug)]
pub struct LayerSource {
    id: LayerId,
    descriptor: LayerDescriptor,
    announcement: TextSender,
    levels: MapSource,
}

/// Content of a layer chunk on the air.
#[derive(Debug)]
pub enum LayerCarried {
    /// So many bytes of the description.
    Descriptor(usize),
    /// Cells with the levels that a patch carries.
    Levels(Vec<(Cell, u8)>),
}

impl LayerSource {
    /// A layer in which every level is still unknown. A new level of a cell that the surface knows has to stand for `debounce` to be sent.
    pub fn new(id: LayerId, descriptor: LayerDescriptor, codec: Codec, debounce: Duration) -> Self {
        let mut levels = MapSource::new(codec);
        levels.set_debounce(debounce);
        Self { id, announcement: TextSender::new(descriptor.to_bytes()), descriptor, levels }
    }

    /// Its index on this vehicle.
    pub fn id(&self) -> LayerId {
        self.id
    }

    /// The meaning of its levels.
    pub fn descriptor(&self) -> &LayerDescriptor {
        &self.descriptor
    }

    /// Sets the quantities of cells, in the descriptor's unit; returns how many cells have another level than before.
    pub fn set(&mut self, cells: impl IntoIterator<Item = (Cell, f64)>, now: Instant) -> usize {
        let held = self.levels.target();
        let level = |(cell, quantity)| (cell, self.descriptor.level(quantity, held.get(cell)));
        let levels: Vec<(Cell, u8)> = cells.into_iter().map(level).collect();
        self.set_levels(levels, now)
    }

    /// Sets levels of cells, 0 or one that the layer lacks for a cell that is not known; returns how many cells have another level
    /// than before.
    pub fn set_levels(&mut self, cells: impl IntoIterator<Item = (Cell, u8)>, now: Instant) -> usize {
        let most = self.descriptor.levels;
        let known = |(cell, level)| (cell, if level <= most { level } else { UNEXPLORED });
        self.levels.set(cells.into_iter().map(known), now)
    }

    /// Sets the backlog above which coarse cells go first, as [`MapSource::set_coarse_limit`] does.
    pub fn set_coarse_limit(&mut self, after_bytes: Option<usize>) {
        self.levels.set_coarse_limit(after_bytes);
    }

    /// Makes every cell's level unknown.
    pub fn clear(&mut self, now: Instant) {
        self.levels.clear(now);
    }

    /// The levels that the surface ought to hold.
    pub fn target(&self) -> &LabelGrid {
        self.levels.target()
    }

    /// Versions of the levels so far.
    pub fn version(&self) -> u64 {
        self.levels.version()
    }

    /// Whether the surface is known to hold any level.
    pub fn is_begun(&self) -> bool {
        !self.levels.acked().is_empty()
    }

    /// The chunk with the digest of the levels that the surface is known to hold.
    pub fn digest_chunk(&self) -> Vec<u8> {
        LayerChunk::Digest(self.id, self.digest()).encode()
    }
}

impl StateSource for LayerSource {
    type Carried = LayerCarried;

    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        if !self.announcement.is_complete() {
            // A layer without levels is not announced.
            let _ = Some(self.levels.backlog_bytes()).filter(|&waiting| waiting > 0)?;
            let (part, bytes) = self.announcement.next_part(room.checked_sub(LayerChunk::DESCRIPTOR_HEAD)?)?;
            let part = TextPart::decode(&part)?;
            return Some((LayerChunk::Descriptor(self.id, part).encode(), LayerCarried::Descriptor(bytes)));
        }
        let (patch, carried) = self.levels.next_chunk(room.checked_sub(LayerChunk::PATCH_HEAD)?, now)?;
        Some((LayerChunk::Patch(self.id, &patch).encode(), LayerCarried::Levels(carried)))
    }

    fn set_quick(&mut self, is_quick: bool) {
        self.levels.set_quick(is_quick);
    }

    fn set_plain(&mut self, is_plain: bool) {
        self.levels.set_plain(is_plain);
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant) {
        match carried {
            LayerCarried::Descriptor(bytes) => self.announcement.handle_fate(bytes, delivered),
            LayerCarried::Levels(levels) => self.levels.handle_fate(levels, delivered, now),
        }
    }

    fn handle_peer_restart(&mut self, now: Instant) {
        self.announcement.handle_peer_restart();
        self.levels.handle_peer_restart(now);
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.levels.handle_timeout(now)
    }

    fn next_due(&self) -> Option<Instant> {
        self.levels.next_due()
    }

    /// Until the surface is known to hold the description, that alone can be sent.
    fn backlog_bytes(&self) -> usize {
        match self.levels.backlog_bytes() {
            waiting if waiting > 0 && !self.announcement.is_complete() => match self.announcement.backlog_bytes() {
                0 => 0,
                bytes => bytes + LayerChunk::DESCRIPTOR_HEAD,
            },
            waiting => waiting,
        }
    }

    fn is_quiet(&self) -> bool {
        self.levels.is_quiet()
    }

    fn is_converged(&self) -> bool {
        self.levels.is_converged()
    }

    fn digest(&self) -> u16 {
        self.levels.digest() ^ self.announcement.digest()
    }
}

/// The surface's side of a layer.
pub struct LayerReplica {
    descriptor: LayerDescriptor,
    levels: Replica,
}

/// Without the cells: a peer chooses how many there are.
impl fmt::Debug for LayerReplica {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LayerReplica").field("descriptor", &self.descriptor).finish_non_exhaustive()
    }
}

impl LayerReplica {
    /// A layer in which every level is still unknown.
    pub fn new(descriptor: LayerDescriptor) -> Self {
        Self { descriptor, levels: Replica::default() }
    }

    /// The meaning of its levels.
    pub fn descriptor(&self) -> &LayerDescriptor {
        &self.descriptor
    }

    /// The levels, and when each was received.
    pub fn levels(&self) -> &Replica {
        &self.levels
    }

    /// Whether a patch that is based on every frame up to `horizon` would decode.
    pub fn decodes(&self, horizon: u64, patch: &[u8]) -> bool {
        self.levels.decodes_up_to(self.descriptor.levels, horizon, patch)
    }

    /// Puts a level back that an earlier run of the surface has received; see [`Replica::restore`].
    pub fn restore(&mut self, cell: Cell, level: u8, at: Instant) {
        self.levels.restore(cell, level, at);
    }

    /// Applies a patch of frame `number`; `false` if it makes no sense on the base, or has levels that the layer lacks.
    pub fn apply(&mut self, number: u64, patch: &[u8], now: Instant) -> bool {
        self.levels.apply_up_to(self.descriptor.levels, number, patch, now)
    }

    /// The vehicle now bases its chunks on every frame up to `horizon`.
    pub fn advance_base(&mut self, horizon: u64) {
        self.levels.advance_base(horizon);
    }

    /// Counts changes of the shown levels.
    pub fn version(&self) -> u64 {
        self.levels.version()
    }

    /// Fingerprint of the description and of the levels that the vehicle knows the surface to hold.
    pub fn base_digest(&self) -> u16 {
        self.levels.base_digest() ^ self.descriptor.digest()
    }
}

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

    fn layer(id: LayerId) -> LayerDescriptor {
        LayerSet::default().get(id).unwrap().clone()
    }

    #[test]
    fn chunks_with_levels_that_a_layer_lacks_are_refused() {
        let mut labels = MapSource::new(Codec::Png);
        labels.set([(Cell::new(3, 4), 5), (Cell::new(4, 4), 1)], Instant::ZERO);
        let (patch, _) = labels.next_chunk(100, Instant::ZERO).unwrap();
        let mut confidence = LayerReplica::new(layer(LayerId::CONFIDENCE));
        assert!(!confidence.apply(1, &patch, Instant::ZERO), "there is no level 5");
        let mut depth = LayerReplica::new(layer(LayerId::DEPTH));
        assert!(depth.levels().shown().is_empty());
        assert!(depth.apply(1, &patch, Instant::ZERO));
        assert_eq!(depth.levels().shown().get(Cell::new(3, 4)), 5);
    }

    #[test]
    fn levels_wait_for_the_description() {
        let id = LayerId::CURIOSITY;
        let mut source = LayerSource::new(id, layer(id), Codec::Png, Duration::ZERO);
        assert_eq!(source.backlog_bytes(), 0, "a layer without levels is not announced");
        source.set([(Cell::new(0, 0), 3.5)], Instant::ZERO);
        let bytes = source.descriptor().to_bytes().len();
        assert_eq!(source.backlog_bytes(), bytes + LayerChunk::DESCRIPTOR_HEAD + TextPart::HEAD);
        let (chunk, carried) = source.next_chunk(100, Instant::ZERO).unwrap();
        assert!(matches!(LayerChunk::decode(&chunk), Some(LayerChunk::Descriptor(..))));
        assert!(source.next_chunk(100, Instant::ZERO).is_none() && source.backlog_bytes() == 0 && !source.is_quiet());
        source.handle_fate(carried, true, Instant::ZERO);
        let (chunk, _) = source.next_chunk(100, Instant::ZERO).unwrap();
        assert!(matches!(LayerChunk::decode(&chunk), Some(LayerChunk::Patch(..))));
        source.handle_peer_restart(Instant::ZERO);
        let (chunk, _) = source.next_chunk(100, Instant::ZERO).unwrap();
        assert!(matches!(LayerChunk::decode(&chunk), Some(LayerChunk::Descriptor(..))));
    }

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
