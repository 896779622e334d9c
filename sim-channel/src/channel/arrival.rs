//! What a receiver learns of a transmission, and what only the simulator knows.

use crate::nodes::{NodeId, Position};
use std::sync::Arc;
use std::time::Duration;

/// The end of one reception (or of its duplicate) at one receiver.
#[derive(Clone, PartialEq, Debug)]
pub struct Arrival {
    /// The number that `transmit` returned.
    pub transmission: u64,
    /// Who sent.
    pub from: NodeId,
    /// Who received, or failed to.
    pub to: NodeId,
    /// End of the reception: start of transmission, plus propagation, plus air time, plus reordering delay.
    pub at: Duration,
    /// Start of the transmission.
    pub sent_at: Duration,
    /// Slant range in metres when the transmission began.
    pub range_m: f64,
    /// Where the sender was when the transmission began.
    pub sender: Position,
    /// Where the receiver was when the transmission began.
    pub receiver: Position,
    /// How long the signal took.
    pub airtime: Duration,
    /// What came of it.
    pub outcome: Outcome,
}

/// A signal that begins to be heard, whatever becomes of it.
#[derive(Clone, PartialEq, Debug)]
pub struct Onset {
    /// The number that `transmit` returned.
    pub transmission: u64,
    /// Who sent.
    pub from: NodeId,
    /// Who begins to hear.
    pub to: NodeId,
    /// Start of transmission plus propagation.
    pub at: Duration,
    /// How long it will last.
    pub airtime: Duration,
    /// What was sent; a receiver knows no more of it yet than that it is there.
    pub bytes: Arc<Vec<u8>>,
}

/// Whether the bytes got through.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// The receiver has the bytes.
    Delivered {
        /// The bytes, with flipped bits if `corrupted`.
        bytes: Vec<u8>,
        /// 0 for the frame itself, 1 for a duplicate of it.
        copy: u8,
        /// Whether bits were flipped in a way that no check of the modem noticed.
        corrupted: bool,
    },
    /// The receiver has nothing.
    Lost {
        /// How many bytes were sent.
        bytes_len: usize,
        /// Why they did not arrive.
        reason: LossReason,
    },
}

/// Why a frame did not arrive; if several reasons hold, the first of this list is told.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum LossReason {
    /// A scheduled outage covered part of the reception. Such a frame disturbs no other.
    Outage,
    /// Too far or too faint to be noticed at all. Such a frame disturbs no other.
    OutOfRange,
    /// The receiver was transmitting during part of the reception.
    SelfDeaf,
    /// Another signal overlapped at this receiver.
    Collision,
    /// The loss model lost it: noise, fading, multipath.
    Noise,
}
