//! The replicated label map and its layers.
//!
//! [`MapSource`] is the vehicle's side and [`Replica`] the surface's. The link replicates any state that has
//! these two sides ([`StateSource`], [`StateReplica`]).

mod class;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
mod layer;
mod parts;
mod replica;
mod source;
mod tiles;
mod tree;
mod value;

pub use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect, TILE, UNEXPLORED};
use crate::time::Instant;
pub use class::{ClassChunk, ClassEntry, ClassReplica, ClassSource, MAX_CLASS};
pub use layer::{
    BUILT_IN_LAYERS, BuiltInLayer, Decimal, LayerCarried, LayerChunk, LayerDescriptor, LayerId, LayerMask,
    LayerReplica, LayerSet, LayerSource, Palette, Quantity, Spread, Steps, UpperEnd,
};
pub(crate) use parts::TextAssembly;
pub use parts::TextPart;
use parts::TextSender;
pub use replica::{MapDigest, Relabelled, Replica};
pub use source::MapSource;
use std::fmt::Debug;
pub use tiles::{REPLICA_TILE, ReplicaTile, ReplicaTileKey, SharedTiles};
pub use tree::{LabelTree, TreeReplica, TreeSource};
pub use value::{Hold, MAX_CONFIDENCE};

/// The sending side of a replicated state: it knows the current state and the one that the peer is known to hold.
pub trait StateSource: Debug {
    /// The content of a chunk, by which its fate is reported.
    type Carried: Debug;

    /// The most useful chunk of at most `room` bytes, if any content waits; it counts as in flight from then on.
    fn next_chunk(&mut self, room: usize, now: Instant) -> Option<(Vec<u8>, Self::Carried)>;

    /// Sets whether chunks are to be made quickly rather than as small as possible, because the channel is fast.
    fn set_quick(&mut self, _is_quick: bool) {}

    /// Sets whether the peer reads the plainest form of chunks alone.
    fn set_plain(&mut self, _is_plain: bool) {}

    /// Takes the fate of a chunk. Fates come in the order of frame numbers.
    fn handle_fate(&mut self, carried: Self::Carried, delivered: bool, now: Instant);

    /// The peer holds none of the state any more.
    fn handle_peer_restart(&mut self, now: Instant);

    /// Releases changes that were held back and are due at `_now`; returns whether there are any.
    fn handle_timeout(&mut self, _now: Instant) -> bool {
        false
    }

    /// When changes that are held back become due, or a little earlier; `None` if there are none.
    fn next_due(&self) -> Option<Instant> {
        None
    }

    /// The approximate number of bytes that wait for transmission, without those held back; rather
    /// too many than too few.
    fn backlog_bytes(&self) -> usize;

    /// Whether the waiting content is large and only refines an overview that is already sent.
    fn is_refining(&self) -> bool {
        false
    }

    /// The likely number of bytes that wait for transmission, as people should see it.
    fn expected_backlog_bytes(&self) -> usize {
        self.backlog_bytes()
    }

    /// Whether no content waits or is in flight; some may be held back.
    fn is_quiet(&self) -> bool {
        self.is_converged()
    }

    /// Whether the peer is known to hold the whole state.
    fn is_converged(&self) -> bool;

    /// A fingerprint of the state that the peer is known to hold.
    fn digest(&self) -> u16;
}

/// The receiving side of a replicated state.
pub trait StateReplica: Debug + Default + Sized {
    /// Whether a chunk that is based on every frame up to `horizon` would decode here. A frame with a chunk
    /// that does not is refused as a whole.
    fn decodes(&self, horizon: u64, chunk: &[u8]) -> bool {
        let _ = (horizon, chunk);
        true
    }

    /// Applies a chunk of frame `number`; frames may come in any order. Returns `false` if it makes no sense here.
    fn apply(&mut self, number: u64, chunk: &[u8], now: Instant) -> bool;

    /// The sender bases its chunks on every frame up to `horizon` from now on.
    fn advance_base(&mut self, horizon: u64);

    /// A fingerprint of the state that the sender knows us to hold.
    fn base_digest(&self) -> u16;

    /// Counts changes of the visible state.
    fn version(&self) -> u64;

    /// The size of the state, for example in cells. The surface keeps the copy of a run that has ended until the copy of
    /// the next run is as large; a state of size 0 is not kept.
    fn size(&self) -> usize {
        0
    }

    /// Takes the state and leaves an empty one with a higher version, because the sender has begun a new run.
    fn take(&mut self) -> Self;
}
