//! How long a new label has to stand before it is told.

use super::{Cell, LabelGrid};
use crate::time::Instant;
use std::time::Duration;

/// How sure the model is of a label, from 0 to this.
pub const MOST_CONFIDENT: u8 = 3;
/// Most flips of a cell that are remembered.
const MOST_FLIPS: u8 = 7;
/// A flip is forgotten after so many times the wait of a calm cell.
const MEMORY: u64 = 16;
/// A difference is told at the latest after so many times the wait of a calm cell, whatever goes on.
const LONGEST: u32 = 16;

/// Remembers which cells have flipped of late, eight bits a cell that ever did.
///
/// ```text
///  bits   5            3
///      +------------+-------+
///      | epoch % 31 | flips |
///      +------------+-------+
/// ```
#[derive(Debug, Default)]
pub(super) struct Settling {
    calm: Duration,
    flips: LabelGrid,
}

impl Settling {
    /// A changed cell waits `calm` if it has not flipped of late; zero: nothing ever waits.
    pub(super) fn set_wait(&mut self, calm: Duration) {
        self.calm = calm;
        self.flips.clear();
    }

    /// Notes that `cell` has flipped, and says how long its new label has to stand.
    pub(super) fn flip(&mut self, cell: Cell, confidence: u8, now: Instant) -> Duration {
        if self.calm.is_zero() {
            return Duration::ZERO;
        }
        let epoch = now.as_micros() / (self.calm.as_micros() as u64 * MEMORY).max(1);
        let (present, flips) = self.recall(cell, epoch);
        self.flips.set(cell, present << 3 | (flips + 1).min(MOST_FLIPS));
        let doubt = u32::from(MOST_CONFIDENT.saturating_sub(confidence));
        self.calm * (1 + u32::from(flips)) * doubt / u32::from(MOST_CONFIDENT)
    }

    /// The longest time that a difference is held back.
    pub(super) fn longest(&self) -> Duration {
        self.calm * LONGEST
    }

    /// The present epoch as it is stored, and the flips that are not forgotten: one an epoch is.
    fn recall(&self, cell: Cell, epoch: u64) -> (u8, u8) {
        let stored = self.flips.get(cell);
        // The last epoch of the circle is left out, so that no byte is 255.
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
        let mut settling = Settling::default();
        settling.set_wait(Duration::from_secs(4));
        let cell = Cell::new(3, -9);
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        let waits: Vec<u64> = (0..10).map(|i| settling.flip(cell, 0, at(i)).as_secs()).collect();
        assert_eq!(waits, [4, 8, 12, 16, 20, 24, 28, 32, 32, 32]);
        assert_eq!(settling.flip(cell, MOST_CONFIDENT, at(10)), Duration::ZERO);
        assert_eq!(settling.flip(cell, 0, at(64 * 8)).as_secs(), 4);
        assert_eq!(settling.flip(Cell::new(0, 0), 2, at(0)).as_millis(), 1333);
    }
}
