//! How often labels have changed among the cells coded so far.

use super::view::magnitude;

/// Changes so far among one kind of cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Recent {
    visits: usize,
    changes: usize,
    since: usize,
}

impl Recent {
    /// The number of values of [`Recent::rate`].
    pub(super) const RATES: usize = 50;
    /// The number of values of [`Recent::gap`].
    pub(super) const GAPS: usize = 20;

    pub(super) fn note(&mut self, kept: bool) {
        self.visits += 1;
        self.changes += usize::from(!kept);
        self.since = if kept { self.since + 1 } else { 0 };
    }

    /// The number of changes and their rate, as a context.
    pub(super) fn rate(&self) -> usize {
        let sure = match self.changes {
            0 => 0,
            1 => 1,
            2..=3 => 2,
            4..=9 => 3,
            _ => 4,
        };
        sure * 10 + self.one_in() - 2
    }

    /// The logarithm of the number of cells for each change, 2 to 11.
    pub(super) fn one_in(&self) -> usize {
        (((self.visits + 8) / (self.changes + 1)).max(1).ilog2() as usize).clamp(2, 11)
    }

    /// The magnitude of the number of cells since the last change.
    pub(super) fn gap(&self) -> usize {
        magnitude(self.since).min(Self::GAPS - 1)
    }
}
