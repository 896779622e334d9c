//! One signal at one receiver: its beginning and end, and its overlap with others and with the receiver's own transmission.
//!
//! A modem may use the bytes, the times and the outcome; the positions and the reason of a loss are for the simulation
//! alone.

use super::link::FrameDraws;
use crate::channel::link::flip_bits;
use crate::loss::FrameFate;
use crate::nodes::{NodeId, NodePosition};
use std::sync::Arc;
use std::time::Duration;

/// A span of time at one node; touching spans do not overlap.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Span {
    pub start: Duration,
    pub end: Duration,
}

impl Span {
    pub(super) fn new(start: Duration, airtime: Duration) -> Self {
        Self { start, end: start.saturating_add(airtime) }
    }

    pub(super) fn overlaps(&self, other: &Span) -> bool {
        self.start < other.end && other.start < self.end
    }
}

#[derive(Debug)]
pub(super) struct Reception {
    pub transmission: u64,
    pub from: NodeId,
    pub to: NodeId,
    /// Of the sender, then of the receiver.
    pub positions: [NodePosition; 2],
    pub span: Span,
    pub sent_at: Duration,
    pub range_m: f64,
    pub bytes: Arc<Vec<u8>>,
    pub draws: FrameDraws,
    pub in_outage: bool,
    pub collided: bool,
    pub self_deaf: bool,
}

impl Reception {
    /// Whether the signal has energy at the receiver that disturbs other signals.
    pub(super) fn audible(&self) -> bool {
        !self.in_outage && self.draws.fate != FrameFate::OutOfRange
    }

    /// Loses a signal whose sender fell silent in the middle; a signal that had been sent to its end is unharmed.
    pub(super) fn cut_short(&mut self, now: Duration) {
        let sent = now.saturating_sub(self.sent_at);
        if sent < self.span.end.saturating_sub(self.span.start) && self.draws.fate == FrameFate::Received {
            self.draws.fate = FrameFate::Lost;
        }
    }

    fn loss_reason(&self) -> Option<LossReason> {
        [
            (self.in_outage, LossReason::Outage),
            (self.draws.fate == FrameFate::OutOfRange, LossReason::OutOfRange),
            (self.self_deaf, LossReason::SelfDeaf),
            (self.collided, LossReason::Collision),
            (self.draws.fate == FrameFate::Lost, LossReason::Noise),
        ]
        .into_iter()
        .find_map(|(holds, reason)| holds.then_some(reason))
    }

    fn delivery(&self, copy: u8) -> ReceptionOutcome {
        let mut bytes = self.bytes.to_vec();
        let corrupted = self.draws.corrupted && flip_bits(&mut bytes, &mut self.draws.flips.clone());
        ReceptionOutcome::Delivered { bytes, copy, corrupted }
    }

    /// The arrivals of this reception: one, or two if it is delivered and duplicated.
    pub(super) fn arrivals(&self, reorder_delay: Duration) -> impl Iterator<Item = Arrival> {
        let reason = self.loss_reason();
        let copies = if reason.is_none() && self.draws.duplicated { 2 } else { 1 };
        self.draws.late.into_iter().zip(0u8..copies).map(move |(late, copy)| {
            let delay = if late && reason.is_none() { reorder_delay } else { Duration::ZERO };
            Arrival {
                transmission: self.transmission,
                from: self.from,
                to: self.to,
                at: self.span.end.saturating_add(delay),
                sent_at: self.sent_at,
                range_m: self.range_m,
                sender: self.positions[0],
                receiver: self.positions[1],
                airtime: self.span.end.saturating_sub(self.span.start),
                outcome: match reason {
                    Some(reason) => ReceptionOutcome::Lost { bytes_len: self.bytes.len(), reason },
                    None => self.delivery(copy),
                },
            }
        })
    }
}

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
