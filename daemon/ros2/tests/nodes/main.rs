//! Nodes that find each other, over either transport.

mod loopback;
#[cfg(feature = "zenoh")]
mod zenoh;
