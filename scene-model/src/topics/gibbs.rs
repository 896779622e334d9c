//! A phase of the sampler: cells that are no neighbours, against global counts that stand still.

use super::cells::Cells;
use super::kernel::{Kernel, Moves, Seat};
use super::labels::Labels;
use crate::random::derive;

/// Cells that are resampled side by side: one word has to wait for the word before it in the same cell only.
const SEATS: usize = 4;

/// Working memory of one sampling thread.
#[derive(Clone, Debug)]
pub(crate) struct Workbench {
    kernel: Kernel,
    seats: Vec<Seat>,
    moves: Moves,
}

impl Workbench {
    pub(crate) fn new(blocks: usize, kernel: Kernel) -> Self {
        Self { kernel, seats: vec![Seat::new(blocks); SEATS], moves: Moves::default() }
    }

    /// Resamples the words of cells, each from an index on; the global counts wait for [`Workbench::settle`].
    ///
    /// The cells must be no neighbours of each other. Returns the number of words.
    pub(crate) fn resample(
        &mut self,
        cells: &mut Cells,
        labels: &Labels,
        list: impl IntoIterator<Item = (u32, usize)>,
        phase: u64,
    ) -> u64 {
        let mut waiting = list.into_iter();
        let mut taken = 0;
        let mut done = 0;
        loop {
            while taken < SEATS
                && let Some((cell, first)) = waiting.next()
            {
                self.seats[taken].take(cells, labels, cell, first, derive(phase, u64::from(cell)));
                taken += 1;
            }
            let seats = &mut self.seats[..taken];
            let Some(steps) = seats.iter().map(Seat::rest).min() else { return done };
            self.moves.reserve(steps * taken);
            self.kernel.advance(labels, seats, steps, &mut self.moves);
            done += (steps * taken) as u64;
            for index in (0..taken).rev().filter(|&index| self.seats[index].rest() == 0).collect::<Vec<_>>() {
                self.seats[index].give_back(cells, labels);
                taken -= 1;
                self.seats.swap(index, taken);
            }
        }
    }

    /// Brings the global counts up to date at the end of a phase.
    pub(crate) fn settle(&mut self, labels: &mut Labels) {
        labels.relabel(self.moves.take());
        labels.settle();
    }
}
