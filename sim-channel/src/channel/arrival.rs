//! Receptions: the beginning and the end of a signal at one receiver.
//!
//! A modem may use the bytes, the times and the outcome; the positions and the reason of a loss are for the simulation
//! alone.

use crate::nodes::{NodeId, NodePosition};
use std::sync::Arc;
use std::time::Duration;

/// The end of one reception, or of its duplicate, at one receiver.
///
/// Every transmission ends in exactly one arrival at each other node, delivered or lost; a duplicate is one more.
#[derive(Clone, PartialEq, Debug)]
pub struct Arrival {
    /// The number that [`Channel::transmit`](super::Channel::transmit) returned.
    pub transmission: u64,
    /// The node that sent the frame.
    pub from: NodeId,
    /// The node that received the frame or lost it.
    pub to: NodeId,
    /// End of the reception: start of transmission, plus propagation, plus airtime, plus reordering delay.
    pub at: Duration,
    /// Start of the transmission at the sender.
    pub sent_at: Duration,
    /// Slant range when the transmission began, m.
    pub range_m: f64,
    /// Position of the sender when the transmission began.
    pub sender: NodePosition,
    /// Position of the receiver when the transmission began.
    pub receiver: NodePosition,
    /// Length of the signal, from its first wave to its last.
    pub airtime: Duration,
    /// Whether the bytes got through, and why not.
    pub outcome: ReceptionOutcome,
}

/// The beginning of a signal at a receiver, whatever its outcome will be.
#[derive(Clone, PartialEq, Debug)]
pub struct Onset {
    /// The number that [`Channel::transmit`](super::Channel::transmit) returned.
    pub transmission: u64,
    /// The node that sends the frame.
    pub from: NodeId,
    /// The node that the signal reaches.
    pub to: NodeId,
    /// Start of the transmission plus propagation.
    pub at: Duration,
    /// Length of the signal, from its first wave to its last.
    pub airtime: Duration,
    /// The bytes of the frame. A modem at this moment knows only that there is a signal; an emulator may use the bytes to
    /// decide whether its modem would detect it.
    pub bytes: Arc<Vec<u8>>,
}

/// Whether the bytes got through.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum ReceptionOutcome {
    /// The receiver has the bytes.
    Delivered {
        /// The bytes, with flipped bits if `corrupted`.
        bytes: Vec<u8>,
        /// 0 for the frame itself, 1 for a duplicate of it.
        copy: u8,
        /// Whether bits were flipped in a way that no check of a modem notices.
        corrupted: bool,
    },
    /// The receiver could not decode the frame.
    Lost {
        /// Length of the frame that was sent, bytes.
        bytes_len: usize,
        /// The first reason that holds, in the order of [`LossReason`].
        reason: LossReason,
    },
}

/// Why a frame did not arrive; if several reasons hold, the first of this list is reported.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
#[non_exhaustive]
pub enum LossReason {
    /// A scheduled outage covered part of the reception. Such a frame disturbs no other.
    Outage,
    /// Too far or too faint to be detected at all. Such a frame disturbs no other.
    OutOfRange,
    /// The receiver was transmitting during part of the reception.
    SelfDeaf,
    /// Another signal overlapped at this receiver.
    Collision,
    /// The loss model lost it: noise, fading, multipath.
    Noise,
}
