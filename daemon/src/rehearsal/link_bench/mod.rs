//! What the link achieves over range, frame size and loss, with opaque payload in virtual time.

mod opaque;
mod summary;
mod table;
mod tally;
mod trial;
mod water;

pub use opaque::{OpaqueReplica, OpaqueSource};
pub use table::{Pattern, Place, Row, places};
pub use trial::Effort;
pub use water::{Setting, Water};
