//! The counters of a link, and estimates of the channel's quality from recent frames.

use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::FrameError;
use std::collections::BTreeMap;
use std::time::Duration;

/// Why received bytes were dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum DropReason {
    /// Too short to be a frame.
    Truncated,
    /// The frame has another wire version.
    Version,
    /// The frame is addressed to another end.
    NotForUs,
    /// The frame is damaged, of another mission or key, or for an earlier run of ours.
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
    /// The quality of the link to the peer, as the peer declares it.
    pub outgoing: LinkQuality,
    /// The quality of the link from the peer: loss by the gaps in its frame numbers, bits of accepted frames.
    pub incoming: LinkQuality,
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
            self.incoming.goodput.count(bytes, now);
        }
    }

    /// Counts bytes of a chunk that the peer declared received.
    pub fn deliver(&mut self, class: Class, bytes: usize, now: Instant) {
        *self.delivered_by_class.entry(class).or_default() += bytes as u64;
        self.outgoing.goodput.count(bytes, now);
    }

    pub(super) fn judge(&mut self, delivered: bool) {
        *(if delivered { &mut self.frames_delivered } else { &mut self.frames_lost }) += 1;
        self.outgoing.loss.count(!delivered);
    }

    /// Counts an accepted frame; `before` was the highest number until then.
    pub(super) fn take(&mut self, before: u64, number: u64) {
        self.frames_received += 1;
        self.frames_numbered += number.saturating_sub(before);
        for _ in 0..number.saturating_sub(before + 1).min(256) {
            self.incoming.loss.count(true);
        }
        self.incoming.loss.count(false);
    }

    /// The share of lost frames among those of known fate, in 0..=1.
    pub fn loss(&self) -> f64 {
        let judged = self.frames_lost + self.frames_delivered;
        if judged == 0 { 0.0 } else { self.frames_lost as f64 / judged as f64 }
    }
}

/// The recent quality of one direction of a link.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LinkQuality {
    /// The share of lost frames among the last ones.
    pub loss: Loss,
    /// The rate of useful bits that arrived, bit/s.
    pub goodput: Goodput,
}

/// The recent share of lost frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    share: f64,
    frames: u32,
}

impl Default for Loss {
    fn default() -> Self {
        Self { share: 0.0, frames: 0 }
    }
}

impl Loss {
    const MEMORY: u32 = 64;
    /// The loss that is assumed before the first frame.
    const PRIOR: f64 = 0.1;

    /// Counts a frame as lost or received.
    pub fn count(&mut self, lost: bool) {
        self.frames = (self.frames + 1).min(Self::MEMORY);
        self.share += (f64::from(u8::from(lost)) - self.share) / f64::from(self.frames);
    }

    /// The share in 0..=1; 0 before the first count.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The share to plan with: the assumed loss gives way to the measured one as frames are counted.
    pub fn expected(&self) -> f64 {
        const WEIGHT: f64 = 8.0;
        let n = f64::from(self.frames);
        (self.share * n + Self::PRIOR * WEIGHT) / (n + WEIGHT)
    }

    /// The number of copies to send so that all of them are lost with at most probability `risk`; at most `most`.
    pub fn copies(&self, risk: f64, most: u32) -> u32 {
        let loss = self.expected().clamp(1e-6, 0.99);
        ((risk.ln() / loss.ln()).ceil() as u32).clamp(1, most)
    }
}

/// The recent rate of useful bits.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Goodput {
    bits: f64,
    counted: Instant,
}

impl Goodput {
    /// Time constant of the smoothing.
    const MEMORY: Duration = Duration::from_secs(60);

    /// Counts useful bytes that went through at `now`.
    pub fn count(&mut self, bytes: usize, now: Instant) {
        self.bits = self.left(now) + bytes as f64 * 8.0;
        self.counted = self.counted.max(now);
    }

    /// The smoothed rate in bit/s; it decays while no bytes are counted.
    pub fn bits_per_s(&self, now: Instant) -> f64 {
        self.left(now) / Self::MEMORY.as_secs_f64()
    }

    fn left(&self, now: Instant) -> f64 {
        self.bits * (-now.since(self.counted).as_secs_f64() / Self::MEMORY.as_secs_f64()).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_copies_go_out_where_more_is_lost() {
        let copies = |lost_of_ten: u32| {
            let mut loss = Loss::default();
            (0..200).for_each(|i| loss.count(i % 10 < lost_of_ten));
            loss.copies(0.03, 6)
        };
        assert_eq!([copies(0), copies(1), copies(3), copies(5)], [1, 2, 3, 5]);
    }

    #[test]
    fn goodput_follows_a_steady_stream_and_fades_without_one() {
        let mut rate = Goodput::default();
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        (0..600).for_each(|s| rate.count(125, at(s)));
        assert!((rate.bits_per_s(at(600)) - 1000.0).abs() < 20.0);
        assert!(rate.bits_per_s(at(900)) < 10.0);
    }
}
