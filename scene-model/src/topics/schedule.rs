//! The order in which online refinement visits the cells.
//!
//! The mixed schedule of Girdhar and Dudek (arXiv 1509.03242): half of the draws go to the cells of the
//! last observation, half to all cells, with a probability that rises with recency as Beta(2, 1) over
//! the order of first observation.

use super::cells::Cells;
use crate::random::CounterRng;

/// A phase holds at most 1/32 of all words, so that a model with few words is not sampled against stale counts.
const PHASE_SHARE: u64 = 32;
const PHASE_WORDS: u64 = 32_768;

/// The maximum number of words in a phase, in a model of `total` words.
pub(crate) fn phase_words(total: u64) -> u64 {
    (total / PHASE_SHARE).clamp(1, PHASE_WORDS)
}

/// Draws cells for online refinement, each at most once in a round.
#[derive(Clone, Debug, Default)]
pub(crate) struct MixedSchedule {
    recent: Vec<u32>,
    drawn_in: Vec<u64>,
    round: u64,
}

impl MixedSchedule {
    /// Replaces the cells of the last observation.
    pub(crate) fn set_recent(&mut self, cells: &[u32]) {
        self.recent.clear();
        self.recent.extend_from_slice(cells);
    }

    pub(crate) fn recent(&self) -> &[u32] {
        &self.recent
    }

    /// Draws cells with about `words` words in total, at least one cell, split by checkerboard colour.
    pub(crate) fn draw(&mut self, cells: &Cells, words: u64, rng: &mut CounterRng) -> [Vec<u32>; 2] {
        let mut round = [Vec::new(), Vec::new()];
        if cells.len() == 0 {
            return round;
        }
        self.round += 1;
        self.drawn_in.resize(cells.len(), 0);
        let mut drawn = 0;
        let mut repeats = 0;
        while drawn < words && repeats < 64 {
            let cell = self.draw_one(cells.len(), rng);
            if std::mem::replace(&mut self.drawn_in[cell as usize], self.round) == self.round {
                repeats += 1;
                continue;
            }
            drawn += cells.words(cell).len() as u64;
            round[cells.colour(cell)].push(cell);
        }
        round
    }

    fn draw_one(&self, cells: usize, rng: &mut CounterRng) -> u32 {
        if !self.recent.is_empty() && rng.next_u64() & 1 == 0 {
            return self.recent[rng.below(self.recent.len())];
        }
        let rank = rng.unit().sqrt() * cells as f64;
        (rank as usize).min(cells - 1) as u32
    }
}
