//! Debouncing: how long a new label must be stable before it is sent.

use super::{Cell, LabelGrid};
use crate::time::Instant;
use std::time::Duration;

/// The highest confidence of the model in a label; the lowest is 0.
pub const MAX_CONFIDENCE: u8 = 3;
const MAX_FLIPS: u8 = 7;
/// A flip is forgotten after this many times the wait of a stable cell.
const MEMORY: u64 = 16;
/// A difference is sent at the latest after this many times the wait of a stable cell.
const MAX_WAITS: u32 = 16;

/// Remembers which cells have flipped recently, in eight bits for each cell that ever did.
///
/// ```text
///  bits   5            3
///      +------------+-------+
///      | epoch % 31 | flips |
///      +------------+-------+
/// ```
#[derive(Debug, Default)]
pub(super) struct Debounce {
    calm: Duration,
    flips: LabelGrid,
}

impl Debounce {
    /// Sets the wait of a cell that has not flipped recently; zero disables all waits. Another wait forgets all flips.
    pub(super) fn set_wait(&mut self, calm: Duration) {
        if calm != self.calm {
            self.calm = calm;
            self.flips.clear();
        }
    }

    /// Notes a flip of `cell`; returns how long its new label must be stable.
    pub(super) fn flip(&mut self, cell: Cell, confidence: u8, now: Instant) -> Duration {
        if self.calm.is_zero() {
            return Duration::ZERO;
        }
        let epoch = now.as_micros() / (self.calm.as_micros() as u64 * MEMORY).max(1);
        let (present, flips) = self.recall(cell, epoch);
        self.flips.set(cell, present << 3 | (flips + 1).min(MAX_FLIPS));
        let doubt = u32::from(MAX_CONFIDENCE.saturating_sub(confidence));
        self.calm * (1 + u32::from(flips)) * doubt / u32::from(MAX_CONFIDENCE)
    }

    /// The longest time for which a difference is held back.
    pub(super) fn longest(&self) -> Duration {
        self.calm * MAX_WAITS
    }

    /// The current epoch as it is stored, and the flips still remembered; one is forgotten each epoch.
    fn recall(&self, cell: Cell, epoch: u64) -> (u8, u8) {
        let stored = self.flips.get(cell);
        // The last epoch of the cycle is skipped, so that no byte is 255.
        let present = (epoch % 31) as u8;
        let passed = (present + 31 - (stored >> 3)) % 31;
        (present, (stored & 7).saturating_sub(passed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_that_flips_often_waits_longer_and_is_forgiven() {
        let mut settling = Debounce::default();
        settling.set_wait(Duration::from_secs(4));
        let cell = Cell::new(3, -9);
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        let waits: Vec<u64> = (0..10).map(|i| settling.flip(cell, 0, at(i)).as_secs()).collect();
        assert_eq!(waits, [4, 8, 12, 16, 20, 24, 28, 32, 32, 32]);
        assert_eq!(settling.flip(cell, MAX_CONFIDENCE, at(10)), Duration::ZERO);
        assert_eq!(settling.flip(cell, 0, at(64 * 8)).as_secs(), 4);
        assert_eq!(settling.flip(Cell::new(0, 0), 2, at(0)).as_millis(), 1333);
    }
}
