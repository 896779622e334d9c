//! Coarse first: which cells go out before the others when there is too much to say.

use super::dirty::Counts;
use crate::map_codec::Stride;

/// What a cell of a large backlog is expected to cost, bits: nearly all of its cells are new.
const BITS_PER_CELL: usize = 2;

/// Decides between a picture of the whole and a picture of a part.
#[derive(Debug, Default)]
pub(super) struct Coarse {
    /// More than so many bytes of backlog go out coarse to fine, if that is wanted; 0: whatever waits does.
    after_bytes: Option<usize>,
}

impl Coarse {
    pub(super) fn set_limit(&mut self, after_bytes: Option<usize>) {
        self.after_bytes = after_bytes;
    }

    /// Whether there is too much to say, and every cell of the coarse lattice is said or on its way.
    pub(super) fn is_refining(&self, counts: &Counts) -> bool {
        self.is_too_much(counts) && counts.waiting_coarse == 0
    }

    fn is_too_much(&self, counts: &Counts) -> bool {
        self.after_bytes.is_some_and(|most| counts.waiting * BITS_PER_CELL > most.saturating_mul(8))
    }

    /// The lattice that the next chunk is to be of: the coarse one while it has a cell waiting and there is too much to say.
    pub(super) fn stride(&self, counts: &Counts) -> Stride {
        if self.is_too_much(counts) && counts.waiting_coarse > 0 { Stride::Four } else { Stride::One }
    }
}
