//! The replicated label map and its layers.
//!
//! [`MapSource`] is the vehicle's side and [`Replica`] the surface's. The link replicates any state that has
//! these two sides ([`StateSource`], [`StateReplica`]).

mod class;
mod coarse;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
mod layer;
mod parts;
mod replica;
mod source;
mod stream;
mod tiles;
mod tree;
mod value;

pub use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect, TILE, UNEXPLORED};
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
pub use stream::{StateReplica, StateSource};
pub use tiles::{REPLICA_TILE, ReplicaTile, ReplicaTileKey, SharedTiles};
pub use tree::{LabelTree, TreeReplica, TreeSource};
pub use value::{Hold, MAX_CONFIDENCE};
