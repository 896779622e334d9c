//! One signal at one receiver: its overlap with others and with the receiver's own transmission.

use super::link::FrameDraws;
use super::{Arrival, LossReason, ReceptionOutcome};
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
