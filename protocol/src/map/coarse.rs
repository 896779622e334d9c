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

    /// The lattice that the next chunk is to be of: the coarse one while it has a cell waiting and there is too much to say.
    pub(super) fn stride(&self, counts: &Counts) -> Stride {
        let bits = counts.waiting * BITS_PER_CELL;
        match self.after_bytes {
            Some(most) if bits > most.saturating_mul(8) && counts.waiting_coarse > 0 => Stride::Four,
            _ => Stride::One,
        }
    }
}
