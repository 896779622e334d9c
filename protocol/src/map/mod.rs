//! The replicated label map and its layers.
//!
//! [`MapSource`] is the vehicle's side and [`Replica`] the surface's. The link replicates any state that has these two
//! sides ([`StateSource`], [`StateReplica`]).

mod bits;
mod coarse;
mod debounce;
mod digest;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
mod layer;
mod layer_scale;
mod replica;
mod source;
mod stream;
mod value;

pub use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect, TILE, UNEXPLORED};
pub use debounce::MAX_CONFIDENCE;
pub use digest::MapDigest;
pub use layer::{LayerChunk, LayerReplica, LayerSource};
pub use layer_scale::{LayerKind, LayerScale};
pub use replica::Replica;
pub use source::MapSource;
pub use stream::{StateReplica, StateSource};
