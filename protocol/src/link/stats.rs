//! The counters and estimates of a link.

use super::estimate::{Goodput, Loss};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::FrameError;
use std::collections::BTreeMap;

/// Why received bytes were dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DropReason {
    /// Too short to be a frame.
    Truncated,
    /// The frame has another wire version.
    Version,
    /// The frame is addressed to another end.
    NotForUs,
    /// The frame is damaged, of another mission, or for an earlier run of ours.
    Checksum,
    /// A field or a chunk makes no sense.
    Malformed,
    /// A chunk does not decode with the state of this end.
    Undecodable,
    /// From a run of the peer that has ended.
    OldSession,
    /// The frame was accepted before.
    Duplicate,
    /// It came in after it was declared lost.
    Late,
    /// It refers to a base that we do not have.
    NoBase,
    /// No known end has this sender address.
    UnknownSender,
    /// It has no tag although we have a key, so anybody may have sent it.
    Unauthenticated,
    /// It has a tag, and we have no key.
    Keyed,
}

impl From<FrameError> for DropReason {
    fn from(e: FrameError) -> Self {
        match e {
            FrameError::Truncated => Self::Truncated,
            FrameError::Version(_) => Self::Version,
            FrameError::NotForUs => Self::NotForUs,
            FrameError::Checksum => Self::Checksum,
            FrameError::BadField => Self::Malformed,
        }
    }
}

/// Counters of one end toward one peer.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LinkStats {
    /// Frames put on air, copies not included.
    pub frames_sent: u64,
    /// Received frames that verified and were accepted.
    pub frames_received: u64,
    /// The highest frame number received of each run, added up; the excess over [`Self::frames_received`] was lost.
    pub frames_numbered: u64,
    /// Bytes of accepted frames, by class.
    pub received_by_class: BTreeMap<Class, u64>,
    /// Own frames that the peer declared lost.
    pub frames_lost: u64,
    /// Own frames that the peer declared received.
    pub frames_delivered: u64,
    /// Received frames that were dropped, by reason.
    pub dropped: BTreeMap<DropReason, u64>,
    /// Map chunks put on air, copies not included.
    pub chunks_sent: u64,
    /// Bytes put on air, by class.
    pub bytes_by_class: BTreeMap<Class, u64>,
    /// Bytes of copies of earlier frames; no class includes them.
    pub repeated_bytes: u64,
    /// Bytes of chunks that the peer declared received, by class.
    pub delivered_by_class: BTreeMap<Class, u64>,
    /// New runs of the peer that were noticed.
    pub peer_restarts: u64,
    /// Times that the states of the two ends were found to differ, so that all was sent again.
    pub resyncs: u64,
    /// Recent loss of own frames, as the peer reports it.
    pub loss_out: Loss,
    /// Recent loss of the peer's frames, by the gaps in their numbers.
    pub loss_in: Loss,
    /// Useful bits that the peer declared received.
    pub goodput_out: Goodput,
    /// Useful bits of accepted frames.
    pub goodput_in: Goodput,
}

impl LinkStats {
    /// Counts a dropped frame by its reason.
    pub fn drop(&mut self, reason: DropReason) {
        *self.dropped.entry(reason).or_default() += 1;
    }

    /// The number of received frames that were dropped, for any reason.
    pub fn dropped_total(&self) -> u64 {
        self.dropped.values().sum()
    }

    /// Frames that were refused because they were not authentic.
    pub fn refused(&self) -> u64 {
        self.dropped.get(&DropReason::Unauthenticated).copied().unwrap_or_default()
    }

    /// Counts bytes of a frame that goes on air.
    pub fn count(&mut self, class: Class, bytes: usize) {
        *self.bytes_by_class.entry(class).or_default() += bytes as u64;
    }

    /// Counts bytes of an accepted frame.
    pub fn receive(&mut self, class: Class, bytes: usize, now: Instant) {
        *self.received_by_class.entry(class).or_default() += bytes as u64;
        if class != Class::Overhead {
            self.goodput_in.count(bytes, now);
        }
    }

    /// Counts bytes of a chunk that the peer declared received.
    pub fn deliver(&mut self, class: Class, bytes: usize, now: Instant) {
        *self.delivered_by_class.entry(class).or_default() += bytes as u64;
        self.goodput_out.count(bytes, now);
    }

    pub(super) fn judge(&mut self, delivered: bool) {
        *(if delivered { &mut self.frames_delivered } else { &mut self.frames_lost }) += 1;
        self.loss_out.count(!delivered);
    }

    /// Counts an accepted frame; `before` was the highest number until then.
    pub(super) fn take(&mut self, before: u64, number: u64) {
        self.frames_received += 1;
        self.frames_numbered += number.saturating_sub(before);
        for _ in 0..number.saturating_sub(before + 1).min(256) {
            self.loss_in.count(true);
        }
        self.loss_in.count(false);
    }

    /// The share of lost frames among those of known fate, in 0..=1.
    pub fn loss(&self) -> f64 {
        let judged = self.frames_lost + self.frames_delivered;
        if judged == 0 { 0.0 } else { self.frames_lost as f64 / judged as f64 }
    }
}
