//! Label slots of the sampler: global counts, which slots are in use, whose topic each one is.
//!
//! A slot is a column of the count tables and is used again; a [`TopicId`] is the serial number of a topic's birth and
//! is not.

use serde::{Deserialize, Serialize};

use super::kernel::Move;

/// Label slots come in blocks of this many, whatever the width of the machine's vectors.
pub(crate) const LANES: usize = 16;

/// One block of per-slot numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Lanes(pub(crate) [f32; LANES]);

/// One block of per-slot counts.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub(crate) struct Counts(pub(crate) [i32; LANES]);

const LABEL_BITS: u32 = 12;
const LABEL_MASK: u32 = (1 << LABEL_BITS) - 1;

/// Label of a word that has none yet; above every slot.
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

/// Serial number of a topic's birth, never used twice by one model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TopicId(pub u32);

/// Global word and label counts with the vectors that the kernel reads.
#[derive(Clone, Debug)]
pub(crate) struct Labels {
    pub(crate) blocks: usize,
    /// Occurrences of word w under each slot: rows of `blocks`.
    pub(crate) rows: Vec<Counts>,
    /// Prior weight in each cell: alpha of slots in use, the birth weight of the birth slot, 0 of others.
    pub(crate) prior: Vec<Lanes>,
    /// 1 / (n_k + V beta).
    pub(crate) rate: Vec<Lanes>,
    /// What `rate` gains when one word is taken away.
    pub(crate) rate_gain: Vec<Lanes>,
    pub(crate) beta: f32,
    alpha: f32,
    birth_weight: f32,
    word_mass: f64,
    max_labels: usize,
    totals: Vec<u64>,
    topics: Vec<Option<TopicId>>,
    birth_slot: Option<u32>,
    next_topic: u32,
}

impl Labels {
    pub(crate) fn new(config: &super::SceneConfig) -> Self {
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
            totals: vec![0; blocks * LANES],
            topics: vec![None; max_labels],
            birth_slot: None,
            next_topic: 0,
        };
        labels.settle();
        labels
    }

    /// Other priors from now on; counts and topics stay.
    pub(crate) fn set_priors(&mut self, config: &super::SceneConfig) {
        self.beta = config.beta as f32;
        self.alpha = config.alpha as f32;
        self.birth_weight = config.birth_weight() as f32;
        self.word_mass = f64::from(config.vocabulary) * config.beta;
        self.settle();
    }

    /// Slots of a checkpoint; the counts are still to come.
    pub(crate) fn restore(config: &super::SceneConfig, topics: &[Option<TopicId>], next_topic: u32) -> Self {
        Self { topics: topics.to_vec(), next_topic, ..Self::new(config) }
    }

    /// Counts labelled words.
    pub(crate) fn count(&mut self, words: &[u32]) {
        for &packed in words {
            let slot = label_of(packed) as usize;
            self.rows[word_of(packed) as usize * self.blocks + slot / LANES].0[slot % LANES] += 1;
            self.totals[slot] += 1;
        }
    }

    /// Topic of each slot, and the serial number of the next birth.
    pub(crate) fn topics(&self) -> (&[Option<TopicId>], u32) {
        (&self.topics, self.next_topic)
    }

    /// Slot that stands for a new label, if there is room for one.
    pub(crate) fn birth_slot(&self) -> Option<u32> {
        self.birth_slot
    }

    /// Prior count of each label in each cell.
    pub(crate) fn alpha(&self) -> f32 {
        self.alpha
    }

    /// Topics in use.
    pub(crate) fn active(&self) -> usize {
        self.topics.iter().flatten().count()
    }

    pub(crate) fn topic(&self, slot: u32) -> Option<TopicId> {
        self.topics.get(slot as usize).copied().flatten()
    }

    /// Takes the label changes of a phase into the counts.
    ///
    /// Totals are gathered in four parts, or each change would wait for the one before it.
    pub(crate) fn relabel(&mut self, moves: &[Move]) {
        let blocks = self.blocks;
        let mut gains = vec![[0i32; 4]; self.totals.len()];
        for (index, change) in moves.iter().enumerate() {
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

    /// Gives topics to slots that were born, retires empty ones, and refreshes what the kernel reads.
    pub(crate) fn settle(&mut self) {
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
        let wanted = self.birth_weight > 0.0 || self.active() == 0;
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
