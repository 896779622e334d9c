//! Planes: what a cell has beside its label, in few levels. Each is replicated by itself, as the labels are.

use super::{Cell, LabelGrid, MapSource, PlaneKind, PlaneScale, Replica, StateReplica, StateSource};
use crate::map_codec::Codec;
use crate::time::Instant;
use std::fmt;
use std::time::Duration;

/// What a plane chunk begins with.
///
/// ```text
///  0               1               2               3
///  0 1 2 3 4 5 6 7 0 1 2 3 4 5 6 7 0 1 2 3 4 5 6 7 0 1 2 3 4 5 6 7
/// +-+-------------+---------------+-------------------------------+
/// |D| plane       | step          | first                         |
/// +-+-------------+---------------+-------------------------------+
///                 |<-------- depth only, and if D = 0 ----------->|
/// ```
/// * D: 0 = a map chunk of levels follows, 1 = the 16-bit digest of what the surface is known to hold follows.
/// * plane: 1 = confidence, 2 = depth, 3 = curiosity; a chunk of another plane is skipped.
/// * step: decimetres, 1..=255; first: steps from the surface to where level 1 begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneChunk<'a> {
    /// A patch of the plane.
    Patch(PlaneScale, &'a [u8]),
    /// Fingerprint of the plane that the surface is known to hold.
    Digest(PlaneKind, u16),
}

const DIGEST: u8 = 0x80;

impl<'a> PlaneChunk<'a> {
    /// Reads a chunk; `None` if it is of no plane that is known here, or makes no sense.
    pub fn decode(bytes: &'a [u8]) -> Option<Self> {
        let (&head, rest) = bytes.split_first()?;
        let kind = PlaneKind::ALL.into_iter().find(|k| k.number() == head & !DIGEST)?;
        if head & DIGEST != 0 {
            return Some(Self::Digest(kind, u16::from_be_bytes(rest.try_into().ok()?)));
        }
        match kind {
            PlaneKind::Confidence => Some(Self::Patch(PlaneScale::Confidence, rest)),
            PlaneKind::Curiosity => Some(Self::Patch(PlaneScale::Curiosity, rest)),
            PlaneKind::Depth => {
                let (&[step_dm, high, low], patch) = rest.split_first_chunk()?;
                let scale = PlaneScale::Depth { step_dm, first: u16::from_be_bytes([high, low]) };
                (step_dm > 0).then_some(Self::Patch(scale, patch))
            }
        }
    }

    /// The bytes of the chunk.
    pub fn encode(&self) -> Vec<u8> {
        match *self {
            Self::Digest(kind, digest) => [&[DIGEST | kind.number()], &digest.to_be_bytes()[..]].concat(),
            Self::Patch(scale, patch) => {
                let mut bytes = vec![scale.kind().number()];
                if let PlaneScale::Depth { step_dm, first } = scale {
                    bytes.push(step_dm);
                    bytes.extend_from_slice(&first.to_be_bytes());
                }
                bytes.extend_from_slice(patch);
                bytes
            }
        }
    }

    /// The plane that it is of.
    pub fn kind(&self) -> PlaneKind {
        match self {
            Self::Patch(scale, _) => scale.kind(),
            Self::Digest(kind, _) => *kind,
        }
    }
}

/// The vehicle's side of a plane.
#[derive(Debug)]
pub struct PlaneSource {
    scale: PlaneScale,
    levels: MapSource,
}

impl PlaneSource {
    /// A plane of which nothing is known; a level of a cell that the surface knows has to stand for `settle` to be
    /// sent.
    pub fn new(scale: PlaneScale, codec: Codec, settle: Duration) -> Self {
        let mut levels = MapSource::new(codec);
        levels.set_debounce(settle);
        Self { scale, levels }
    }

    /// What the levels mean.
    pub fn scale(&self) -> PlaneScale {
        self.scale
    }

    /// Sets the quantities of cells; returns how many cells have another level than before.
    pub fn set(&mut self, cells: impl IntoIterator<Item = (Cell, f64)>, now: Instant) -> usize {
        let held = self.levels.target();
        let level = |(cell, quantity)| (cell, self.scale.level(quantity, held.get(cell)));
        let levels: Vec<(Cell, u8)> = cells.into_iter().map(level).collect();
        self.levels.set(levels, now)
    }

    /// As [`MapSource::set_coarse_limit`].
    pub fn set_coarse_limit(&mut self, after_bytes: Option<usize>) {
        self.levels.set_coarse_limit(after_bytes);
    }

    /// Nothing is known any more.
    pub fn clear(&mut self, now: Instant) {
        self.levels.clear(now);
    }

    /// The levels as the vehicle has them.
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

    /// The chunk that says the digest.
    pub fn digest_chunk(&self) -> Vec<u8> {
        PlaneChunk::Digest(self.scale.kind(), self.levels.digest()).encode()
    }
}

impl StateSource for PlaneSource {
    type Carried = Vec<(Cell, u8)>;

    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)> {
        let head = PlaneChunk::Patch(self.scale, &[]).encode().len();
        let (patch, carried) = self.levels.next_chunk(room.checked_sub(head)?, now)?;
        Some((PlaneChunk::Patch(self.scale, &patch).encode(), carried))
    }

    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant) {
        self.levels.handle_fate(carried, delivered, now);
    }

    fn handle_peer_restart(&mut self, now: Instant) {
        self.levels.handle_peer_restart(now);
    }

    fn handle_timeout(&mut self, now: Instant) -> bool {
        self.levels.handle_timeout(now)
    }

    fn next_due(&self) -> Option<Instant> {
        self.levels.next_due()
    }

    fn backlog_bytes(&self) -> usize {
        self.levels.backlog_bytes()
    }

    fn is_quiet(&self) -> bool {
        self.levels.is_quiet()
    }

    fn is_converged(&self) -> bool {
        self.levels.is_converged()
    }

    fn digest(&self) -> u16 {
        self.levels.digest()
    }
}

/// The surface's side of a plane.
pub struct PlaneReplica {
    scale: PlaneScale,
    levels: Replica,
}

/// Without the cells: a peer chooses how many there are.
impl fmt::Debug for PlaneReplica {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PlaneReplica").field("scale", &self.scale).finish_non_exhaustive()
    }
}

impl PlaneReplica {
    /// A plane of which nothing was heard.
    pub fn new(scale: PlaneScale) -> Self {
        Self { scale, levels: Replica::default() }
    }

    /// What the levels mean.
    pub fn scale(&self) -> PlaneScale {
        self.scale
    }

    /// Levels, and when each was heard.
    pub fn levels(&self) -> &Replica {
        &self.levels
    }

    /// Applies a patch of frame `number`; `false` if it makes no sense here, or is on another scale.
    pub fn apply(&mut self, number: u64, scale: PlaneScale, patch: &[u8], now: Instant) -> bool {
        scale == self.scale && self.levels.apply_up_to(scale.levels(), number, patch, now)
    }

    /// The vehicle now bases its chunks on every frame up to `horizon`.
    pub fn advance_base(&mut self, horizon: u64) {
        self.levels.advance_base(horizon);
    }

    /// Counts changes of what is shown.
    pub fn version(&self) -> u64 {
        self.levels.version()
    }

    /// Fingerprint of what the vehicle knows us to hold.
    pub fn base_digest(&self) -> u16 {
        self.levels.base_digest()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const DEPTH: PlaneScale = PlaneScale::Depth { step_dm: 5, first: 24 };

    #[test]
    fn chunks_of_another_scale_or_of_levels_that_are_none_are_refused() {
        let mut labels = MapSource::new(Codec::Png);
        labels.set([(Cell::new(3, 4), 5), (Cell::new(4, 4), 1)], Instant::ZERO);
        let (patch, _) = labels.next_chunk(100, Instant::ZERO).unwrap();
        let mut confidence = PlaneReplica::new(PlaneScale::Confidence);
        assert!(!confidence.apply(1, PlaneScale::Confidence, &patch, Instant::ZERO), "there is no level 5");
        let mut depth = PlaneReplica::new(DEPTH);
        assert!(!depth.apply(1, PlaneScale::Depth { step_dm: 5, first: 25 }, &patch, Instant::ZERO));
        assert!(depth.levels().shown().is_empty());
        assert!(depth.apply(1, DEPTH, &patch, Instant::ZERO));
        assert_eq!(depth.levels().shown().get(Cell::new(3, 4)), 5);
    }

    proptest! {
        #[test]
        fn a_chunk_reads_back(head in 0u8..=255, bytes in proptest::collection::vec(any::<u8>(), 0..12)) {
            let bytes = [&[head], &bytes[..]].concat();
            if let Some(chunk) = PlaneChunk::decode(&bytes) {
                prop_assert_eq!(chunk.encode(), bytes);
            }
        }
    }
}
