//! The label, confidence and perplexity of one cell.

use super::cells::Cells;
use super::kernel::{Kernel, LabelVotes};
use super::labels::{LANES, Labels, Lanes, TopicId, UNLABELLED};

/// The evaluation of one cell for the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct CellView {
    pub(crate) topic: TopicId,
    /// The number of words whose MAP label is the topic's.
    pub(crate) agreeing: u32,
    pub(crate) words: u32,
    /// The sum of -ln p(w) over the words, nats.
    pub(crate) surprise: f64,
}

/// Evaluates cells one after another with the same buffers.
pub(crate) struct Evaluator<'a> {
    labels: &'a Labels,
    near: Vec<Lanes>,
    share: Vec<Lanes>,
    tally: Vec<u32>,
    /// The number of topics in use.
    topics: f64,
}

impl<'a> Evaluator<'a> {
    pub(crate) fn new(labels: &'a Labels) -> Self {
        let zero = vec![Lanes([0.0; LANES]); labels.blocks];
        let tally = vec![0; labels.blocks * LANES];
        Self { labels, near: zero.clone(), share: zero, tally, topics: labels.in_use() as f64 }
    }

    /// Evaluates one cell. Its topic is the mode of the MAP labels of its words, ties to the oldest topic.
    ///
    /// The MAP label of a word is the label in use with the largest weight, the word's own label removed,
    /// ties to the lowest slot.
    pub(crate) fn view(&mut self, kernel: Kernel, cells: &Cells, cell: u32) -> CellView {
        cells.gather(cell, &mut self.near, &mut self.share);
        self.prepare();
        self.tally.fill(0);
        let words = cells.words(cell);
        let votes = LabelVotes { labels: self.labels, near: &self.near, share: &self.share };
        let ln_likelihood = kernel.map_labels(&votes, words, &mut self.tally);
        let near: f64 = self.near.iter().flat_map(|lanes| lanes.0).map(f64::from).sum();
        let mass = near + self.topics * f64::from(self.labels.alpha());
        let (topic, agreeing) = self.mode();
        let words = words.len() as u32;
        CellView { topic, agreeing, words, surprise: f64::from(words) * mass.ln() - ln_likelihood }
    }

    /// Computes (n_k + alpha) / (n_k. + V beta) of the labels in use; 0 for other slots.
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
        for (slot, &votes) in self.tally.iter().enumerate().filter(|entry| *entry.1 > 0) {
            let topic = self.labels.topic(slot as u32).unwrap_or(TopicId(u32::MAX));
            if votes > winner.1 || (votes == winner.1 && topic < winner.0) {
                winner = (topic, votes);
            }
        }
        winner
    }
}
