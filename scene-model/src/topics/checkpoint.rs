//! A model as bytes: everything that cannot be derived, with a version and a CRC.
//!
//! An [`Envelope`] around the snapshot in postcard. Counts, neighbours and the kernel's vectors are derived on loading.

use serde::{Deserialize, Serialize};

use super::cells::Cells;
use super::config::{ConfigError, SceneConfig};
use super::grid::Coord;
use super::labels::{Labels, TopicId, label_of, word_of};
use super::model::SceneModel;
use crate::envelope::{Envelope, EnvelopeError};
use crate::random::Stream;

const ENVELOPE: Envelope = Envelope { magic: *b"SCNMODEL", version: 2 };

/// Why bytes are no checkpoint that this program can go on from.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckpointError {
    /// No checkpoint, of another version, or damaged.
    #[error("not a checkpoint to go on from: {0}")]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right but the content cannot be.
    #[error("checkpoint content is inconsistent: {0}")]
    Inconsistent(&'static str),
    /// A parameter is out of its range.
    #[error("checkpoint parameter {0}")]
    Config(#[from] ConfigError),
}

/// What a checkpoint holds.
#[derive(Serialize, Deserialize)]
pub(super) struct Snapshot {
    pub(super) config: SceneConfig,
    pub(super) chance: Stream,
    pub(super) phases: u64,
    pub(super) next_touch: u32,
    pub(super) last_seen_s: f64,
    pub(super) recent: Vec<u32>,
    pub(super) topics: Vec<Option<TopicId>>,
    pub(super) next_topic: u32,
    /// Coordinates and packed words of each cell.
    pub(super) cells: Vec<(Coord, Vec<u32>)>,
}

impl SceneModel {
    /// The whole state as bytes, for [`SceneModel::load`].
    pub fn save(&self) -> Vec<u8> {
        ENVELOPE.seal(&postcard::to_allocvec(&self.snapshot()).unwrap_or_default())
    }

    /// A model that goes on exactly where the saved one was: same labels, same topics, same random numbers.
    pub fn load(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let content = ENVELOPE.open(bytes)?;
        let snapshot: Snapshot =
            postcard::from_bytes(content).map_err(|_| CheckpointError::Inconsistent("fields do not parse"))?;
        snapshot.config.check()?;
        snapshot.check()?;
        Ok(Self::restore(snapshot))
    }
}

impl Snapshot {
    fn check(&self) -> Result<(), CheckpointError> {
        let fail = |what| Err(CheckpointError::Inconsistent(what));
        if self.topics.len() != self.config.max_labels as usize {
            return fail("number of label slots");
        }
        if self.topics.iter().flatten().any(|topic| topic.0 >= self.next_topic) {
            return fail("a topic that was not born yet");
        }
        let mut used = vec![false; self.topics.len()];
        for (coord, words) in &self.cells {
            if words.is_empty() || words.len() > self.config.max_words_per_cell as usize {
                return fail("number of words in a cell");
            }
            if coord.iter().any(|index| index.unsigned_abs() > 1 << 30) {
                return fail("a cell out of reach");
            }
            for &packed in words {
                let Some(used) = used.get_mut(label_of(packed) as usize) else {
                    return fail("a label beyond the bound");
                };
                *used = true;
                if word_of(packed) >= self.config.vocabulary {
                    return fail("a word beyond the vocabulary");
                }
            }
        }
        if self.topics.iter().zip(&used).any(|(topic, used)| topic.is_some() != *used) {
            return fail("a label without words, or words without a label");
        }
        let mut coords: Vec<Coord> = self.cells.iter().map(|cell| cell.0).collect();
        coords.sort_unstable();
        if coords.windows(2).any(|pair| pair[0] == pair[1]) {
            return fail("a cell that is there twice");
        }
        let count = self.cells.len() as u32;
        if self.recent.iter().any(|&cell| cell >= count) || self.next_touch > count {
            return fail("a cell that is not there");
        }
        Ok(())
    }

    /// Cells and labels with all that is derived.
    pub(super) fn rebuild(&self) -> (Cells, Labels) {
        let mut labels = Labels::restore(&self.config, &self.topics, self.next_topic);
        let mut cells = Cells::new(labels.blocks, self.config.colour_levels);
        for (coord, words) in &self.cells {
            cells.restore(*coord, words);
            labels.count(words);
        }
        cells.weigh(std::iter::empty());
        labels.settle();
        (cells, labels)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::Observation;
    use proptest::prelude::*;

    fn model(seed: u64) -> SceneModel {
        let config = SceneConfig { cell_m: [1.0; 3], gamma: 0.01, vocabulary: 30, seed, ..SceneConfig::default() };
        let mut model = SceneModel::new(config).unwrap();
        for t in 0..4 {
            feed(&mut model, t);
        }
        model
    }

    fn feed(model: &mut SceneModel, t: u32) {
        let seen = |i: u32| Observation {
            word: (i * 7 + i / 100 * 11) % 30,
            x: f64::from(i % 13) - 6.0,
            y: f64::from(i / 40 + t) - 3.0,
            z: 0.0,
        };
        model.insert(f64::from(t), &(0..400).map(seen).collect::<Vec<_>>());
        model.refine(900);
    }

    #[test]
    fn a_loaded_model_goes_on_as_the_saved_one() {
        let mut saved = model(5);
        let mut loaded = SceneModel::load(&saved.save()).unwrap();
        loaded.assert_consistent();
        assert_eq!(loaded.save(), saved.save());
        for t in 4..7 {
            feed(&mut saved, t);
            feed(&mut loaded, t);
        }
        saved.sweep(1);
        loaded.sweep(1);
        assert_eq!(saved.label_map(), loaded.label_map());
        assert_eq!(saved.save(), loaded.save());
    }

    #[test]
    fn a_model_with_new_priors_goes_on_as_one_that_is_built_with_them() {
        for (alpha, beta, gamma) in [(0.3, 0.1, 0.01), (0.01, 2.0, 0.01), (0.01, 0.1, 5.0), (2.0, 0.02, 0.0)] {
            let mut tuned = model(5);
            let (before, topics) = (tuned.save(), tuned.snapshot().topics);
            tuned.set_priors(alpha, beta, gamma).unwrap();
            assert_eq!((tuned.config().alpha, tuned.config().beta, tuned.config().gamma), (alpha, beta, gamma));
            assert_ne!(tuned.save(), before, "a checkpoint has the priors in force");
            assert_eq!(tuned.snapshot().topics, topics, "no label has changed its meaning");
            // All that depends on the priors is built from scratch on loading.
            let mut built = SceneModel::load(&tuned.save()).unwrap();
            assert_eq!(built.label_map(), tuned.label_map());
            for t in 4..8 {
                feed(&mut tuned, t);
                feed(&mut built, t);
            }
            built.sweep(2);
            tuned.sweep(2);
            assert_eq!(built.label_map(), tuned.label_map());
            assert_eq!(built.save(), tuned.save());
        }
    }

    #[test]
    fn priors_out_of_range_are_refused_and_change_nothing() {
        let mut model = model(5);
        let before = model.save();
        assert_eq!(model.set_priors(0.1, 0.0, 0.1).unwrap_err().key, "beta");
        assert_eq!(model.set_priors(f64::NAN, 0.1, 0.1).unwrap_err().key, "alpha");
        assert_eq!(model.save(), before);
    }

    #[test]
    fn an_empty_model_survives() {
        let empty = SceneModel::new(SceneConfig::default()).unwrap();
        assert_eq!(SceneModel::load(&empty.save()).unwrap().cells(), 0);
    }

    #[test]
    fn other_bytes_are_refused_by_name() {
        let bytes = model(1).save();
        let refused = |bytes: &[u8]| SceneModel::load(bytes).unwrap_err();
        assert_eq!(refused(b"PNG"), EnvelopeError::Foreign.into());
        assert_eq!(refused(&bytes[..bytes.len() - 1]), EnvelopeError::Damaged.into());
        let mut newer = bytes.clone();
        newer[8] = 9;
        assert_eq!(refused(&newer), EnvelopeError::Version { found: 9, wanted: 2 }.into());
    }

    proptest! {
        #[test]
        fn damage_never_panics_and_is_never_taken(at in any::<prop::sample::Index>(), bit in 0u8..8) {
            let mut bytes = model(2).save();
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
            prop_assert!(SceneModel::load(&bytes).is_err());
        }

        #[test]
        fn content_under_a_right_checksum_never_panics(content in prop::collection::vec(any::<u8>(), 0..200)) {
            drop(SceneModel::load(&ENVELOPE.seal(&content)));
        }
    }
}
