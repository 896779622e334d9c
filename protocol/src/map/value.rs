//! Which changes go out: how long a new label must be stable, the value of a change to the operator, and its cost in bits.

use super::{Cell, LabelGrid, UNEXPLORED};
use crate::time::Instant;
use std::time::Duration;

/// The value of a change between labels without interest. It is positive so that age, which multiplies
/// it, lets no cell starve.
const FLOOR: f64 = 0.2;
/// The value of correcting a label, relative to that of showing a new cell.
const CORRECTION: f64 = 0.5;
/// Bits of frame and chunk headers for each tile.
const HEAD_BITS: f64 = 48.0;
/// Cost of a new cell in bits.
const NEW_BITS: f64 = 2.0;
/// Cost of a flipped cell in bits.
const FLIP_BITS: f64 = 9.0;

/// The operator's interest in each label, 0..=1.
#[derive(Debug)]
pub(super) struct Interest([f64; 256]);

impl Default for Interest {
    fn default() -> Self {
        Self([0.0; 256])
    }
}

impl Interest {
    pub(super) fn new(weight: impl Fn(u8) -> f64) -> Self {
        let mut labels = 0..=u8::MAX;
        Self([(); 256].map(|()| labels.next().map_or(0.0, |label| weight(label).abs().min(1.0))))
    }

    /// The value of a change of a cell from `old` to `new`.
    pub(super) fn value(&self, old: u8, new: u8) -> f64 {
        let of = |label: u8| self.0.get(usize::from(label)).copied().unwrap_or_default();
        let wrong = if old == UNEXPLORED { 1.0 } else { CORRECTION };
        wrong * (FLOOR + of(old).max(of(new)))
    }
}

/// The approximate cost of a change in bits.
pub(super) fn cost(old: u8) -> f64 {
    if old == UNEXPLORED { NEW_BITS } else { FLIP_BITS }
}

/// The value of a group of changes as a function of time; each gains value with its age.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Value {
    value: f64,
    /// Sum of the values times the times of the changes in seconds.
    value_since: f64,
    bits: f64,
}

impl Value {
    /// Adds a change with its value, its cost, and its time in seconds.
    pub(super) fn add(&mut self, value: f64, bits: f64, since_s: f64) {
        self.value += value;
        self.value_since += value * since_s;
        self.bits += bits;
    }

    /// Value times age for each bit, at `now_s` seconds.
    pub(super) fn per_bit(&self, now_s: f64) -> f64 {
        (self.value * (1.0 + now_s) - self.value_since) / (HEAD_BITS + self.bits)
    }
}

/// The highest confidence of the model in a label; the lowest is 0.
pub const MAX_CONFIDENCE: u8 = 3;
const MAX_FLIPS: u8 = 7;
/// A flip is forgotten after this many times the wait of a stable cell.
const MEMORY: u64 = 16;
/// A difference is sent at the latest after this many times the wait of a stable cell.
const MAX_WAITS: u32 = 16;

/// How long a new label must be stable in a cell that has not flipped recently.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Always so long; zero sends everything at once.
    For(Duration),
    /// As long as the backlog takes at this many bits a second, at most a minute: a label that does not last that long is not
    /// worth sending. While nothing else waits, the labels that are held back are sent.
    Backlog(u32),
}

impl Hold {
    const MAX_AUTOMATIC: Duration = Duration::from_secs(60);
    /// The wait from which the memory of flips follows where the wait itself varies.
    const TYPICAL: Duration = Duration::from_secs(20);

    /// The wait of a cell that has not flipped recently, while so many bytes wait.
    pub(super) fn usual_wait(self, backlog_bytes: usize) -> Duration {
        match self {
            Self::For(wait) => wait,
            Self::Backlog(bits_per_s) => {
                let seconds = backlog_bytes as f64 * 8.0 / f64::from(bits_per_s.max(1));
                Self::MAX_AUTOMATIC.min(Duration::from_secs_f64(seconds))
            }
        }
    }

    fn typical(self) -> Duration {
        match self {
            Self::For(wait) => wait,
            Self::Backlog(_) => Self::TYPICAL,
        }
    }
}

impl Default for Hold {
    fn default() -> Self {
        Self::For(Duration::ZERO)
    }
}

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
    hold: Hold,
    flips: LabelGrid,
}

impl Debounce {
    /// Sets the wait of a cell that has not flipped recently. Another memory forgets all flips.
    pub(super) fn set_hold(&mut self, hold: Hold) {
        if hold.typical() != self.hold.typical() {
            self.flips.clear();
        }
        self.hold = hold;
    }

    pub(super) fn hold(&self) -> Hold {
        self.hold
    }

    /// Whether labels are held back only while others wait.
    pub(super) fn is_automatic(&self) -> bool {
        matches!(self.hold, Hold::Backlog(_))
    }

    /// Notes a flip of `cell`; returns how long its new label must be stable if that of a cell without recent flips must
    /// for `usual`.
    pub(super) fn flip(&mut self, cell: Cell, confidence: u8, usual: Duration, now: Instant) -> Duration {
        if self.hold.typical().is_zero() {
            return Duration::ZERO;
        }
        let epoch = now.as_micros() / (self.hold.typical().as_micros() as u64 * MEMORY).max(1);
        let (present, flips) = self.recall(cell, epoch);
        self.flips.set(cell, present << 3 | (flips + 1).min(MAX_FLIPS));
        let doubt = u32::from(MAX_CONFIDENCE.saturating_sub(confidence));
        usual * (1 + u32::from(flips)) * doubt / u32::from(MAX_CONFIDENCE)
    }

    /// The longest time for which a difference is held back.
    pub(super) fn longest(usual: Duration) -> Duration {
        usual * MAX_WAITS
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
    fn age_outranks_new_cells_and_these_isolated_flips() {
        let interest = Interest::new(|label| if label == 7 { 0.8 } else { 0.0 });
        let value = |old: u8, new: u8, since_s: f64| {
            let mut value = Value::default();
            (0..20).for_each(|_| value.add(interest.value(old, new), cost(old), since_s));
            value.per_bit(100.0)
        };
        assert!(value(0, 1, 90.0) > 3.0 * value(2, 1, 90.0));
        assert!(value(2, 7, 90.0) > 4.0 * value(2, 1, 90.0));
        assert!(value(2, 1, 1.0) > value(0, 1, 90.0));
    }

    #[test]
    fn a_cell_that_flips_often_waits_longer_and_is_forgiven() {
        let mut settling = Debounce::default();
        let usual = Duration::from_secs(4);
        settling.set_hold(Hold::For(usual));
        let cell = Cell::new(3, -9);
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        let waits: Vec<u64> = (0..10).map(|i| settling.flip(cell, 0, usual, at(i)).as_secs()).collect();
        assert_eq!(waits, [4, 8, 12, 16, 20, 24, 28, 32, 32, 32]);
        assert_eq!(settling.flip(cell, MAX_CONFIDENCE, usual, at(10)), Duration::ZERO);
        assert_eq!(settling.flip(cell, 0, usual, at(64 * 8)).as_secs(), 4);
        assert_eq!(settling.flip(Cell::new(0, 0), 2, usual, at(0)).as_millis(), 1333);
    }

    #[test]
    fn a_long_backlog_holds_labels_back_longer() {
        let wait = |bytes, bits_per_s| Hold::Backlog(bits_per_s).usual_wait(bytes).as_secs_f64();
        assert_eq!([wait(0, 100), wait(250, 100), wait(250, 10_000), wait(9999, 100)], [0.0, 20.0, 0.2, 60.0]);
    }
}
