//! A phase of the sampler: cells that are no neighbours, against global counts that stand still.

use std::sync::{Mutex, PoisonError};

use super::cells::Cells;
use super::kernel::{Job, Kernel, Moves, Seat};
use super::labels::Labels;

/// Cells that are resampled side by side: one word has to wait for the word before it in the same cell only.
const SEATS: usize = 4;
/// A thread is not worth its start for fewer words.
const WORDS_PER_THREAD: usize = 4096;

/// The sampling threads of a model.
#[derive(Clone, Debug)]
pub(crate) struct Workshop {
    benches: Vec<Workbench>,
}

impl Workshop {
    pub(crate) fn new(blocks: usize, kernel: Kernel, threads: usize) -> Self {
        Self { benches: vec![Workbench::new(blocks, kernel); threads.max(1)] }
    }

    pub(crate) fn threads(&self) -> usize {
        self.benches.len()
    }

    /// Resamples the words of cells, each from an index on, and settles all counts.
    ///
    /// The cells must be no neighbours of each other: then each one's labels depend on nothing that changes meanwhile,
    /// and the outcome not on the number of threads. Returns the number of words.
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
        let threads = (words / WORDS_PER_THREAD).clamp(1, self.benches.len());
        let (all_cells, all_labels) = (&*cells, &*labels);
        let queue = Mutex::new(jobs.into_iter());
        let next = || queue.lock().unwrap_or_else(PoisonError::into_inner).next();
        let (mine, others) = self.benches.split_at_mut(1);
        if threads == 1 {
            mine[0].resample(all_cells, all_labels, next, phase);
        } else {
            std::thread::scope(|scope| {
                for bench in others.iter_mut().take(threads - 1) {
                    scope.spawn(|| bench.resample(all_cells, all_labels, next, phase));
                }
                mine[0].resample(all_cells, all_labels, next, phase);
            });
        }
        for bench in self.benches.iter_mut().take(threads) {
            bench.settle(cells, labels);
        }
        labels.settle();
        words as u64
    }
}

/// Working memory of one sampling thread.
#[derive(Clone, Debug)]
struct Workbench {
    kernel: Kernel,
    seats: Vec<Seat>,
    moves: Moves,
    finished: Vec<Job>,
    /// Label counts of the finished cells.
    counts: Vec<u16>,
}

impl Workbench {
    fn new(blocks: usize, kernel: Kernel) -> Self {
        let seats = vec![Seat::new(blocks); SEATS];
        Self { kernel, seats, moves: Moves::default(), finished: Vec::new(), counts: Vec::new() }
    }

    fn resample(&mut self, cells: &Cells, labels: &Labels, mut next: impl FnMut() -> Option<Job>, phase: u64) {
        let mut taken = 0;
        loop {
            while taken < SEATS
                && let Some(job) = next()
            {
                self.seats[taken].take(cells, labels, job, phase);
                taken += 1;
            }
            let seats = &mut self.seats[..taken];
            let Some(steps) = seats.iter().map(Seat::rest).min() else { return };
            self.moves.reserve(steps * taken);
            self.kernel.advance(labels, seats, steps, &mut self.moves);
            for index in (0..taken).rev() {
                if self.seats[index].rest() == 0 {
                    self.finished.push(self.seats[index].finish(labels, &mut self.counts));
                    taken -= 1;
                    self.seats.swap(index, taken);
                }
            }
        }
    }

    /// Brings the cells and the global counts up to date.
    fn settle(&mut self, cells: &mut Cells, labels: &mut Labels) {
        for (job, counts) in self.finished.drain(..).zip(self.counts.chunks_exact(cells.width())) {
            *cells.words_mut(job.cell) = job.words;
            cells.counts_mut(job.cell).copy_from_slice(counts);
        }
        self.counts.clear();
        labels.relabel(self.moves.take());
    }
}
