//! The cells that go first when the backlog is large.

use super::dirty::Counts;
use crate::map_codec::Stride;

/// The expected cost of a cell of a large backlog in bits; nearly all of these cells are new.
const BITS_PER_CELL: usize = 2;

/// Decides between an overview of the whole map and a detailed part of it.
#[derive(Debug, Default)]
pub(super) struct Coarse {
    /// A larger backlog in bytes goes out coarse to fine; 0 means always, `None` never.
    after_bytes: Option<usize>,
}

impl Coarse {
    pub(super) fn set_limit(&mut self, after_bytes: Option<usize>) {
        self.after_bytes = after_bytes;
    }

    /// Whether the backlog is large while every cell of the coarse lattice is sent or in flight.
    pub(super) fn is_refining(&self, counts: &Counts) -> bool {
        self.is_too_much(counts) && counts.waiting_coarse == 0
    }

    fn is_too_much(&self, counts: &Counts) -> bool {
        self.after_bytes.is_some_and(|most| counts.waiting * BITS_PER_CELL > most.saturating_mul(8))
    }

    /// The lattice of the next chunk: the coarse one while the backlog is large and one of its cells waits.
    pub(super) fn stride(&self, counts: &Counts) -> Stride {
        if self.is_too_much(counts) && counts.waiting_coarse > 0 { Stride::Four } else { Stride::One }
    }
}
