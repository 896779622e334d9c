//! The label map, updated cell by cell and flattened to two dimensions, with confidence and perplexity.

use super::cells::Cells;
use super::kernel::{Kernel, LabelVotes};
use super::labels::{LANES, Labels, Lanes, TopicId, UNLABELLED};

/// One cell of the map flattened to two dimensions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatCell {
    /// Cell index east: the cell spans `x * edge` to `(x + 1) * edge` metres.
    pub x: i32,
    /// Cell index north, as `x`.
    pub y: i32,
    /// Cell index up, of the topmost cell with this label; `z` = 0 lies around height 0.
    pub z: i32,
    /// The topic that most words of the column belong to.
    pub topic: TopicId,
    /// The number of words in the column.
    pub words: u32,
    /// The share of the column's words whose own MAP label is this topic, 0 to 1.
    pub confidence: f32,
    /// exp(-mean ln p(w)) over the words of the column, at least about 1. In-sample: a measure
    /// of surprise, not of quality.
    pub perplexity: f32,
}

/// The evaluations of all cells, and a list of those that are out of date.
#[derive(Clone, Debug, Default)]
pub(crate) struct MapCache {
    views: Vec<Option<CellView>>,
    stale: Vec<u32>,
    is_stale: Vec<bool>,
    /// Cell ids sorted by y, x, then from top to bottom.
    order: Vec<u32>,
}

impl MapCache {
    pub(crate) fn mark_stale(&mut self, cell: u32) {
        let index = cell as usize;
        if index >= self.is_stale.len() {
            self.is_stale.resize(index + 1, false);
        }
        if !std::mem::replace(&mut self.is_stale[index], true) {
            self.stale.push(cell);
        }
    }

    /// Evaluates the cells that are out of date.
    pub(crate) fn refresh(&mut self, kernel: Kernel, cells: &Cells, labels: &Labels) {
        self.views.resize(cells.len(), None);
        let mut evaluator = Evaluator::new(labels);
        for cell in self.stale.drain(..) {
            self.is_stale[cell as usize] = false;
            self.views[cell as usize] = Some(evaluator.view(kernel, cells, cell));
        }
        if self.order.len() < cells.len() {
            self.order.extend(self.order.len() as u32..cells.len() as u32);
            self.order.sort_by_key(|&cell| {
                let [x, y, z] = cells.coord(cell);
                (y, x, std::cmp::Reverse(z))
            });
        }
    }

    /// exp of the mean surprise over all words; 1 without words.
    pub(crate) fn perplexity(&self) -> f64 {
        let (mut surprise, mut words) = (0.0, 0u64);
        for view in self.views.iter().flatten() {
            surprise += view.surprise;
            words += u64::from(view.words);
        }
        if words == 0 { 1.0 } else { (surprise / words as f64).exp() }
    }

    pub(crate) fn flatten(&self, cells: &Cells) -> Vec<FlatCell> {
        let column = |cell: u32| {
            let [x, y, _] = cells.coord(cell);
            (x, y)
        };
        let mut map = Vec::with_capacity(self.order.len());
        for stack in self.order.chunk_by(|&a, &b| column(a) == column(b)) {
            map.extend(self.flatten_column(cells, stack));
        }
        map
    }

    /// Each cell on its own, sorted by y, x, then from top to bottom.
    pub(crate) fn volume(&self, cells: &Cells) -> Vec<FlatCell> {
        self.order.iter().filter_map(|&cell| self.flatten_column(cells, &[cell])).collect()
    }

    /// The label with the most words in a column that is sorted from top to bottom; ties to the upper cell.
    fn flatten_column(&self, cells: &Cells, stack: &[u32]) -> Option<FlatCell> {
        let views = || stack.iter().filter_map(|&cell| self.views[cell as usize].map(|view| (cell, view)));
        let words_of = |topic| views().filter(|(_, v)| v.topic == topic).map(|(_, v)| v.words).sum::<u32>();
        let mut winner: Option<(u32, TopicId, u32)> = None;
        for (cell, view) in views() {
            let words = words_of(view.topic);
            if winner.is_none_or(|(_, _, most)| words > most) {
                winner = Some((cell, view.topic, words));
            }
        }
        let (cell, topic, _) = winner?;
        let [x, y, z] = cells.coord(cell);
        let words: u32 = views().map(|(_, view)| view.words).sum();
        let agreeing: u32 = views().filter(|(_, view)| view.topic == topic).map(|(_, view)| view.agreeing).sum();
        let surprise: f64 = views().map(|(_, view)| view.surprise).sum();
        let each = 1.0 / f64::from(words.max(1));
        let confidence = (f64::from(agreeing) * each) as f32;
        Some(FlatCell { x, y, z, topic, words, confidence, perplexity: (surprise * each).exp() as f32 })
    }
}

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
