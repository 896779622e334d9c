//! What the two ends of scenecast say to each other: wire format, map coding, replicated state, link,
//! schedule and medium access. Nothing here does IO: bytes and time come in as arguments.

pub mod map;
pub mod map_codec;
