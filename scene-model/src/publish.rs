//! Published labels: numbers from 1 to 254 whose meaning never changes within an epoch.

mod in_step;
mod memory;

use std::collections::BTreeMap;

pub use in_step::{in_step, update_in_step};
pub use memory::TopicMemory;
use serde::{Deserialize, Serialize};

use crate::topics::{FlatCell, TopicId};

const DEFAULT_MIN_CELLS: u32 = 3;

/// One cell of the published map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedCell {
    /// Cell index east, as [`FlatCell::x`].
    pub x: i32,
    /// Cell index north, as [`FlatCell::y`].
    pub y: i32,
    /// The published label, 1 to 254.
    pub label: u8,
    /// As [`FlatCell::confidence`]; 0 if the label does not stand for the
    /// cell's own topic (see [`LabelBook::publish`]).
    pub confidence: f32,
    /// The perplexity of the cell's words, as [`FlatCell::perplexity`].
    pub perplexity: f32,
}

/// Returns the number of cells of each label.
#[must_use]
pub fn label_areas(cells: &[PublishedCell]) -> BTreeMap<u8, u32> {
    let mut areas = BTreeMap::new();
    for cell in cells {
        *areas.entry(cell.label).or_default() += 1;
    }
    areas
}

/// The topics that the published labels of an epoch stand for.
///
/// ```
/// use scene_model::publish::LabelBook;
/// use scene_model::topics::{FlatCell, TopicId};
///
/// let cell = |x| FlatCell { x, y: 0, z: 0, topic: TopicId(17), words: 60, confidence: 0.9, perplexity: 20.0 };
/// let map: Vec<FlatCell> = (0..4).map(cell).collect();
///
/// let mut book = LabelBook::new(0);
/// // A topic gets its label when it has held three cells in two maps in a row.
/// assert!(book.publish(&map).is_empty());
/// let published = book.publish(&map);
/// assert_eq!((published.len(), published[0].label), (4, 1));
/// assert_eq!(book.topic_of(1), Some(TopicId(17)));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelBook {
    epoch: u8,
    min_cells: u32,
    /// The topic of label 1, 2 and so on. `None` if an earlier run may have given the label to a
    /// topic that is unknown here.
    topics: Vec<Option<TopicId>>,
    ids: BTreeMap<TopicId, u8>,
    /// The topics that held enough cells in the last call.
    held: Vec<TopicId>,
    /// The topic that each cell showed after the last call, sorted by (y, x).
    shown: Vec<((i32, i32), TopicId)>,
}

impl LabelBook {
    /// The number of labels in an epoch. 0 stands for an unexplored cell, and 255 for "ignore" in annotations.
    pub const CAPACITY: usize = 254;

    /// Returns a book without labels.
    #[must_use]
    pub fn new(epoch: u8) -> Self {
        let (topics, held, shown) = (Vec::new(), Vec::new(), Vec::new());
        Self { epoch, min_cells: DEFAULT_MIN_CELLS, topics, ids: BTreeMap::new(), held, shown }
    }

    /// Sets the number of cells that a topic must hold in two consecutive calls to get a label: 3
    /// by default, at least 1.
    #[must_use]
    pub fn with_min_cells(self, min_cells: u32) -> Self {
        Self { min_cells: min_cells.max(1), ..self }
    }

    /// Returns the current epoch. It grows by 1, modulo 256, whenever the labels are numbered again from 1.
    #[must_use]
    pub fn epoch(&self) -> u8 {
        self.epoch
    }

    /// Returns the topic that a label stands for in this epoch.
    #[must_use]
    pub fn topic_of(&self, label: u8) -> Option<TopicId> {
        self.topics.get(usize::from(label).checked_sub(1)?).copied().flatten()
    }

    /// Returns the label of a topic in this epoch.
    #[must_use]
    pub fn label_of(&self, topic: TopicId) -> Option<u8> {
        self.ids.get(&topic).copied()
    }

    /// Returns all labels of this epoch, in the order in which they were given.
    pub fn labels(&self) -> impl Iterator<Item = u8> {
        1..=self.topics.len() as u8
    }

    /// Continues the same epoch after a restart. Labels up to `published` may have been published before it; those
    /// whose topic this book does not know are never given again.
    pub fn resume(&mut self, published: u8) {
        let published = usize::from(published).min(Self::CAPACITY);
        self.topics.resize(self.topics.len().max(published), None);
    }

    /// Begins another epoch, whose labels are numbered from 1. Topics that held enough cells in the last
    /// [`Self::publish`] can get their labels in the next one.
    pub fn begin_epoch(&mut self, epoch: u8) {
        self.epoch = epoch;
        self.topics.clear();
        self.ids.clear();
    }

    /// Returns the published form of a label map, both sorted by `(y, x)`.
    ///
    /// A topic gets a label after it has held at least `min_cells` cells in two consecutive calls, so that short-lived
    /// topics use up no labels. Until then its cells keep the label that they showed before; otherwise they take the
    /// label that most of their four neighbours have; otherwise they are left out, hence unexplored to the operator.
    /// When no label is left, a new epoch begins.
    pub fn publish(&mut self, cells: &[FlatCell]) -> Vec<PublishedCell> {
        self.give_ids(cells);
        let known: Vec<Option<TopicId>> = self.known_topics(cells);
        self.shown.clear();
        for (index, cell) in cells.iter().enumerate() {
            let Some(topic) = known[index].or_else(|| self.around(cells, &known, index)) else { continue };
            if self.ids.contains_key(&topic) {
                self.shown.push(((cell.y, cell.x), topic));
            }
        }
        self.published(cells)
    }

    /// Returns the result of the last [`Self::publish`] for the same map; a restored book continues with it.
    #[must_use]
    pub fn published(&self, cells: &[FlatCell]) -> Vec<PublishedCell> {
        let shown = self.shown.iter().map(|(place, topic)| (place, *topic));
        let publish = |(cell, topic): (&FlatCell, Option<TopicId>)| {
            let label = self.label_of(topic?)?;
            let confidence = if topic == Some(cell.topic) { cell.confidence } else { 0.0 };
            Some(PublishedCell { x: cell.x, y: cell.y, label, confidence, perplexity: cell.perplexity })
        };
        in_step(shown, cells, |cell| (cell.y, cell.x)).filter_map(publish).collect()
    }

    /// Gives numbers to the topics and habitats of these cells that have none: here a label is born.
    fn give_ids(&mut self, cells: &[FlatCell]) {
        let mut sizes: BTreeMap<TopicId, u32> = BTreeMap::new();
        for cell in cells {
            *sizes.entry(cell.topic).or_default() += 1;
        }
        let large = sizes.into_iter().filter(|entry| entry.1 >= self.min_cells).map(|entry| entry.0);
        let holding: Vec<TopicId> = large.collect();
        let lasting = |topic: &&TopicId| self.held.contains(topic) || self.ids.contains_key(topic);
        let lasting: Vec<TopicId> = holding.iter().filter(lasting).copied().collect();
        self.held = holding;
        let wanted = lasting.iter().filter(|topic| !self.ids.contains_key(topic)).count();
        if self.topics.len() + wanted > Self::CAPACITY {
            self.begin_epoch(self.epoch.wrapping_add(1));
        }
        for topic in lasting {
            if !self.ids.contains_key(&topic) && self.topics.len() < Self::CAPACITY {
                self.topics.push(Some(topic));
                self.ids.insert(topic, self.topics.len() as u8);
            }
        }
    }

    /// For each cell, its own topic if that has a label, otherwise the topic that it showed before.
    fn known_topics(&self, cells: &[FlatCell]) -> Vec<Option<TopicId>> {
        let shown = self.shown.iter().map(|(place, topic)| (place, *topic));
        let known = |(cell, shown): (&FlatCell, Option<TopicId>)| {
            [Some(cell.topic), shown].into_iter().flatten().find(|topic| self.ids.contains_key(topic))
        };
        in_step(shown, cells, |cell| (cell.y, cell.x)).map(known).collect()
    }

    /// The topic of most of the four neighbours, ties to the oldest topic.
    fn around(&self, cells: &[FlatCell], known: &[Option<TopicId>], index: usize) -> Option<TopicId> {
        let FlatCell { x, y, .. } = cells[index];
        let places = [(y - 1, x), (y, x - 1), (y, x + 1), (y + 1, x)];
        let find = |place| cells.binary_search_by_key(&place, |cell: &FlatCell| (cell.y, cell.x)).ok();
        let topics: Vec<TopicId> = places.into_iter().filter_map(find).filter_map(|i| known[i]).collect();
        let votes = |topic: TopicId| topics.iter().filter(|other| **other == topic).count();
        topics.iter().copied().max_by_key(|&topic| (votes(topic), std::cmp::Reverse(topic)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(topics: &[u32]) -> Vec<FlatCell> {
        let cell = |(x, &topic)| FlatCell {
            x: x as i32,
            y: 0,
            z: 0,
            topic: TopicId(topic),
            words: 49,
            confidence: 1.0,
            perplexity: 10.0,
        };
        topics.iter().enumerate().map(cell).collect()
    }

    fn labels(published: &[PublishedCell]) -> Vec<u8> {
        published.iter().map(|cell| cell.label).collect()
    }

    #[test]
    fn label_is_given_in_the_second_map_and_then_kept() {
        let mut book = LabelBook::new(0);
        assert!(book.publish(&row(&[7, 7, 7])).is_empty());
        assert_eq!(labels(&book.publish(&row(&[7, 7, 7, 7]))), [1, 1, 1, 1]);
        book.publish(&row(&[2, 2, 2, 7]));
        assert_eq!(labels(&book.publish(&row(&[2, 2, 2, 7]))), [2, 2, 2, 1]);
        assert_eq!((book.topic_of(1), book.topic_of(2)), (Some(TopicId(7)), Some(TopicId(2))));
        assert_eq!(label_areas(&book.publish(&row(&[2, 2, 2, 7]))), BTreeMap::from([(1, 1), (2, 3)]));
        assert_eq!((book.topic_of(0), book.topic_of(3)), (None, None));
    }

    #[test]
    fn short_lived_topics_use_up_no_labels() {
        let mut book = LabelBook::new(0);
        book.publish(&row(&[0; 9]));
        book.publish(&row(&[0; 9]));
        for birth in 1..500 {
            let mut topics = [0; 9];
            topics[..4].fill(birth);
            assert_eq!(labels(&book.publish(&row(&topics))), [1; 9]);
        }
        assert_eq!((book.labels().count(), book.epoch()), (1, 0));
    }

    #[test]
    fn unpublished_topic_takes_the_label_of_its_neighbours() {
        let mut book = LabelBook::new(0);
        book.publish(&row(&[0; 4]));
        book.publish(&row(&[0; 4]));
        let published = book.publish(&row(&[0, 0, 0, 0, 9]));
        assert_eq!(labels(&published), [1; 5]);
        assert_eq!(published[4].confidence, 0.0);
    }

    #[test]
    fn published_ids_keep_their_meaning_after_a_restart() {
        let mut book = LabelBook::new(4);
        book.publish(&row(&[7, 7, 7]));
        book.publish(&row(&[7, 7, 7]));
        book.resume(3);
        book.publish(&row(&[7, 7, 7, 9, 9, 9]));
        assert_eq!(labels(&book.publish(&row(&[7, 7, 7, 9, 9, 9]))), [1, 1, 1, 4, 4, 4]);
        assert_eq!((book.topic_of(1), book.topic_of(2), book.epoch()), (Some(TopicId(7)), None, 4));
        book.resume(2);
        assert_eq!(book.labels().count(), 4, "labels are never withdrawn");
        book.begin_epoch(5);
        assert_eq!(
            labels(&book.publish(&row(&[9, 9, 9, 7, 7, 7]))),
            [2, 2, 2, 1, 1, 1],
            "at once: both topics held enough cells before"
        );
    }

    #[test]
    fn new_epoch_begins_when_labels_run_out() {
        let mut book = LabelBook::new(255).with_min_cells(1);
        for topic in 0..LabelBook::CAPACITY as u32 {
            book.publish(&row(&[topic]));
            book.publish(&row(&[topic]));
        }
        assert_eq!((book.epoch(), book.labels().count()), (255, 254));
        book.publish(&row(&[253, 900]));
        assert_eq!(labels(&book.publish(&row(&[253, 900]))), [1, 2]);
        assert_eq!((book.epoch(), book.topic_of(2)), (0, Some(TopicId(900))));
    }
}
