//! Checkpoints: the state of a model as bytes, and back.
//!
//! The bytes are an [`Envelope`] around the [`Snapshot`] in postcard. Counts, neighbours and the kernels'
//! vectors are derived on loading.

use super::config::ConfigError;
use super::model::SceneModel;
use super::snapshot::Snapshot;
use crate::envelope::{Envelope, EnvelopeError};

const ENVELOPE: Envelope = Envelope { magic: *b"SCNMODEL", version: 2 };

/// The bytes are not a checkpoint that this version can load.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// The bytes are not a checkpoint, are of another version, or are damaged.
    #[error("not a usable checkpoint: {0}")]
    Envelope(#[from] EnvelopeError),
    /// The checksum is right, but the content contradicts itself; the text names where.
    #[error("checkpoint content is inconsistent: {0}")]
    Inconsistent(&'static str),
    /// A stored parameter is out of its range.
    #[error("checkpoint parameter {0}")]
    Config(#[from] ConfigError),
}

impl SceneModel {
    /// Returns the whole state as bytes, for [`SceneModel::load`].
    ///
    /// The kernel and the number of threads are not part of the state.
    ///
    /// ```
    /// use scene_model::project::Observation;
    /// use scene_model::topics::{SceneConfig, SceneModel};
    ///
    /// let mut model = SceneModel::new(SceneConfig::default())?;
    /// model.insert(0.0, &[Observation { word: 3, x: 0.1, y: 0.1, z: 0.0 }]);
    /// let mut restored = SceneModel::load(&model.save())?;
    ///
    /// // Both continue with the same random numbers, hence with the same labels.
    /// model.refine(100);
    /// restored.refine(100);
    /// assert_eq!(model.save(), restored.save());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn save(&self) -> Vec<u8> {
        ENVELOPE.seal(&postcard::to_allocvec(&self.snapshot()).unwrap_or_default())
    }

    /// Returns a model that continues where the saved one was: its words have the same labels, and the same calls draw
    /// the same random numbers.
    ///
    /// The first map after loading evaluates every cell. The saved model would have evaluated the changed cells and a
    /// share of the others, so its next map can differ in cells whose neighbours have changed.
    ///
    /// Content that was not written by [`SceneModel::save`] is refused and never panics.
    pub fn load(bytes: &[u8]) -> Result<Self, CheckpointError> {
        let content = ENVELOPE.open(bytes)?;
        let snapshot: Snapshot =
            postcard::from_bytes(content).map_err(|_| CheckpointError::Inconsistent("fields do not parse"))?;
        snapshot.config.check()?;
        snapshot.check().map_err(CheckpointError::Inconsistent)?;
        Ok(Self::restore(snapshot))
    }
}

#[cfg(test)]
mod tests {
    use super::super::config::SceneConfig;
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
    fn loaded_model_continues_as_the_saved_one() {
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
    fn new_priors_act_as_in_a_model_built_with_them() {
        for (alpha, beta, gamma) in [(0.3, 0.1, 0.01), (0.01, 2.0, 0.01), (0.01, 0.1, 5.0), (2.0, 0.02, 0.0)] {
            let mut tuned = model(5);
            let (before, topics) = (tuned.save(), tuned.snapshot().topics);
            tuned.set_priors(alpha, beta, gamma).unwrap();
            assert_eq!((tuned.config().alpha, tuned.config().beta, tuned.config().gamma), (alpha, beta, gamma));
            assert_ne!(tuned.save(), before, "a checkpoint has the current priors");
            assert_eq!(tuned.snapshot().topics, topics, "no label has changed its meaning");
            // Loading derives everything that depends on the priors.
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
    fn priors_out_of_range_are_refused_without_effect() {
        let mut model = model(5);
        let before = model.save();
        assert_eq!(model.set_priors(0.1, 0.0, 0.1).unwrap_err().key, "beta");
        assert_eq!(model.set_priors(f64::NAN, 0.1, 0.1).unwrap_err().key, "alpha");
        assert_eq!(model.save(), before);
    }

    #[test]
    fn empty_model_can_be_saved_and_loaded() {
        let empty = SceneModel::new(SceneConfig::default()).unwrap();
        assert_eq!(SceneModel::load(&empty.save()).unwrap().cells(), 0);
    }

    #[test]
    fn foreign_and_damaged_bytes_are_refused_by_name() {
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
        fn damage_is_always_refused(at in any::<prop::sample::Index>(), bit in 0u8..8) {
            let mut bytes = model(2).save();
            let at = at.index(bytes.len());
            bytes[at] ^= 1 << bit;
            prop_assert!(SceneModel::load(&bytes).is_err());
        }

        #[test]
        fn content_with_a_right_checksum_never_panics(content in prop::collection::vec(any::<u8>(), 0..200)) {
            drop(SceneModel::load(&ENVELOPE.seal(&content)));
        }
    }
}
