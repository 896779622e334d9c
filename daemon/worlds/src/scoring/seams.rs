//! Seams: whether cells of one class have one label although they were seen far apart in time.

use std::collections::BTreeMap;

/// Cells first seen within this time of each other count as seen together, seconds.
const NEAR_S: f64 = 30.0;
/// Cells first seen at least this time apart, seconds.
const FAR_S: f64 = 90.0;

/// A cell of a map with its label, its true class, and the time at which it was first seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedCell {
    /// Label of the cell on the map that is scored.
    pub label: u32,
    /// True class of the cell, with which the label is compared.
    pub class: u32,
    /// Time of the first sight, seconds.
    pub first_seen_s: f64,
}

/// Shares of pairs of neighbours of one class that have one label.
///
/// A map that follows the sea floor has equal shares; one whose labels follow time has a lower share across time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seams {
    /// Of pairs first seen within 30 s of each other; `None` without such a pair.
    pub within: Option<f64>,
    /// Of pairs first seen 90 s apart or more; `None` without such a pair.
    pub across: Option<f64>,
}

impl Seams {
    /// Compares each cell with its neighbours to the east and north, by (x, y).
    #[must_use]
    pub fn of(cells: &BTreeMap<(i32, i32), TimedCell>) -> Self {
        let (mut within, mut across) = (Pairs::default(), Pairs::default());
        for (&(x, y), cell) in cells {
            for there in [(x + 1, y), (x, y + 1)] {
                let Some(other) = cells.get(&there).filter(|other| other.class == cell.class) else { continue };
                let apart_s = (cell.first_seen_s - other.first_seen_s).abs();
                let is_equal = cell.label == other.label;
                if apart_s <= NEAR_S {
                    within.add(is_equal);
                } else if apart_s >= FAR_S {
                    across.add(is_equal);
                }
            }
        }
        Self { within: within.share(), across: across.share() }
    }
}

#[derive(Default)]
struct Pairs {
    all: u64,
    equal: u64,
}

impl Pairs {
    fn add(&mut self, is_equal: bool) {
        self.all += 1;
        self.equal += u64::from(is_equal);
    }

    fn share(&self) -> Option<f64> {
        (self.all > 0).then(|| self.equal as f64 / self.all as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two legs of 10 x 2 cells over one class, two minutes apart.
    fn legs(label: impl Fn(i32) -> u32) -> BTreeMap<(i32, i32), TimedCell> {
        let cell = |x, y: i32| TimedCell { label: label(y), class: 4, first_seen_s: f64::from(x + 120 * (y / 2)) };
        (0..40).map(|i| ((i % 10, i / 10), cell(i % 10, i / 10))).collect()
    }

    #[test]
    fn labels_that_follow_time_have_a_seam_and_others_none() {
        assert_eq!(Seams::of(&legs(|_| 1)), Seams { within: Some(1.0), across: Some(1.0) });
        assert_eq!(Seams::of(&legs(|y| y as u32 / 2)), Seams { within: Some(1.0), across: Some(0.0) });
        assert_eq!(Seams::of(&BTreeMap::new()), Seams::default());
    }

    #[test]
    fn neighbours_of_different_classes_do_not_count() {
        let mut cells = legs(|_| 1);
        cells.values_mut().enumerate().for_each(|(i, cell)| cell.class = i as u32);
        assert_eq!(Seams::of(&cells), Seams::default());
    }
}
