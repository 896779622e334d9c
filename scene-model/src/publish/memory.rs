//! The topics that each cell has shown lately, so that the published map follows their mean and not the last draw.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};

use super::{in_step, update_in_step};
use crate::topics::{FlatCell, TopicId};

/// Time in which a vote loses all but 1/e of its weight, seconds.
const MEMORY_S: f64 = 100.0;
/// The longest time that counts between two maps, seconds.
const MAX_STEP_S: f64 = 60.0;
/// A cell changes its topic for one that has this many times the votes of the topic that it shows.
const MARGIN: f32 = 2.0;
/// Topics of a cell with fewer votes are forgotten. A vote of a usual map is more, so that a topic that comes up between
/// many votes for another one can gather its own.
const FORGOTTEN: f32 = 0.01;
/// Maximum number of topics that are remembered of a cell; a further one takes the place of the one with fewest votes.
const MAX_TOPICS: usize = 8;

/// The topics that the cells of a map have shown, with weights that decay over 100 s.
///
/// Gibbs sampling draws from a distribution, so the label of a cell between two topics changes with every map although
/// nothing has been learnt. With [`Self::learn`] each map votes for the topic of each cell, by its confidence. A cell of
/// [`Self::steady`] keeps its topic until another one has twice as many votes, or until its topic is in no cell of the
/// last map.
///
/// ```
/// use scene_model::publish::TopicMemory;
/// use scene_model::topics::{FlatCell, TopicId};
///
/// let map = |topic| [FlatCell { x: 0, y: 0, z: 0, topic: TopicId(topic), words: 60, confidence: 0.8, perplexity: 9.0 }];
/// let other = FlatCell { x: 1, ..map(5)[0] };
/// let mut memory = TopicMemory::default();
/// for (t_s, topic) in [(0.0, 4), (2.0, 4), (4.0, 5), (6.0, 4)] {
///     memory.learn(t_s, &[map(topic)[0], FlatCell { topic: TopicId(9 - topic), ..other }]);
///     assert_eq!(memory.steady(&map(topic))[0].topic, TopicId(4));
/// }
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TopicMemory {
    /// The cells by (y, x), that is row by row.
    cells: BTreeMap<(i32, i32), CellMemory>,
    last_s: Option<f64>,
}

/// The votes for the topics of one cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct CellMemory {
    shown: TopicId,
    votes: Vec<(TopicId, f32)>,
    /// The votes that the shown topic would have if every map had been certain of it.
    maps: f32,
}

fn place(cell: &&FlatCell) -> (i32, i32) {
    (cell.y, cell.x)
}

impl TopicMemory {
    /// Counts the map of the time `t_s` in seconds, sorted by (y, x). Topics that no cell of it has are forgotten.
    pub fn learn(&mut self, t_s: f64, cells: &[FlatCell]) {
        let passed_s = (t_s - self.last_s.replace(t_s).unwrap_or(t_s)).clamp(0.0, MAX_STEP_S);
        let kept = (-passed_s / MEMORY_S).exp() as f32;
        let alive: BTreeSet<TopicId> = cells.iter().map(|cell| cell.topic).collect();
        let fresh = |cell: &&FlatCell| CellMemory { shown: cell.topic, votes: Vec::new(), maps: 0.0 };
        update_in_step(&mut self.cells, cells, place, fresh, |memory, cell| memory.learn(cell, kept, &alive));
    }

    /// Returns the map, sorted by (y, x), with the remembered topic of each cell.
    ///
    /// The confidence of a cell is the mean of its confidence in this topic over the remembered maps, 0 for those that
    /// showed another one. A cell that is not remembered stays as it is.
    #[must_use]
    pub fn steady(&self, cells: &[FlatCell]) -> Vec<FlatCell> {
        let steady = |(cell, memory): (&FlatCell, Option<&CellMemory>)| match memory {
            Some(memory) => FlatCell { topic: memory.shown, confidence: memory.confidence(), ..*cell },
            None => *cell,
        };
        in_step(&self.cells, cells, place).map(steady).collect()
    }
}

impl CellMemory {
    fn learn(&mut self, cell: &FlatCell, kept: f32, alive: &BTreeSet<TopicId>) {
        self.votes.iter_mut().for_each(|vote| vote.1 *= kept);
        self.maps = self.maps * kept + 1.0;
        self.votes.retain(|vote| vote.1 >= FORGOTTEN && alive.contains(&vote.0));
        match self.votes.iter_mut().find(|vote| vote.0 == cell.topic) {
            Some(vote) => vote.1 += cell.confidence,
            None => {
                self.votes.truncate(MAX_TOPICS - 1);
                self.votes.push((cell.topic, cell.confidence));
            }
        }
        // Ties to the oldest topic, so that the order of the votes depends on nothing else.
        self.votes.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let Some(&(best, most)) = self.votes.first() else { return };
        if self.votes_for(self.shown) * MARGIN < most || !alive.contains(&self.shown) {
            self.shown = best;
        }
    }

    fn votes_for(&self, topic: TopicId) -> f32 {
        self.votes.iter().find(|vote| vote.0 == topic).map_or(0.0, |vote| vote.1)
    }

    fn confidence(&self) -> f32 {
        (self.votes_for(self.shown) / self.maps.max(1.0)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A row of cells of which the last ones keep the topics 7 and 8 in use.
    fn row(topic: u32, confidence: f32) -> Vec<FlatCell> {
        let cell =
            |(x, topic)| FlatCell { x, y: 0, z: 0, topic: TopicId(topic), words: 49, confidence, perplexity: 9.0 };
        [(0, topic), (1, 7), (2, 8)].map(cell).to_vec()
    }

    fn shown(memory: &TopicMemory) -> u32 {
        memory.steady(&row(7, 1.0))[0].topic.0
    }

    #[test]
    fn a_cell_between_two_topics_keeps_the_first() {
        let mut memory = TopicMemory::default();
        let mut t_s = 0.0;
        for draw in 0..200 {
            t_s += 2.0;
            memory.learn(t_s, &row(7 + draw % 2, 0.6));
            assert_eq!(shown(&memory), 7, "{draw}");
        }
        let cell = memory.steady(&row(8, 0.6))[0];
        assert!((0.25..0.35).contains(&cell.confidence), "half of the maps had this topic: {}", cell.confidence);
    }

    #[test]
    fn a_lasting_change_is_shown_within_minutes() {
        let mut memory = TopicMemory::default();
        (0..500).for_each(|map| memory.learn(f64::from(map) * 2.0, &row(7, 0.9)));
        let changed = (500..1000).find(|&map| {
            memory.learn(f64::from(map) * 2.0, &row(8, 0.9));
            shown(&memory) == 8
        });
        assert!((20..90).contains(&(changed.unwrap() - 500)), "{changed:?}");
    }

    #[test]
    fn the_rate_of_maps_does_not_change_the_memory() {
        let changed_s = |step_s: f64| {
            let mut memory = TopicMemory::default();
            let at = |map: u32| f64::from(map) * step_s;
            let half = (600.0 / step_s) as u32;
            (0..half).for_each(|map| memory.learn(at(map), &row(7, 0.9)));
            let changed = (half..2 * half).find(|&map| {
                memory.learn(at(map), &row(8, 0.9));
                shown(&memory) == 8
            });
            at(changed.unwrap()) - 600.0
        };
        assert!((changed_s(0.2) - changed_s(10.0)).abs() < 15.0);
    }

    #[test]
    fn a_topic_that_is_in_no_cell_is_shown_no_longer() {
        let mut memory = TopicMemory::default();
        (0..100).for_each(|map| memory.learn(f64::from(map) * 2.0, &row(6, 0.9)));
        memory.learn(200.0, &row(8, 0.2));
        assert_eq!(shown(&memory), 8);
    }

    #[test]
    fn memory_of_a_cell_is_bounded() {
        let mut memory = TopicMemory::default();
        for map in 0..1000u32 {
            let many = (0..40).map(|x| FlatCell { x, topic: TopicId((map * 7 + x as u32) % 40), ..row(0, 0.5)[0] });
            memory.learn(f64::from(map), &many.collect::<Vec<_>>());
        }
        assert!(memory.cells.values().all(|cell| cell.votes.len() <= MAX_TOPICS));
    }

    #[test]
    fn unknown_cells_stay_as_they_are() {
        let map = row(3, 0.4);
        assert_eq!(TopicMemory::default().steady(&map), map);
    }
}
