//! The working state of one cell while its words are resampled.

use crate::random::derive;
use crate::topics::cells::Cells;
use crate::topics::labels::{LANES, Labels, Lanes};

/// One of the cells that a worker resamples side by side: its words, and the label counts that their weights need.
#[derive(Clone, Debug)]
pub(crate) struct ActiveCell {
    cell: u32,
    pub(super) words: Vec<u32>,
    /// The next word to resample.
    pub(super) at: usize,
    /// Index of the word whose random number is counted 0.
    first: usize,
    /// Key of the cell's random numbers.
    pub(super) key: u64,
    /// Label counts of the neighbours, weighted by appearance affinity.
    around: Vec<Lanes>,
    /// `around` plus the cell's own counts, without the words that took this phase's new label.
    pub(super) near: Vec<Lanes>,
    /// `near` plus the prior. The AVX-512 kernel for one or two blocks does not use it.
    pub(super) here: Vec<Lanes>,
    /// Running sums of the weights of one word.
    pub(super) sums: Vec<Lanes>,
    /// Words that took this phase's new label.
    pub(super) births: u16,
}

impl ActiveCell {
    pub(crate) fn new(blocks: usize) -> Self {
        let zero = vec![Lanes([0.0; LANES]); blocks];
        Self {
            cell: 0,
            words: Vec::new(),
            at: 0,
            first: 0,
            key: 0,
            around: zero.clone(),
            near: zero.clone(),
            here: zero.clone(),
            sums: zero,
            births: 0,
        }
    }

    /// The number of words that are still to be resampled.
    pub(crate) fn remaining(&self) -> usize {
        self.words.len() - self.at
    }

    /// The index of the current word among those that are resampled: the counter of its random number.
    #[inline(always)]
    pub(super) fn count(&self) -> u64 {
        (self.at - self.first) as u64
    }

    /// Starts on a job. Its random numbers depend on `phase` and the cell only.
    pub(crate) fn start(&mut self, cells: &Cells, labels: &Labels, job: Job, phase: u64) {
        cells.gather(job.cell, &mut self.near, &mut self.around);
        for ((here, near), prior) in self.here.iter_mut().zip(&self.near).zip(&labels.prior) {
            here.0 = std::array::from_fn(|lane| near.0[lane] + prior.0[lane]);
        }
        self.words = job.words;
        (self.cell, self.at, self.first, self.births) = (job.cell, job.first, job.first, 0);
        self.key = derive(phase, u64::from(job.cell));
    }

    /// Removes one word with the label `slot` from the cell's counts.
    #[inline(always)]
    pub(super) fn leave(&mut self, labels: &Labels, slot: u32) {
        let (block, lane) = (slot as usize / LANES, slot as usize % LANES);
        if let (Some(near), Some(here)) = (self.near.get_mut(block), self.here.get_mut(block)) {
            near.0[lane] -= 1.0;
            here.0[lane] = near.0[lane] + labels.prior[block].0[lane];
        }
    }

    /// Adds one word with the label `slot` to the cell's counts.
    #[inline(always)]
    pub(super) fn join(&mut self, labels: &Labels, slot: u32) {
        if labels.birth_slot() == Some(slot) {
            self.births += 1;
            return;
        }
        let (block, lane) = (slot as usize / LANES, slot as usize % LANES);
        self.near[block].0[lane] += 1.0;
        self.here[block].0[lane] = self.near[block].0[lane] + labels.prior[block].0[lane];
    }

    /// Returns the words, and appends the cell's new label counts to `counts`.
    pub(crate) fn finish(&mut self, labels: &Labels, counts: &mut Vec<u16>) -> Job {
        let start = counts.len();
        for (near, around) in self.near.iter().zip(&self.around) {
            let own: [u16; LANES] = std::array::from_fn(|lane| (near.0[lane] - around.0[lane]) as i32 as u16);
            counts.extend_from_slice(&own);
        }
        if let Some(birth) = labels.birth_slot() {
            counts[start + birth as usize] += self.births;
        }
        self.at = 0;
        Job { cell: self.cell, first: self.first, words: std::mem::take(&mut self.words) }
    }
}

/// A cell and its words, of which those from index `first` on are to be resampled.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    pub(crate) cell: u32,
    pub(crate) first: usize,
    pub(crate) words: Vec<u32>,
}
