//! Objects larger than a frame: cut into small symbols, with repair symbols ahead where the link loses some, and
//! repaired by what is missing.

#[allow(clippy::indexing_slicing)] // Tables of 256 rows and columns, indexed by bytes.
mod gf256;

mod code;
mod layout;
mod outgoing;
mod part;
mod reassembly;
mod receiver;
mod sender;
mod supply;
#[cfg(test)]
mod tests;

pub use layout::Layout;
pub use outgoing::SymbolRun;
pub use part::{ObjectId, Part, PartError};
pub use receiver::{ObjectReceiver, Received};
pub use sender::ObjectSender;

/// Largest object in bytes.
pub const MAX_OBJECT: usize = 16 * 1024;
