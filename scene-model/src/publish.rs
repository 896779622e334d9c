//! Published label ids: what a number on the map means never changes within an epoch.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use crate::topics::{FlatCell, TopicId};

const DEFAULT_MIN_CELLS: u32 = 3;

/// One cell of the map as it goes out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedCell {
    /// Cell index east.
    pub x: i32,
    /// Cell index north.
    pub y: i32,
    /// Published label, 1 to 254.
    pub label: u8,
    /// As [`FlatCell::confidence`]; 0 where the label is not the cell's own topic (see [`LabelBook::publish`]).
    pub confidence: f32,
    /// As [`FlatCell::perplexity`].
    pub perplexity: f32,
}

/// Number of cells of each published label.
pub fn label_areas(cells: &[PublishedCell]) -> BTreeMap<u8, u32> {
    let mut areas = BTreeMap::new();
    for cell in cells {
        *areas.entry(cell.label).or_default() += 1;
    }
    areas
}

/// Which published id stands for which topic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelBook {
    epoch: u8,
    min_cells: u32,
    /// The topic of id 1, 2, ...; nothing where an earlier run may have given the id to a topic that is not known here.
    topics: Vec<Option<TopicId>>,
    ids: BTreeMap<TopicId, u8>,
    /// Topics that held enough cells in the last call.
    held: Vec<TopicId>,
    /// Topic shown by each cell in the last call, by (y, x).
    shown: Vec<(i32, i32, TopicId)>,
}

impl LabelBook {
    /// Ids that an epoch can give: 255 is left for "does not count" in annotations, 0 is "unexplored".
    pub const CAPACITY: usize = 254;

    /// An empty book.
    pub fn new(epoch: u8) -> Self {
        let (topics, held, shown) = (Vec::new(), Vec::new(), Vec::new());
        Self { epoch, min_cells: DEFAULT_MIN_CELLS, topics, ids: BTreeMap::new(), held, shown }
    }

    /// Sets how many cells a topic must hold in two consecutive calls to be given an id (default 3, at least 1).
    pub fn with_min_cells(self, min_cells: u32) -> Self {
        Self { min_cells: min_cells.max(1), ..self }
    }

    /// Number of times that the ids were started afresh, modulo 256, from the first epoch on.
    pub fn epoch(&self) -> u8 {
        self.epoch
    }

    /// The topic that an id stands for in this epoch.
    pub fn topic_of(&self, label: u8) -> Option<TopicId> {
        self.topics.get(usize::from(label).checked_sub(1)?).copied().flatten()
    }

    /// The id of a topic in this epoch.
    pub fn label_of(&self, topic: TopicId) -> Option<u8> {
        self.ids.get(&topic).copied()
    }

    /// All ids given in this epoch, in the order in which they were given.
    pub fn labels(&self) -> impl Iterator<Item = u8> {
        1..=self.topics.len() as u8
    }

    /// Goes on in the same epoch after a restart: ids up to `told` may have been published by then, and those that this
    /// book has no topic for are never given again.
    pub fn resume(&mut self, told: u8) {
        let told = usize::from(told).min(Self::CAPACITY);
        self.topics.resize(self.topics.len().max(told), None);
    }

    /// Starts the ids afresh in another epoch; what was held counts on.
    pub fn begin_epoch(&mut self, epoch: u8) {
        self.epoch = epoch;
        self.topics.clear();
        self.ids.clear();
    }

    /// Turns a flattened map (sorted by (y, x)) into published labels, sorted alike.
    ///
    /// An id is given when a topic has held at least `min_cells` cells in two consecutive calls, so that short-lived
    /// births use up none. Until then its cells keep the label that they showed before, else take the label that most
    /// of their four neighbours have, else are left out (still unexplored to the outside). When ids run out a new
    /// epoch starts and everything is numbered afresh.
    pub fn publish(&mut self, cells: &[FlatCell]) -> Vec<PublishedCell> {
        self.give_ids(cells);
        let known: Vec<Option<TopicId>> = self.known_topics(cells);
        self.shown.clear();
        for (index, cell) in cells.iter().enumerate() {
            let Some(topic) = known[index].or_else(|| self.around(cells, &known, index)) else { continue };
            if self.ids.contains_key(&topic) {
                self.shown.push((cell.y, cell.x, topic));
            }
        }
        self.published(cells)
    }

    /// What the last call of [`Self::publish`] made of the same map: a restored book goes on showing it.
    pub fn published(&self, cells: &[FlatCell]) -> Vec<PublishedCell> {
        let mut cells = cells.iter();
        let publish = |&(y, x, topic): &(i32, i32, TopicId)| {
            let label = self.label_of(topic)?;
            let cell = cells.find(|cell| (cell.y, cell.x) == (y, x))?;
            let confidence = if topic == cell.topic { cell.confidence } else { 0.0 };
            Some(PublishedCell { x, y, label, confidence, perplexity: cell.perplexity })
        };
        self.shown.iter().filter_map(publish).collect()
    }

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

    /// For each cell its own topic, else the one it showed before, if that has an id.
    fn known_topics(&self, cells: &[FlatCell]) -> Vec<Option<TopicId>> {
        let mut before = self.shown.iter().peekable();
        let mut known = Vec::with_capacity(cells.len());
        for cell in cells {
            let place = (cell.y, cell.x);
            while before.next_if(|shown| (shown.0, shown.1) < place).is_some() {}
            let shown = before.next_if(|shown| (shown.0, shown.1) == place).map(|shown| shown.2);
            let candidates = [Some(cell.topic), shown];
            known.push(candidates.into_iter().flatten().find(|topic| self.ids.contains_key(topic)));
        }
        known
    }

    /// The topic that most of the four neighbours have; ties to the oldest.
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
    fn an_id_is_given_at_the_second_sight_and_then_stays() {
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
    fn short_lived_topics_use_up_no_ids() {
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
    fn a_new_cell_of_an_unpublished_topic_takes_its_neighbours_label() {
        let mut book = LabelBook::new(0);
        book.publish(&row(&[0; 4]));
        book.publish(&row(&[0; 4]));
        let published = book.publish(&row(&[0, 0, 0, 0, 9]));
        assert_eq!(labels(&published), [1; 5]);
        assert_eq!(published[4].confidence, 0.0);
    }

    #[test]
    fn after_a_restart_no_id_that_may_have_been_told_gets_another_meaning() {
        let mut book = LabelBook::new(4);
        book.publish(&row(&[7, 7, 7]));
        book.publish(&row(&[7, 7, 7]));
        book.resume(3);
        book.publish(&row(&[7, 7, 7, 9, 9, 9]));
        assert_eq!(labels(&book.publish(&row(&[7, 7, 7, 9, 9, 9]))), [1, 1, 1, 4, 4, 4]);
        assert_eq!((book.topic_of(1), book.topic_of(2), book.epoch()), (Some(TopicId(7)), None, 4));
        book.resume(2);
        assert_eq!(book.labels().count(), 4, "nothing is taken back");
        book.begin_epoch(5);
        assert_eq!(labels(&book.publish(&row(&[9, 9, 9, 7, 7, 7]))), [2, 2, 2, 1, 1, 1], "at once: both were held");
    }

    #[test]
    fn when_ids_run_out_a_new_epoch_numbers_what_is_there() {
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
