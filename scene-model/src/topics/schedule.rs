//! Which cells are refined next.
//!
//! The mixed online schedule of arXiv 1509.03242: half of the draws go to the cells just seen, half to all cells with a
//! probability that rises with recency, as Beta(2, 1) over the order of first sight.

use super::cells::Cells;
use crate::random::Stream;

/// Words in a phase: a share of all words, so that a young model is not sampled against stale counts.
const PHASE_SHARE: u64 = 32;
const PHASE_WORDS: u64 = 32_768;

/// Most words that a phase may hold.
pub(crate) fn phase_words(total: u64) -> u64 {
    (total / PHASE_SHARE).clamp(1, PHASE_WORDS)
}

/// Draws cells for online refinement, each at most once a round.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mixed {
    recent: Vec<u32>,
    drawn_in: Vec<u64>,
    round: u64,
}

impl Mixed {
    /// Names the cells that were just observed.
    pub(crate) fn just_seen(&mut self, cells: &[u32]) {
        self.recent.clear();
        self.recent.extend_from_slice(cells);
    }

    /// The cells that were just observed.
    pub(crate) fn recent(&self) -> &[u32] {
        &self.recent
    }

    /// Cells with about `words` words, by checkerboard colour; at least one if there is any.
    pub(crate) fn draw(&mut self, cells: &Cells, words: u64, chance: &mut Stream) -> [Vec<u32>; 2] {
        let mut round = [Vec::new(), Vec::new()];
        if cells.len() == 0 {
            return round;
        }
        self.round += 1;
        self.drawn_in.resize(cells.len(), 0);
        let mut drawn = 0;
        let mut repeats = 0;
        while drawn < words && repeats < 64 {
            let cell = self.draw_one(cells.len(), chance);
            if std::mem::replace(&mut self.drawn_in[cell as usize], self.round) == self.round {
                repeats += 1;
                continue;
            }
            drawn += cells.words(cell).len() as u64;
            round[cells.colour(cell)].push(cell);
        }
        round
    }

    fn draw_one(&self, cells: usize, chance: &mut Stream) -> u32 {
        if !self.recent.is_empty() && chance.next_u64() & 1 == 0 {
            return self.recent[chance.below(self.recent.len())];
        }
        let rank = chance.unit().sqrt() * cells as f64;
        (rank as usize).min(cells - 1) as u32
    }
}
