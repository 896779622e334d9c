//! A cell on the workbench: its words, how far they are resampled, and the label counts around it.

use super::Move;
use crate::random::derive;
use crate::topics::cells::Cells;
use crate::topics::labels::{LANES, Labels, Lanes};

/// One of the cells that are resampled side by side.
#[derive(Clone, Debug)]
pub(crate) struct Seat {
    cell: u32,
    pub(super) words: Vec<u32>,
    /// The next word to resample.
    pub(super) at: usize,
    /// Index of the word whose random number is counted 0.
    first: usize,
    /// Key of the cell's random numbers.
    pub(super) key: u64,
    /// Label counts of the neighbours.
    around: Vec<Lanes>,
    /// Label counts of the cell and its neighbours, words of this phase's new label left out.
    pub(super) near: Vec<Lanes>,
    /// `near` plus the prior, kept where there are several blocks.
    pub(super) here: Vec<Lanes>,
    /// Running sums of the weights of one word.
    pub(super) sums: Vec<Lanes>,
    /// Words that took this phase's new label.
    pub(super) births: u16,
}

impl Seat {
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

    /// Words that are still to be resampled.
    pub(crate) fn rest(&self) -> usize {
        self.words.len() - self.at
    }

    /// Index of the current word among those that are resampled.
    #[inline(always)]
    pub(super) fn count(&self) -> u64 {
        (self.at - self.first) as u64
    }

    /// Takes a job onto the bench.
    pub(crate) fn take(&mut self, cells: &Cells, labels: &Labels, job: Job, phase: u64) {
        cells.gather(job.cell, &mut self.near, &mut self.around);
        for ((here, near), prior) in self.here.iter_mut().zip(&self.near).zip(&labels.prior) {
            here.0 = std::array::from_fn(|lane| near.0[lane] + prior.0[lane]);
        }
        self.words = job.words;
        (self.cell, self.at, self.first, self.births) = (job.cell, job.first, job.first, 0);
        self.key = derive(phase, u64::from(job.cell));
    }

    /// Takes one word's label out of the counts.
    #[inline(always)]
    pub(super) fn leave(&mut self, labels: &Labels, slot: u32) {
        let (block, lane) = (slot as usize / LANES, slot as usize % LANES);
        if let (Some(near), Some(here)) = (self.near.get_mut(block), self.here.get_mut(block)) {
            near.0[lane] -= 1.0;
            here.0[lane] = near.0[lane] + labels.prior[block].0[lane];
        }
    }

    /// Counts one word's new label.
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

    /// Gives the words back; the cell's new label counts are added to `counts`.
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

/// A cell to resample: its words, from `first` on.
#[derive(Clone, Debug)]
pub(crate) struct Job {
    pub(crate) cell: u32,
    pub(crate) first: usize,
    pub(crate) words: Vec<u32>,
}

/// Label changes of a phase, written without branches: what lies past `len` is scrap.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moves {
    buffer: Vec<Move>,
    len: usize,
}

impl Moves {
    /// Makes room for `count` more.
    pub(crate) fn reserve(&mut self, count: usize) {
        if self.buffer.len() < self.len + count {
            self.buffer.resize((self.len + count).next_power_of_two(), Move::default());
        }
    }

    /// Writes a change, and keeps it if it is one.
    #[inline(always)]
    pub(super) fn note(&mut self, change: Move) {
        self.buffer[self.len] = change;
        self.len += usize::from(change.old != change.new);
    }

    /// Hands out all changes and forgets them.
    pub(crate) fn take(&mut self) -> &[Move] {
        &self.buffer[..std::mem::take(&mut self.len)]
    }
}
