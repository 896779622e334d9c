//! One phase of the sampler: cells that are not neighbours, resampled against frozen global counts, in the order of refinement.
//!
//! The mixed schedule of Girdhar and Dudek (arXiv 1509.03242): half of the draws go to the cells of the
//! last observation, half to all cells, with a probability that rises with recency as Beta(2, 1) over
//! the order of first observation.

use super::cells::Cells;
use super::kernel::{ActiveCell, Job, Kernel};
use super::labels::{LabelChanges, Labels};
use crate::random::CounterRng;
use std::sync::{Mutex, PoisonError};

/// The cells that one thread interleaves: each word depends on the word before it in the same cell,
/// but not on other cells.
const INTERLEAVED_CELLS: usize = 4;
/// With fewer words than this, starting another thread takes longer than it saves.
const WORDS_PER_THREAD: usize = 4096;

/// The sampling threads of a model.
#[derive(Clone, Debug)]
pub(crate) struct SamplerPool {
    workers: Vec<Worker>,
}

impl SamplerPool {
    pub(crate) fn new(blocks: usize, kernel: Kernel, threads: usize) -> Self {
        Self { workers: vec![Worker::new(blocks, kernel); threads.max(1)] }
    }

    pub(crate) fn threads(&self) -> usize {
        self.workers.len()
    }

    /// Resamples the words of each cell in `list` from the given index on, then updates all counts. Returns the number
    /// of words.
    ///
    /// The cells must not be neighbours of each other. Their labels then depend only on counts that stay frozen during
    /// the phase, so the result does not depend on the number of threads.
    pub(crate) fn phase(
        &mut self,
        cells: &mut Cells,
        labels: &mut Labels,
        list: impl Iterator<Item = (u32, usize)>,
        phase: u64,
    ) -> u64 {
        let mut words = 0;
        let job = |(cell, first)| {
            let taken = std::mem::take(cells.words_mut(cell));
            words += taken.len() - first;
            Job { cell, first, words: taken }
        };
        let jobs: Vec<Job> = list.map(job).collect();
        let threads = (words / WORDS_PER_THREAD).clamp(1, self.workers.len());
        let (all_cells, all_labels) = (&*cells, &*labels);
        let queue = Mutex::new(jobs.into_iter());
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let (mine, others) = self.workers.split_at_mut(1);
        if threads == 1 {
            mine[0].resample(all_cells, all_labels, next, phase);
        } else {
            std::thread::scope(|scope| {
                for worker in others.iter_mut().take(threads - 1) {
                    scope.spawn(|| worker.resample(all_cells, all_labels, next, phase));
                }
                mine[0].resample(all_cells, all_labels, next, phase);
            });
        }
        for worker in self.workers.iter_mut().take(threads) {
            worker.commit(cells, labels);
        }
        labels.assign_topics();
        words as u64
    }
}

/// The buffers of one sampling thread.
#[derive(Clone, Debug)]
struct Worker {
    kernel: Kernel,
    active_cells: Vec<ActiveCell>,
    changes: LabelChanges,
    finished: Vec<Job>,
    /// Label counts of the finished cells, one after another.
    counts: Vec<u16>,
}

impl Worker {
    fn new(blocks: usize, kernel: Kernel) -> Self {
        let active_cells = vec![ActiveCell::new(blocks); INTERLEAVED_CELLS];
        Self { kernel, active_cells, changes: LabelChanges::default(), finished: Vec::new(), counts: Vec::new() }
    }

    fn resample(&mut self, cells: &Cells, labels: &Labels, mut next: impl FnMut() -> Option<Job>, phase: u64) {
        let mut taken = 0;
        loop {
            while taken < INTERLEAVED_CELLS
                && let Some(job) = next()
            {
                self.active_cells[taken].start(cells, labels, job, phase);
                taken += 1;
            }
            let active_cells = &mut self.active_cells[..taken];
            let Some(steps) = active_cells.iter().map(ActiveCell::remaining).min() else { return };
            self.changes.reserve(steps * taken);
            self.kernel.advance(labels, active_cells, steps, &mut self.changes);
            for index in (0..taken).rev() {
                if self.active_cells[index].remaining() == 0 {
                    self.finished.push(self.active_cells[index].finish(labels, &mut self.counts));
                    taken -= 1;
                    self.active_cells.swap(index, taken);
                }
            }
        }
    }

    /// Writes the results of the phase to the cells and the global counts.
    fn commit(&mut self, cells: &mut Cells, labels: &mut Labels) {
        for (job, counts) in self.finished.drain(..).zip(self.counts.chunks_exact(cells.width())) {
            *cells.words_mut(job.cell) = job.words;
            cells.counts_mut(job.cell).copy_from_slice(counts);
        }
        self.counts.clear();
        labels.relabel(self.changes.take());
    }
}

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
