//! The account of the orders: given, applied, foreign and repeated.

use scenecast_protocol::directive::{Slot, Utility};

/// The orders of the operator, and those that the vehicle applied.
#[derive(Debug, Default)]
pub(super) struct OrderBook {
    pub(super) issued: u32,
    /// The highest order that was applied.
    applied: u32,
    /// The order that was applied last, if the operator gave it.
    pub(super) in_force: Option<u32>,
    pub(super) applications: u64,
    /// Applied orders that the operator did not give.
    pub(super) foreign: u64,
    /// Applied orders that the operator gave, and that were applied before or replaced.
    pub(super) repeated: u64,
}

impl OrderBook {
    /// The labels whose weights number an order.
    const LABELS: [u8; 3] = [1, 2, 3];

    pub(super) fn next(&mut self) -> Slot {
        self.issued += 1;
        let digits = [self.issued % 100, self.issued / 100 % 100, self.issued / 10_000].map(|digit| digit as i8);
        let weights = Self::LABELS.into_iter().zip(digits).collect();
        Slot::Utility(Utility { weights, ..Utility::default() })
    }

    pub(super) fn note_applied(&mut self, slot: &Slot) {
        self.applications += 1;
        self.in_force = self.number_of(slot);
        match self.in_force {
            None => self.foreign += 1,
            Some(number) if number <= self.applied => self.repeated += 1,
            Some(number) => self.applied = number,
        }
    }

    fn number_of(&self, slot: &Slot) -> Option<u32> {
        let Slot::Utility(Utility { weights, .. }) = slot else { return None };
        if !weights.keys().all(|label| Self::LABELS.contains(label)) {
            return None;
        }
        let digit = |label| weights.get(&label).map_or(0, |&weight| weight.max(0) as u32);
        let number = digit(1) + 100 * digit(2) + 10_000 * digit(3);
        (1..=self.issued).contains(&number).then_some(number)
    }
}
