//! A phase of the sampler: cells that are no neighbours, against global counts that stand still.

use super::cells::Cells;
use super::kernel::{Move, visit};
use super::labels::{LANES, Labels, Lanes};
use crate::random::derive;

/// Working memory of one sampling thread.
#[derive(Clone, Debug, Default)]
pub(crate) struct Workbench {
    near: Vec<Lanes>,
    scratch: Vec<Lanes>,
    moves: Vec<Move>,
}

impl Workbench {
    pub(crate) fn new(blocks: usize) -> Self {
        let zero = vec![Lanes([0.0; LANES]); blocks];
        Self { near: zero.clone(), scratch: zero, moves: Vec::new() }
    }

    /// Resamples the words of a cell from `first` on; the changes wait for [`Workbench::settle`].
    ///
    /// Cells of one phase must not be neighbours. Returns the number of words.
    pub(crate) fn resample(&mut self, cells: &mut Cells, labels: &Labels, cell: u32, first: usize, phase: u64) -> u64 {
        cells.gather(cell, &mut self.near);
        let key = derive(phase, u64::from(cell));
        let words = &mut cells.words_mut(cell)[first..];
        let count = words.len() as u64;
        visit(labels, &mut self.near, &mut self.scratch, words, key, &mut self.moves);
        cells.recount(cell);
        count
    }

    /// Brings the global counts up to date at the end of a phase.
    pub(crate) fn settle(&mut self, labels: &mut Labels) {
        for change in self.moves.drain(..) {
            labels.relabel(change.word, u32::from(change.old), u32::from(change.new));
        }
        labels.settle();
    }
}
