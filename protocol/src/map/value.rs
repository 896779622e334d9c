//! The value of a change to the operator, and its cost in bits.

use super::UNEXPLORED;

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
}
