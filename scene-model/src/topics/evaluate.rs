//! What a cell shows on the map: mode of the MAP labels of its words, confidence, perplexity.

use super::cells::Cells;
use super::kernel::{Ballot, Kernel};
use super::labels::{LANES, Labels, Lanes, TopicId, UNLABELLED};

/// The map's view of one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellView {
    pub(crate) topic: TopicId,
    /// Words whose MAP label is the cell's.
    pub(crate) votes: u32,
    pub(crate) words: u32,
    /// Sum over words of -ln p(w), nats.
    pub(crate) surprise: f64,
}

/// Evaluates cells one after another with the same working memory.
pub(crate) struct Evaluator<'a> {
    labels: &'a Labels,
    near: Vec<Lanes>,
    share: Vec<Lanes>,
    votes: Vec<u32>,
    active: f64,
}

impl<'a> Evaluator<'a> {
    pub(crate) fn new(labels: &'a Labels) -> Self {
        let zero = vec![Lanes([0.0; LANES]); labels.blocks];
        let votes = vec![0; labels.blocks * LANES];
        Self { labels, near: zero.clone(), share: zero, votes, active: labels.active() as f64 }
    }

    /// MAP label per word is the arg max over labels in use with the word's own label taken out; ties to the lowest
    /// slot there and to the oldest topic in the mode.
    pub(crate) fn view(&mut self, kernel: Kernel, cells: &Cells, cell: u32) -> CellView {
        cells.gather(cell, &mut self.near, &mut self.share);
        self.prepare();
        self.votes.fill(0);
        let words = cells.words(cell);
        let ballot = Ballot { labels: self.labels, near: &self.near, share: &self.share };
        let ln_likelihood = kernel.vote(&ballot, words, &mut self.votes);
        let near: f64 = self.near.iter().flat_map(|lanes| lanes.0).map(f64::from).sum();
        let mass = near + self.active * f64::from(self.labels.alpha());
        let (topic, votes) = self.mode();
        let words = words.len() as u32;
        CellView { topic, votes, words, surprise: f64::from(words) * mass.ln() - ln_likelihood }
    }

    /// (n_k + alpha) / (n_k. + V beta) of labels in use, 0 of others.
    fn prepare(&mut self) {
        let labels = self.labels;
        let birth = labels.birth_slot().unwrap_or(UNLABELLED) as usize;
        for block in 0..labels.blocks {
            for lane in 0..LANES {
                let here = self.near[block].0[lane] + labels.prior[block].0[lane];
                self.share[block].0[lane] = here * labels.rate[block].0[lane];
            }
        }
        if let Some(lanes) = self.share.get_mut(birth / LANES) {
            lanes.0[birth % LANES] = 0.0;
        }
    }

    fn mode(&self) -> (TopicId, u32) {
        let mut winner = (TopicId(u32::MAX), 0);
        for (slot, &votes) in self.votes.iter().enumerate().filter(|entry| *entry.1 > 0) {
            let topic = self.labels.topic(slot as u32).unwrap_or(TopicId(u32::MAX));
            if votes > winner.1 || (votes == winner.1 && topic < winner.0) {
                winner = (topic, votes);
            }
        }
        winner
    }
}
