//! One adaptive probability.

use super::logistic::odds;

/// 65536 / (visits + 1.6).
const RATE: [u32; 1024] = {
    let mut table = [0; 1024];
    let mut n = 0;
    while n < 1024 {
        table[n] = 655_360 / (10 * n as u32 + 16);
        n += 1;
    }
    table
};

/// Probability of `true` in one context, and how much it has seen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slot {
    /// In 1/2^32.
    pub(super) p: u32,
    /// Visits, or what the prior is worth in visits.
    pub(super) visits: u16,
}

impl Slot {
    /// Visits after which a slot no longer slows down.
    pub(super) const MOST_VISITS: u16 = 1020;

    /// Knows nothing.
    pub(super) const BLANK: Self = Self { p: 1 << 31, visits: 0 };

    pub(super) fn odds(self) -> i32 {
        odds(self.p)
    }

    pub(super) fn update(&mut self, bit: bool) {
        let goal = if bit { i64::from(u32::MAX) } else { 0 };
        let step = ((goal - i64::from(self.p)) * i64::from(RATE[usize::from(self.visits)])) >> 16;
        self.p = (i64::from(self.p) + step) as u32;
        if self.visits < Self::MOST_VISITS {
            self.visits += 1;
        }
    }
}
