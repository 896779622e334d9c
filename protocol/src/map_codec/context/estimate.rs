//! One adaptive probability.

use super::logistic::logit;

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

/// The estimated probability of `true` in one context.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BitEstimate {
    /// The probability of `true` in units of 1/2^32.
    pub p: u32,
    /// Decisions that the estimate is worth, at most [`Self::MAX_VISITS`].
    pub visits: u16,
}

impl BitEstimate {
    /// Decisions after which the estimate adapts no more slowly.
    pub const MAX_VISITS: u16 = 1020;

    /// One half, worth no decision.
    pub const BLANK: Self = Self { p: 1 << 31, visits: 0 };

    pub(super) fn logit(self) -> i32 {
        logit(self.p)
    }

    pub(super) fn update(&mut self, bit: bool) {
        let goal = if bit { i64::from(u32::MAX) } else { 0 };
        let step = ((goal - i64::from(self.p)) * i64::from(RATE[usize::from(self.visits)])) >> 16;
        self.p = (i64::from(self.p) + step) as u32;
        if self.visits < Self::MAX_VISITS {
            self.visits += 1;
        }
    }
}
