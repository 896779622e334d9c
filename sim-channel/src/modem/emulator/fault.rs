//! What can go wrong with a modem, on demand.

use std::time::Duration;

/// Something to break; times are lengths from the moment of injection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// Refuses every message with BUSY (S2C) or an error (Micromodem) for so long.
    Busy(Duration),
    /// Restarts; settings that were not stored are lost, queued messages too.
    Reboot,
    /// Sends so many bytes of garbage to the host.
    Garbage(u16),
    /// Cuts what the host is being told at half a line.
    HalfLine,
    /// Neither reads nor writes for so long; what waits comes afterwards.
    Freeze(Duration),
    /// Answers to another address than it was given.
    WrongAddress(u8),
    /// The supply fails: a transmission is cut short, then the modem restarts.
    BrownOut,
    /// Takes up to a megabyte of data before it says that it is full.
    BigBuffer,
}
