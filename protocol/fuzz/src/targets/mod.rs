//! Properties for any bytes: plain functions, run by libFuzzer and by `tests/protocol/fuzz_corpus.rs` alike.
//!
//! A function panics if a property does not hold.

mod decoders;
pub mod link;
mod map_chunk;
mod peer;
pub mod raw;
mod surface;
mod vehicle;

pub use decoders::{ack, chunks, frame, in_force, introduction, key_text, layer_chunk, object, slot, stamp, status};
pub use map_chunk::{base, map_chunk};
pub use surface::{surface_events, surface_link};
pub use vehicle::{vehicle_events, vehicle_link};

/// A target accepts any bytes.
pub type Target = fn(&[u8]);

/// Every target by the name of its corpus.
pub const ALL: [(&str, Target); 14] = [
    ("frame", frame),
    ("ack", ack),
    ("chunks", chunks),
    ("introduction", introduction),
    ("stamp", stamp),
    ("status", status),
    ("slot", slot),
    ("in_force", in_force),
    ("object", object),
    ("map_chunk", map_chunk),
    ("layer_chunk", layer_chunk),
    ("key_text", key_text),
    ("vehicle_link", vehicle_link),
    ("surface_link", surface_link),
];
