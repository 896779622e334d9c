//! When the next key of a vehicle is offered to it.

use crate::time::Instant;
use std::time::Duration;

/// Offers the two parts of the next key in turn.
#[derive(Debug)]
pub(super) struct KeyOffers {
    next: Instant,
    /// Parts that were offered in this run of the surface.
    count: u32,
}

impl KeyOffers {
    /// The pause between two parts, until each was offered a few times; then a vehicle that keeps none, as with a full disk, is
    /// offered one at long intervals.
    const PAUSE: Duration = Duration::from_secs(5);
    const LONG_PAUSE: Duration = Duration::from_secs(60);
    const QUICK: u32 = 12;

    pub(super) fn new(now: Instant) -> Self {
        Self { next: now, count: 0 }
    }

    /// When the next part is due, if the vehicle is offered a key.
    pub(super) fn next(&self) -> Instant {
        self.next
    }

    /// The part to offer at `now`, if one is due.
    pub(super) fn take(&mut self, parts: [Vec<u8>; 2], now: Instant) -> Option<Vec<u8>> {
        if now < self.next {
            return None;
        }
        let [link, calls] = parts;
        let part = if self.count.is_multiple_of(2) { link } else { calls };
        self.count += 1;
        self.next = now + if self.count < Self::QUICK { Self::PAUSE } else { Self::LONG_PAUSE };
        Some(part)
    }
}
