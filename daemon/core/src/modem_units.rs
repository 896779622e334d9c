//! Sizes that depend on the make of a modem.

/// Bytes of an instant message of an EvoLogics S2C, at most.
pub const S2C_INSTANT_BYTES: usize = 64;
/// Bytes of a frame in a burst record of 1000 bytes of an S2C, its delimiters excluded.
pub const S2C_BURST_FRAME_BYTES: usize = 992;
