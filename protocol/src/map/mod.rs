//! The replicated label map and its layers.
//!
//! [`MapSource`] is the vehicle's side and [`Replica`] the surface's. The link replicates any state that has
//! these two sides ([`StateSource`], [`StateReplica`]).

mod bits;
mod coarse;
mod debounce;
mod digest;
#[allow(clippy::indexing_slicing)] // A place in a tile is less than its size.
mod dirty;
mod plane;
mod replica;
mod scale;
mod source;
mod stream;
mod value;

pub use crate::grid::{Cell, LabelGrid, MAX_LABEL, Rect, TILE, UNEXPLORED};
pub use debounce::MAX_CONFIDENCE;
pub use digest::MapDigest;
pub use plane::{PlaneChunk, PlaneReplica, PlaneSource};
pub use replica::Replica;
pub use scale::{PlaneKind, PlaneScale};
pub use source::MapSource;
pub use stream::{StateReplica, StateSource};
