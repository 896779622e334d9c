//! Transcripts and behaviour at the host's port.

mod bench;
mod burst;
mod faults;
mod instant;
mod soak;
mod start_up;
