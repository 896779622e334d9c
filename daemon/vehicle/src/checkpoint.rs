//! The checkpoint of a mapper: the scene model, its labels, its vocabulary and its exemplars as bytes.

use super::cells::Cells;
use super::mapper::{FrameWords, Mapper};
use scene_model::envelope::{Envelope, EnvelopeError};
use scene_model::exemplars::ExemplarStore;
use scene_model::habitats::Habitats;
use scene_model::online::OnlineInference;
use scene_model::publish::LabelBook;
use scene_model::topics::{CheckpointError, SceneConfig, SceneModel};
use scene_model::words::{Discriminant, FlatField, Measures, WordExtractor};
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_registration::Registrar;
use serde::{Deserialize, Serialize};

const ENVELOPE: Envelope = Envelope { magic: *b"SCNMAPPR", version: 3 };

/// The reason why a checkpoint cannot be restored.
#[derive(Debug, thiserror::Error)]
pub enum RestoreError {
    /// The bytes are no checkpoint, of another version, or damaged.
    #[error(transparent)]
    Envelope(#[from] EnvelopeError),
    /// The scene model in it is invalid.
    #[error(transparent)]
    Model(#[from] CheckpointError),
    /// The checksum is right, but the content contradicts itself.
    #[error("its content is inconsistent")]
    Inconsistent,
    #[error("it was made with other parameters of the scene model")]
    OtherParameters,
    #[error(transparent)]
    Config(#[from] UserError),
}

#[derive(Serialize, Deserialize)]
struct CheckpointContent<M, B, W, E, C> {
    lineage: u64,
    last_s: Option<f64>,
    model: M,
    book: B,
    words: W,
    exemplars: E,
    cells: C,
}

/// The content after [`CheckpointContent`]: the light, the registration, the discriminant, the inference under way, and the
/// habitats.
type AddedContent<'a> = (Option<FlatField>, Option<&'a [u8]>, Option<Discriminant>, OnlineInference, Option<Habitats>);

/// A mapper that continues from a checkpoint, and the mission that it belongs to.
pub struct Restored {
    pub mapper: Mapper,
    pub lineage: u64,
}

impl Mapper {
    /// Encodes the mapper for [`Mapper::restore`]. `lineage` is the number of the mission.
    pub(super) fn encode(&self, lineage: u64) -> Vec<u8> {
        let kept = CheckpointContent {
            lineage,
            last_s: self.last_s,
            model: self.model.save(),
            book: &self.book,
            words: self.words.extractor.measures(),
            exemplars: &self.exemplars.store,
            cells: &self.cells,
        };
        let registration = self.placer.save();
        let measures = self.words.extractor.measures();
        let Self { words: FrameWords { light, .. }, online, habitats, .. } = self;
        let added = (light, registration, measures.discriminant(), online, habitats);
        ENVELOPE.seal(&postcard::to_allocvec(&(kept, added)).unwrap_or_default())
    }

    /// Restores a mapper if its parameters are those of the configuration. Priors may differ: those of the checkpoint
    /// apply until [`Mapper::tune`] sets others.
    pub fn restore(config: &Config, vocabulary: Option<Measures>, bytes: &[u8]) -> Result<Restored, RestoreError> {
        let content = ENVELOPE.open(bytes)?;
        let (kept, added): (CheckpointContent<Vec<u8>, LabelBook, Measures, ExemplarStore, Cells>, AddedContent<'_>) =
            postcard::from_bytes(content).map_err(|_| RestoreError::Inconsistent)?;
        let (light, registration, discriminant, online, habitats) = added;
        let kept_words = kept.words.with_discriminant(discriminant);
        let model = SceneModel::load(&kept.model)?;
        let fresh = Mapper::new(config, vocabulary, kept.book.epoch(), config.runtime.seed)?;
        let &SceneConfig { alpha, beta, gamma, seed, .. } = model.config();
        let configured = SceneConfig { alpha, beta, gamma, seed, ..fresh.model.config().clone() };
        let configured_words = fresh.words.extractor.measures();
        let is_same_kind = habitats.is_some() == fresh.habitats.is_some();
        if *model.config() != configured || !continues(&kept_words, &configured_words) || !is_same_kind {
            return Err(RestoreError::OtherParameters);
        }
        let mut mapper = fresh;
        mapper.words.light = mapper.words.light.map(|fresh| light.unwrap_or(fresh));
        let kept_registrar = registration.and_then(registrar_of).map(|kept| kept.with_loops(config.registration.loops));
        mapper.placer.restore(kept_registrar);
        mapper.words.extractor = WordExtractor::from_measures(kept_words);
        (mapper.model, mapper.book) = (model, kept.book);
        (mapper.exemplars.store, mapper.cells, mapper.last_s) = (kept.exemplars, kept.cells, kept.last_s);
        (mapper.online, mapper.habitats) = (online, habitats);
        mapper.restore_map();
        Ok(Restored { mapper, lineage: kept.lineage })
    }
}

/// A registration from its bytes. Without a usable one, frames are placed against those that come.
fn registrar_of(bytes: &[u8]) -> Option<Registrar> {
    Registrar::restore(bytes).inspect_err(|why| tracing::warn!("the registration starts again: {why}")).ok()
}

/// Whether measures can have come from those of the configuration: a frozen vocabulary stays as it is, otherwise frames
/// change all but the words' numbers and the discriminant.
fn continues(kept: &Measures, configured: &Measures) -> bool {
    if configured.are_frozen() {
        return scene_model::vocabulary::save(kept) == scene_model::vocabulary::save(configured);
    }
    kept.config() == configured.config() && kept.discriminant() == configured.discriminant()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Frame;
    use crate::{MapChanges, MapProducer};
    use image::{Rgb, RgbImage};
    use scene_model::project::Pose;
    use scene_model::words::{FEATURES, WordConfig};
    use scenecast_protocol::directive::{Change, Settings, ShortDecimal};
    use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerId};

    fn config(sets: &[&str]) -> Config {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        scenecast_config::load(None, &sets).unwrap()
    }

    fn frame(mapper: &mut Mapper, at: u32) -> MapChanges {
        let image = RgbImage::from_fn(160, 120, |x, y| {
            let kind = ((x + 40 * at) / 240 + y / 120) % 3;
            Rgb([(kind * 90 + x % 7) as u8, (200 - kind * 60 + y % 5) as u8, ((x * y) % 31) as u8])
        });
        let pose = Pose { x: f64::from(at) * 0.4, y: 0.0, z: -4.0, yaw_rad: 0.0 };
        mapper.handle_frame(&Frame::flat(&image, pose, 1.0), f64::from(at) * 2.0)
    }

    #[test]
    fn a_restored_mapper_continues_like_the_saved_one() {
        for labels in ["scene.labels=topics", "scene.labels=habitats"] {
            assert_continues(&config(&[labels]));
        }
        let topics = Mapper::new(&config(&["scene.labels=topics"]), None, 3, 1).unwrap();
        let other = Mapper::restore(&config(&["scene.labels=habitats"]), None, &topics.save(1));
        assert!(matches!(other, Err(RestoreError::OtherParameters)));
    }

    fn assert_continues(config: &Config) {
        let mut whole = Mapper::new(config, None, 3, 1).unwrap();
        (0..12).for_each(|at| drop(frame(&mut whole, at)));
        let shown = whole.current();
        let Restored { mapper: mut restored, lineage } = Mapper::restore(config, None, &whole.save(77)).unwrap();
        assert_eq!((lineage, restored.epoch(), restored.last_s()), (77, 3, Some(22.0)));
        assert_eq!(restored.current(), shown);
        let labels = shown.labels.unwrap();
        assert!(labels.cells.len() > 20 && labels.highest >= 2);
        for label in 1..=labels.highest {
            assert_eq!(restored.exemplars(label), whole.exemplars(label));
        }
        for at in 12..20 {
            assert_eq!(frame(&mut restored, at), frame(&mut whole, at));
        }
    }

    #[test]
    fn the_last_sight_of_a_cell_ages_until_it_is_seen_again() {
        let mut mapper = Mapper::new(&config(&[]), None, 3, 1).unwrap();
        (0..4).for_each(|_| drop(frame(&mut mapper, 0)));
        let scale = &BUILT_IN_LAYERS[LayerId::LAST_SEEN.index()].descriptor;
        let levels = |mapper: &Mapper| mapper.current().layers.remove(&LayerId::LAST_SEEN).unwrap();
        let first = levels(&mapper);
        assert!(first.len() > 3 && first.iter().all(|&(_, level)| level == scale.level(0.0, 0)));
        let (seen, _) = first[0];
        let age = |mapper: &Mapper| levels(mapper).iter().find(|(cell, _)| *cell == seen).unwrap().1;
        frame(&mut mapper, 45);
        assert_eq!(age(&mapper), scale.level(1.5, 0));
        frame(&mut mapper, 90);
        let cells = mapper.current().labels.unwrap().cells;
        assert_eq!((age(&mapper), cells.len()), (scale.level(3.0, 0), levels(&mapper).len()));
        let image = RgbImage::from_pixel(160, 120, Rgb([90, 120, 60]));
        mapper.handle_frame(&Frame::flat(&image, Pose { x: 0.0, y: 0.0, z: -4.0, yaw_rad: 0.0 }, 1.0), 200.0);
        assert_eq!(age(&mapper), scale.level(0.0, 0));
    }

    #[test]
    fn a_content_without_its_end_is_refused() {
        let mut mapper = Mapper::new(&config(&[]), None, 3, 1).unwrap();
        (0..5).for_each(|at| drop(frame(&mut mapper, at)));
        let bytes = mapper.save(7);
        let content = ENVELOPE.open(&bytes).unwrap();
        let online = postcard::to_allocvec(&mapper.online).unwrap().len();
        for missing in [1, online, online + 1] {
            let cut = ENVELOPE.seal(&content[..content.len() - missing]);
            assert!(matches!(Mapper::restore(&config(&[]), None, &cut), Err(RestoreError::Inconsistent)));
        }
    }

    #[test]
    fn a_checkpoint_continues_with_its_own_discriminant_alone() {
        let along = |measure: usize| -> [f32; FEATURES] { std::array::from_fn(|i| f32::from(u8::from(i == measure))) };
        let vocabulary = |measure: usize| {
            let prototypes: Vec<Vec<f32>> = (0..9).map(|i| vec![i as f32 * 0.5 - 2.0]).collect();
            let discriminant = Discriminant::new(&[along(measure)], &prototypes).unwrap();
            Some(WordExtractor::new(&WordConfig::default()).measures().with_discriminant(Some(discriminant)))
        };
        let config = config(&[]);
        let mut whole = Mapper::new(&config, vocabulary(4), 3, 1).unwrap();
        (0..5).for_each(|at| drop(frame(&mut whole, at)));
        let bytes = whole.save(1);
        let mut restored = Mapper::restore(&config, vocabulary(4), &bytes).unwrap().mapper;
        assert_eq!(restored.words.extractor.measures().discriminant(), vocabulary(4).unwrap().discriminant());
        for at in 5..9 {
            assert_eq!(frame(&mut restored, at), frame(&mut whole, at));
        }
        for other in [vocabulary(7), None] {
            assert!(matches!(Mapper::restore(&config, other, &bytes), Err(RestoreError::OtherParameters)));
        }
    }

    #[test]
    fn a_checkpoint_survives_other_priors() {
        let figure = |value: f64| Change::To(ShortDecimal::new(value).unwrap());
        let settings = Settings { gamma: figure(0.2), alpha: figure(0.5), ..Settings::default() };
        let mut whole = Mapper::new(&config(&[]), None, 3, 1).unwrap();
        (0..4).for_each(|at| drop(frame(&mut whole, at)));
        whole.tune(&settings);
        (4..9).for_each(|at| drop(frame(&mut whole, at)));
        assert_eq!(whole.priors(), [0.5, 0.1, 0.2]);
        for sets in [&[][..], &["scene.gamma=0.01", "scene.alpha=3"]] {
            let mut again = Mapper::restore(&config(sets), None, &whole.save(7)).unwrap().mapper;
            assert_eq!((again.priors(), again.current()), (whole.priors(), whole.current()));
            again.tune(&settings);
            assert_eq!(again.current(), whole.current());
            let mut continued = Mapper::restore(&config(&[]), None, &whole.save(7)).unwrap().mapper;
            continued.tune(&settings);
            assert_eq!(frame(&mut again, 9), frame(&mut continued, 9));
        }
        let mut other = Mapper::restore(&config(&["scene.gamma=0.01"]), None, &whole.save(7)).unwrap().mapper;
        other.tune(&Settings::default());
        assert_eq!(other.priors(), [0.01, 0.1, 0.01], "as configured without an order");
        assert_eq!(frame(&mut other, 9).labels.unwrap().epoch, 3);
    }

    #[test]
    fn a_frame_rate_takes_the_first_frame_of_each_interval() {
        let mut mapper = Mapper::new(&config(&[]), None, 0, 1).unwrap();
        let taken = |mapper: &mut Mapper| {
            (0..20).filter(|at| mapper.takes(f64::from(*at) * 2.0).then(|| frame(mapper, *at)).is_some()).count()
        };
        assert_eq!(taken(&mut mapper), 20);
        for (rate, frames) in [(30.0, 20), (0.5, 20), (0.25, 10), (0.3, 12), (0.05, 2)] {
            mapper
                .tune(&Settings { frames_per_s: Change::To(ShortDecimal::new(rate).unwrap()), ..Settings::default() });
            mapper.last_s = None;
            assert_eq!(taken(&mut mapper), frames, "{rate} 1/s of 0.5");
        }
    }

    #[test]
    fn other_parameters_and_damage_are_refused_by_name() {
        let mut mapper = Mapper::new(&config(&[]), None, 0, 1).unwrap();
        frame(&mut mapper, 0);
        let bytes = mapper.save(1);
        let error =
            |sets: &[&str], bytes: &[u8]| Mapper::restore(&config(sets), None, bytes).err().map(|e| e.to_string());
        assert_eq!(error(&["runtime.seed=9", "scene.refine_words_per_s=5"], &bytes), None);
        let other = Some("it was made with other parameters of the scene model".to_owned());
        assert_eq!(error(&["scene.max_labels=20"], &bytes), other);
        assert_eq!(error(&["scene.cell_m=0.5"], &bytes), other);
        assert_eq!(error(&[], &bytes[..bytes.len() / 2]), Some("cut off or damaged".to_owned()));
        assert_eq!(error(&[], b"hello"), Some("a file of another kind".to_owned()));
        for at in (20..bytes.len() - 4).step_by(bytes.len() / 200) {
            let mut content = bytes[20..bytes.len() - 4].to_vec();
            content[at - 20] ^= 0x41;
            drop(Mapper::restore(&config(&[]), None, &ENVELOPE.seal(&content)));
        }
    }
}
