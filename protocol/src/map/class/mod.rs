//! Names and colours of labels that the vehicle did not learn: the classes of another program.
//!
//! The vehicle announces each once in a pair of runs. The map itself does not depend on them.

mod chunk;
mod entry;
mod replica;
mod source;

pub use chunk::ClassChunk;
pub use entry::{ClassEntry, MAX_CLASS};
pub use replica::ClassReplica;
pub use source::ClassSource;
