//! What the two ends of scenecast say to each other: wire format, map coding, replicated state, link,
//! schedule and medium access. Nothing here does IO: bytes and time come in as arguments.

pub mod directive;
pub mod link;
pub mod mac;
pub mod map;
pub mod map_codec;
pub mod object;
pub mod schedule;
pub mod seal;
pub mod time;
pub mod wire;
