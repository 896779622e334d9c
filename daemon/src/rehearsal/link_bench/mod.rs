//! What the link achieves over range, frame size and loss, with opaque payload in virtual time.

mod fleet;
mod opaque;
mod ranging;
mod summary;
mod table;
mod tally;
mod trial;
mod water;

pub use fleet::{FleetRow, measure_fleet};
pub use opaque::{OpaqueReplica, OpaqueSource};
pub use ranging::{RangingRow, measure_ranging};
pub use table::{Pattern, Place, Row, places};
pub use trial::Effort;
pub use water::{Setting, Water};
