//! The label slots of the sampler: global counts, their changes in one phase, and the topic of each slot.
//!
//! A slot is a column of the count tables and is reused after its topic has died. A [`TopicId`] is the serial number of
//! a topic's birth and is never reused.

use super::config::SceneConfig;
use serde::{Deserialize, Serialize};

/// The label slots of a block: the same number for every kernel, whatever the width of its vectors.
pub(crate) const LANES: usize = 16;

/// One block of numbers, one for each slot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

/// One block of counts, one for each slot.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Counts(pub(crate) [i32; LANES]);

const LABEL_BITS: u32 = 12;
const LABEL_MASK: u32 = (1 << LABEL_BITS) - 1;

/// The label of a word that has none yet; above every slot.
pub(crate) const UNLABELLED: u32 = LABEL_MASK;

#[inline(always)]
pub(crate) fn pack(word: u32, label: u32) -> u32 {
    word << LABEL_BITS | label
}

#[inline(always)]
pub(crate) fn label_of(packed: u32) -> u32 {
    packed & LABEL_MASK
}

#[inline(always)]
pub(crate) fn word_of(packed: u32) -> u32 {
    packed >> LABEL_BITS
}

/// The serial number of a topic's birth, from 0 on. One model never uses a number twice.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TopicId(pub u32);

/// The global word and label counts, and the vectors that the kernels derive weights from.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    pub(crate) blocks: usize,
    /// n_kw: how often word w has each label, in rows of `blocks` for each word.
    pub(crate) rows: Vec<Counts>,
    /// The prior weight of each slot in a cell: alpha if it is in use, the birth weight for the birth slot, else 0.
    pub(crate) prior: Vec<Lanes>,
    /// 1 / (n_k + V beta).
    pub(crate) rate: Vec<Lanes>,
    /// The difference that removing one word makes to `rate`.
    pub(crate) rate_gain: Vec<Lanes>,
    pub(crate) beta: f32,
    alpha: f32,
    birth_weight: f32,
    word_mass: f64,
    max_labels: usize,
    /// No topic is born while this many are in use.
    limit: usize,
    totals: Vec<u64>,
    topics: Vec<Option<TopicId>>,
    birth_slot: Option<u32>,
    next_topic: u32,
}

impl Labels {
    pub(crate) fn new(config: &SceneConfig) -> Self {
        let max_labels = config.max_labels as usize;
        let blocks = max_labels.div_ceil(LANES);
        let mut labels = Self {
            blocks,
            rows: vec![Counts([0; LANES]); config.vocabulary as usize * blocks],
            prior: vec![Lanes([0.0; LANES]); blocks],
            rate: vec![Lanes([0.0; LANES]); blocks],
            rate_gain: vec![Lanes([0.0; LANES]); blocks],
            beta: config.beta as f32,
            alpha: config.alpha as f32,
            birth_weight: config.birth_weight() as f32,
            word_mass: f64::from(config.vocabulary) * config.beta,
            max_labels,
            limit: max_labels,
            totals: vec![0; blocks * LANES],
            topics: vec![None; max_labels],
            birth_slot: None,
            next_topic: 0,
        };
        labels.assign_topics();
        labels
    }

    /// Changes the priors; counts and topics stay.
    pub(crate) fn set_priors(&mut self, config: &SceneConfig) {
        self.beta = config.beta as f32;
        self.alpha = config.alpha as f32;
        self.birth_weight = config.birth_weight() as f32;
        self.word_mass = f64::from(config.vocabulary) * config.beta;
        self.assign_topics();
    }

    /// Sets the limit, as [`SceneModel::limit_labels`](super::SceneModel::limit_labels) does.
    pub(crate) fn set_limit(&mut self, limit: usize) {
        if self.limit != limit {
            self.limit = limit;
            self.assign_topics();
        }
    }

    /// The slots of a checkpoint, with all counts 0; [`Self::count`] adds the words.
    pub(crate) fn restore(config: &SceneConfig, topics: &[Option<TopicId>], next_topic: u32) -> Self {
        Self { topics: topics.to_vec(), next_topic, ..Self::new(config) }
    }

    /// Adds labelled words to the counts.
    pub(crate) fn count(&mut self, words: &[u32]) {
        for &packed in words {
            let slot = label_of(packed) as usize;
            self.rows[word_of(packed) as usize * self.blocks + slot / LANES].0[slot % LANES] += 1;
            self.totals[slot] += 1;
        }
    }

    /// The topic of each slot, and the serial number of the next birth.
    pub(crate) fn topics(&self) -> (&[Option<TopicId>], u32) {
        (&self.topics, self.next_topic)
    }

    /// The slot that stands for a new label, if one is free.
    pub(crate) fn birth_slot(&self) -> Option<u32> {
        self.birth_slot
    }

    pub(crate) fn alpha(&self) -> f32 {
        self.alpha
    }

    /// The number of topics with words.
    pub(crate) fn in_use(&self) -> usize {
        self.topics.iter().flatten().count()
    }

    pub(crate) fn topic(&self, slot: u32) -> Option<TopicId> {
        self.topics.get(slot as usize).copied().flatten()
    }

    /// Applies the label changes of a phase to the counts.
    ///
    /// Totals are summed in four parts; otherwise each change would have to wait for the one before it.
    pub(crate) fn relabel(&mut self, changes: &[LabelChange]) {
        let blocks = self.blocks;
        let mut gains = vec![[0i32; 4]; self.totals.len()];
        for (index, change) in changes.iter().enumerate() {
            let (old, new) = (usize::from(change.old), usize::from(change.new));
            let row = &mut self.rows[change.word as usize * blocks..][..blocks];
            if old < gains.len() {
                row[old / LANES].0[old % LANES] -= 1;
                gains[old][index % 4] -= 1;
            }
            row[new / LANES].0[new % LANES] += 1;
            gains[new][index % 4] += 1;
        }
        for (total, gain) in self.totals.iter_mut().zip(gains) {
            *total = total.wrapping_add_signed(gain.iter().map(|&part| i64::from(part)).sum());
        }
    }

    /// Gives topics to slots that got their first word, retires empty ones, chooses the birth slot
    /// and updates the kernels' vectors.
    pub(crate) fn assign_topics(&mut self) {
        for (topic, &total) in self.topics.iter_mut().zip(&self.totals) {
            match (total, *topic) {
                (0, Some(_)) => *topic = None,
                (1.., None) => {
                    *topic = Some(TopicId(self.next_topic));
                    self.next_topic += 1;
                }
                _ => {}
            }
        }
        let free = self.topics.iter().position(Option::is_none).map(|slot| slot as u32);
        let in_use = self.in_use();
        let wanted = (self.birth_weight > 0.0 && in_use < self.limit) || in_use == 0;
        self.birth_slot = free.filter(|_| wanted);
        self.refresh();
    }

    fn refresh(&mut self) {
        for slot in 0..self.blocks * LANES {
            let (block, lane) = (slot / LANES, slot % LANES);
            let total = self.totals[slot] as f64;
            let is_birth = self.birth_slot == Some(slot as u32);
            let in_use = slot < self.max_labels && self.topics[slot].is_some();
            // The counts of the birth slot are 0, so its weight is prior * beta * rate: the birth weight itself.
            let birth_weight = if self.birth_weight > 0.0 { self.birth_weight } else { 1.0 };
            self.prior[block].0[lane] = match (in_use, is_birth) {
                (true, _) => self.alpha,
                (false, true) => birth_weight,
                (false, false) => 0.0,
            };
            let rate = if is_birth { 1.0 / self.beta } else { (1.0 / (total + self.word_mass)) as f32 };
            let without_one = (1.0 / (total - 1.0 + self.word_mass).max(f64::MIN_POSITIVE)) as f32;
            self.rate[block].0[lane] = rate;
            self.rate_gain[block].0[lane] = if in_use { without_one - rate } else { 0.0 };
        }
    }
}

/// A word that was resampled from label slot `old` to `new`; `old` is above every slot for a word without a label.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct LabelChange {
    pub(crate) word: u32,
    pub(crate) old: u16,
    pub(crate) new: u16,
}

/// A buffer that is written without branches: entries at or past `len` are scrap.
#[derive(Clone, Debug, Default)]
pub(crate) struct LabelChanges {
    buffer: Vec<LabelChange>,
    len: usize,
}

impl LabelChanges {
    /// Makes room for `count` more entries, which [`Self::record`] needs.
    pub(crate) fn reserve(&mut self, count: usize) {
        if self.buffer.len() < self.len + count {
            self.buffer.resize((self.len + count).next_power_of_two(), LabelChange::default());
        }
    }

    /// Writes an entry, and keeps it if the label differs.
    #[inline(always)]
    pub(crate) fn record(&mut self, change: LabelChange) {
        self.buffer[self.len] = change;
        self.len += usize::from(change.old != change.new);
    }

    /// Returns all kept entries and empties the buffer.
    pub(crate) fn take(&mut self) -> &[LabelChange] {
        &self.buffer[..std::mem::take(&mut self.len)]
    }
}
