//! The faults that are injected into a modem.

use std::time::Duration;

/// A fault to inject; durations count from the moment of injection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Fault {
    /// Refuses every message for this long, with `BUSY` (S2C) or an error (Micromodem).
    Busy(Duration),
    /// Restarts; settings that were not stored and queued messages are lost.
    Reboot,
    /// Sends this many bytes of noise to each host.
    Garbage(u16),
    /// Drops the rear half of the bytes that are on their way to each host.
    HalfLine,
    /// Neither reads nor writes for this long; the bytes that wait come afterwards.
    Freeze(Duration),
    /// Uses this address instead of the configured one.
    WrongAddress(u8),
    /// The supply fails: a transmission is cut short, then the modem restarts.
    BrownOut,
    /// Accepts up to a megabyte of data before it reports a full buffer.
    BigBuffer,
}
