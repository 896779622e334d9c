//! What it is worth to tell the operator of a change, and what that costs.

use super::UNEXPLORED;

/// Worth of a change of labels without any interest: with it nothing starves, for worth is multiplied by age.
const FLOOR: f64 = 0.2;
/// Worth of correcting a label against showing one where nothing was shown.
const CORRECTION: f64 = 0.5;
/// Bits of a frame and a chunk that each tile has to bear.
const HEAD_BITS: f64 = 48.0;
/// What a newly seen cell costs, bits.
const NEW_BITS: f64 = 2.0;
/// What a flipped cell costs, bits.
const FLIP_BITS: f64 = 9.0;

/// What each label is worth to the operator, 0..=1.
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

    /// Worth of telling the operator that a cell has changed.
    pub(super) fn worth(&self, old: u8, new: u8) -> f64 {
        let of = |label: u8| self.0.get(usize::from(label)).copied().unwrap_or_default();
        let wrong = if old == UNEXPLORED { 1.0 } else { CORRECTION };
        wrong * (FLOOR + of(old).max(of(new)))
    }
}

/// About what it takes to tell a change, bits.
pub(super) fn cost(old: u8) -> f64 {
    if old == UNEXPLORED { NEW_BITS } else { FLIP_BITS }
}

/// The value of a group of changes, as a function of time: each is worth more the older it is.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Value {
    worth: f64,
    /// Sum of worth times the moment of the change in seconds.
    worth_since: f64,
    bits: f64,
}

impl Value {
    /// Takes in a change with its worth, its cost, and since when there is something to tell, in seconds.
    pub(super) fn add(&mut self, worth: f64, bits: f64, since_s: f64) {
        self.worth += worth;
        self.worth_since += worth * since_s;
        self.bits += bits;
    }

    /// Worth times age, a bit, at `now_s` seconds.
    pub(super) fn per_bit(&self, now_s: f64) -> f64 {
        (self.worth * (1.0 + now_s) - self.worth_since) / (HEAD_BITS + self.bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_cells_come_before_lonely_flips_and_age_comes_before_both() {
        let interest = Interest::new(|label| if label == 7 { 0.8 } else { 0.0 });
        let value = |old: u8, new: u8, since_s: f64| {
            let mut value = Value::default();
            (0..20).for_each(|_| value.add(interest.worth(old, new), cost(old), since_s));
            value.per_bit(100.0)
        };
        assert!(value(0, 1, 90.0) > 3.0 * value(2, 1, 90.0));
        assert!(value(2, 7, 90.0) > 4.0 * value(2, 1, 90.0));
        assert!(value(2, 1, 1.0) > value(0, 1, 90.0));
    }
}
