//! What the two ends of scenecast say to each other: wire format, map coding, replicated state, link,
//! schedule and medium access. Nothing here does IO: bytes and time come in as arguments.

#![warn(missing_docs)]
// Received bytes must not panic: what indexes all the same says why.
#![cfg_attr(
    not(test),
    deny(clippy::indexing_slicing, clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

pub mod directive;
pub mod exemplar;
pub mod link;
pub mod mac;
pub mod map;
pub mod map_codec;
pub mod object;
mod random;
pub mod schedule;
pub mod seal;
pub mod time;
pub mod wire;
