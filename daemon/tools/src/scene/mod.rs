//! The scene model over files: sources of words, learning, scoring and output.

mod extent;
mod learn;
mod mosaic;
mod quality;
mod run_report;
mod tum;
mod usage;
mod words_file;

pub(crate) use learn::{LearningEffort, Schedule, learn, learn_habitats};
pub(crate) use mosaic::{Frames, Mosaic};
pub(crate) use quality::{Annotated, Quality, quality};
pub(crate) use run_report::{RunReport, write};
pub(crate) use scenecast_files::read_vocabulary;
pub(crate) use tum::{Intrinsics, Tum};
pub(crate) use words_file::WordsFile;

use image::RgbImage;
use scene_model::habitats::{Habitats, MeasuredPoint, measure};
use scene_model::project::Observation;
use scene_model::topics::{FlatCell, SceneModel};
use scene_model::words::{Word, WordExtractor};
use scenecast_core::UserError;
use std::borrow::Cow;

/// What is taken from an image: words, from which topics are learnt, or the measured points of habitats.
pub(crate) enum Look {
    Words(Box<WordExtractor>),
    Points,
}

impl Look {
    pub(crate) fn at(&mut self, image: &RgbImage, cell_px: f32) -> FrameContent {
        match self {
            Self::Words(extractor) => FrameContent::Words(extractor.extract(image, cell_px)),
            Self::Points => FrameContent::Points(measure(image, cell_px)),
        }
    }
}

/// What was taken from an image.
pub(crate) enum FrameContent {
    Words(Vec<Word>),
    Points(Vec<MeasuredPoint>),
}

impl FrameContent {
    /// The words, or the points as words that a camera can project.
    pub(crate) fn as_words(&self) -> Cow<'_, [Word]> {
        match self {
            Self::Words(words) => words.into(),
            Self::Points(points) => Habitats::as_words(points).into(),
        }
    }

    /// Keeps what was taken at places of the image, in pixels, that are wanted.
    pub(crate) fn retain(&mut self, is_wanted: impl Fn(f32, f32) -> bool) {
        match self {
            Self::Words(words) => words.retain(|word| is_wanted(word.u, word.v)),
            Self::Points(points) => points.retain(|point| is_wanted(point.u, point.v)),
        }
    }

    /// The points; none of words.
    pub(crate) fn into_points(self) -> Vec<MeasuredPoint> {
        match self {
            Self::Words(_) => Vec::new(),
            Self::Points(points) => points,
        }
    }
}

/// The labels of a survey.
pub(crate) struct LabelledMap {
    /// Seen from above, sorted by (y, x).
    pub(crate) flat: Vec<FlatCell>,
    /// All cells; with habitats those of `flat`.
    pub(crate) volume: Vec<FlatCell>,
    /// Edges of a cell, metres.
    pub(crate) cell_m: [f64; 3],
}

impl LabelledMap {
    pub(crate) fn of_topics(model: &SceneModel) -> Self {
        Self { flat: model.label_map(), volume: model.label_volume(), cell_m: model.config().cell_m }
    }

    pub(crate) fn of_habitats(habitats: &Habitats, cell_m: [f64; 3]) -> Self {
        let flat = habitats.map();
        Self { volume: flat.clone(), flat, cell_m }
    }
}

/// The observations of one moment.
pub(crate) struct Sighting {
    pub(crate) t_s: f64,
    pub(crate) observations: Vec<Observation>,
    /// Where habitats are learnt: the size of the image, pixels, and its points, to which the words of the observations refer.
    pub(crate) image: ((u32, u32), Vec<MeasuredPoint>),
    /// Share of the source that was read by now, 0..=1.
    pub(crate) done: f64,
}

pub(crate) trait WordSource {
    /// The next sighting in order of time; `None` at the end.
    fn next(&mut self) -> Result<Option<Sighting>, UserError>;

    /// What people should know of the input so far: what was skipped, and what differs from the settings of the camera.
    fn notes(&self) -> Option<String> {
        None
    }
}

/// Edge of a cell in pixels if no size is given.
pub(crate) const CELL_PX: f64 = 25.0;
/// Height of the cells in a flat world, metres: large enough that all words share one height.
pub(crate) const FLAT_M: f64 = 1e4;
