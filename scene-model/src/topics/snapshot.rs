//! The state of a model that cannot be derived, and its validation.

use super::cells::{Cells, Coord};
use super::config::SceneConfig;
use super::labels::{Labels, TopicId, label_of, word_of};
use crate::random::CounterRng;
use serde::{Deserialize, Serialize};

/// All state that cannot be derived. The order of the fields is the format of the checkpoint.
#[derive(Serialize, Deserialize)]
pub(super) struct Snapshot {
    pub(super) config: SceneConfig,
    pub(super) rng: CounterRng,
    pub(super) phases: u64,
    pub(super) next_refresh: u32,
    pub(super) last_seen_s: f64,
    pub(super) recent: Vec<u32>,
    pub(super) topics: Vec<Option<TopicId>>,
    pub(super) next_topic: u32,
    /// The coordinates and the packed words of each cell.
    pub(super) cells: Vec<(Coord, Vec<u32>)>,
}

impl Snapshot {
    /// Checks that no index leads outside its table; the error says where the content is inconsistent.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        if self.topics.len() != self.config.max_labels as usize {
            return Err("number of label slots");
        }
        if self.topics.iter().flatten().any(|topic| topic.0 >= self.next_topic) {
            return Err("a topic that was not born yet");
        }
        let mut used = vec![false; self.topics.len()];
        for (coord, words) in &self.cells {
            if words.is_empty() || words.len() > self.config.max_words_per_cell as usize {
                return Err("number of words in a cell");
            }
            if coord.iter().any(|index| index.unsigned_abs() > 1 << 30) {
                return Err("a cell out of reach");
            }
            for &packed in words {
                let Some(used) = used.get_mut(label_of(packed) as usize) else {
                    return Err("a label beyond the bound");
                };
                *used = true;
                if word_of(packed) >= self.config.vocabulary {
                    return Err("a word beyond the vocabulary");
                }
            }
        }
        if self.topics.iter().zip(&used).any(|(topic, used)| topic.is_some() != *used) {
            return Err("a label without words, or words without a label");
        }
        let mut coords: Vec<Coord> = self.cells.iter().map(|cell| cell.0).collect();
        coords.sort_unstable();
        if coords.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err("a cell that is there twice");
        }
        let count = self.cells.len() as u32;
        if self.recent.iter().any(|&cell| cell >= count) || self.next_refresh > count {
            return Err("a cell that is not there");
        }
        Ok(())
    }

    /// Returns the cells and labels, with counts, neighbours and weights derived from the words.
    pub(super) fn rebuild(&self) -> (Cells, Labels) {
        let mut labels = Labels::restore(&self.config, &self.topics, self.next_topic);
        let mut cells = Cells::new(labels.blocks, self.config.colour_levels);
        for (coord, words) in &self.cells {
            cells.restore(*coord, words);
            labels.count(words);
        }
        cells.update_affinity(std::iter::empty());
        labels.assign_topics();
        (cells, labels)
    }
}
