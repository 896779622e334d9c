//! What a link counts and estimates.

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
    /// Of another wire version.
    Version,
    /// For somebody else.
    NotForUs,
    /// Corrupted, of another mission, or for an earlier run of ours.
    Checksum,
    /// A field or chunk that makes no sense.
    Malformed,
    /// From a run of the peer that has ended.
    OldSession,
    /// Taken before.
    Duplicate,
    /// Came after it was declared lost.
    Late,
    /// Refers to a base that we lack.
    NoBase,
    /// From nobody we know.
    Stranger,
    /// It has no tag, and we have a key: it may be anybody's.
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
    /// Frames put on air.
    pub frames_sent: u64,
    /// Frames taken.
    pub frames_heard: u64,
    /// Frames that the peer numbered up to the highest one heard: what exceeds [`Self::frames_heard`] was lost.
    pub frames_numbered: u64,
    /// Bytes taken, by class.
    pub heard_by_class: BTreeMap<Class, u64>,
    /// Own frames that the peer declared lost.
    pub frames_lost: u64,
    /// Own frames that the peer declared held.
    pub frames_delivered: u64,
    /// Received bytes that were dropped, by reason.
    pub dropped: BTreeMap<DropReason, u64>,
    /// Map chunks put on air.
    pub chunks_sent: u64,
    /// Bytes put on air, by class.
    pub bytes_by_class: BTreeMap<Class, u64>,
    /// Bytes of frames that were put on air again, unchanged; they are in no class.
    pub repeated_bytes: u64,
    /// Bytes of chunks that the peer declared held, by class.
    pub delivered_by_class: BTreeMap<Class, u64>,
    /// Restarts of the peer that were noticed.
    pub peer_restarts: u64,
    /// Times that the two maps were found to differ and were sent afresh.
    pub resyncs: u64,
    /// Recent loss of own frames, as the peer declares it.
    pub loss_out: Loss,
    /// Recent loss of the peer's frames, by the gaps in their numbers.
    pub loss_in: Loss,
    /// Useful bits that the peer declared held.
    pub goodput_out: Goodput,
    /// Useful bits taken.
    pub goodput_in: Goodput,
}

impl LinkStats {
    /// Counts a drop.
    pub fn drop(&mut self, reason: DropReason) {
        *self.dropped.entry(reason).or_default() += 1;
    }

    /// Frames that were refused because they were not authentic.
    pub fn refused(&self) -> u64 {
        self.dropped.get(&DropReason::Unauthenticated).copied().unwrap_or_default()
    }

    /// Counts bytes put on air.
    pub fn count(&mut self, class: Class, bytes: usize) {
        *self.bytes_by_class.entry(class).or_default() += bytes as u64;
    }

    /// Counts bytes taken.
    pub fn hear(&mut self, class: Class, bytes: usize, now: Instant) {
        *self.heard_by_class.entry(class).or_default() += bytes as u64;
        if class != Class::Overhead {
            self.goodput_in.count(bytes, now);
        }
    }

    /// Counts bytes of a chunk that the peer declared held.
    pub fn deliver(&mut self, class: Class, bytes: usize, now: Instant) {
        *self.delivered_by_class.entry(class).or_default() += bytes as u64;
        self.goodput_out.count(bytes, now);
    }

    /// Counts the fate of an own frame.
    pub(super) fn judge(&mut self, delivered: bool) {
        *(if delivered { &mut self.frames_delivered } else { &mut self.frames_lost }) += 1;
        self.loss_out.count(!delivered);
    }

    /// Counts a frame that was taken, after `before` had been the highest number heard.
    pub(super) fn take(&mut self, before: u64, number: u64) {
        self.frames_heard += 1;
        self.frames_numbered += number.saturating_sub(before);
        for _ in 0..number.saturating_sub(before + 1).min(256) {
            self.loss_in.count(true);
        }
        self.loss_in.count(false);
    }

    /// Share of judged frames that were lost.
    pub fn loss(&self) -> f64 {
        let judged = self.frames_lost + self.frames_delivered;
        if judged == 0 { 0.0 } else { self.frames_lost as f64 / judged as f64 }
    }
}
