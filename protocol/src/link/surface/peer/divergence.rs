//! Frames with map chunks that do not decode here.

use crate::time::Instant;
use std::time::Duration;

/// Decides from undecodable frames whether the two ends hold different states.
///
/// A single such frame may be forged or damaged. If the states differ, no map chunk decodes any more.
#[derive(Debug, Default)]
pub(super) struct Divergence {
    /// Undecodable frames since a map chunk was last accepted, at most one in each [`Self::INTERVAL`].
    count: u32,
    last: Option<Instant>,
}

impl Divergence {
    const INTERVAL: Duration = Duration::from_secs(5);
    const CERTAIN: u32 = 3;

    /// Counts an undecodable frame; returns whether the states certainly differ.
    pub(super) fn note_undecodable(&mut self, now: Instant) -> bool {
        if self.last.is_none_or(|at| now.since(at) >= Self::INTERVAL) {
            (self.count, self.last) = (self.count + 1, Some(now));
        }
        self.count >= Self::CERTAIN
    }

    /// A map chunk was accepted, or a new run has begun.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }
}
