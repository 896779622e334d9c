//! Objects larger than a frame, sent as the symbols of an erasure code.
//!
//! An object is cut into small symbols. Where the link loses frames, repair symbols are sent ahead; losses beyond them
//! are repaired by the symbols that are missing.
//!
//! ```
//! use scenecast_protocol::object::{ObjectReceiver, ObjectSender, Part, Received};
//!
//! let (mut sender, mut receiver) = (ObjectSender::default(), ObjectReceiver::default());
//! let id = sender.push((0..300).map(|i| i as u8).collect()).unwrap();
//! let received = loop {
//!     let (_, run, bytes) = sender.next_part(60).expect("symbols wait");
//!     sender.mark_in_flight(id, &run);
//!     if let Received::Complete(_, object) = receiver.handle_part(&Part::decode(&bytes).unwrap()) {
//!         break object;
//!     }
//!     sender.handle_fate(id, &run, true);
//! };
//! assert_eq!(received.len(), 300);
//! ```

#[allow(clippy::indexing_slicing)] // Tables of 256 rows and columns, indexed by bytes.
mod gf256;

mod layout;
mod part;
mod receiver;
mod sender;

pub use layout::Layout;
pub use part::{ObjectId, Part, PartError};
pub use receiver::{ObjectReceiver, Received};
pub use sender::{ObjectSender, SymbolRun};

/// The largest object in bytes.
pub const MAX_OBJECT: usize = 16 * 1024;

#[cfg(test)]
mod tests;
