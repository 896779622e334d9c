//! A trial: a comparison of the scene model with the baselines on an annotated image, and the training of its vocabulary.

use super::annotations::{AnnotationError, Annotations, LabelGrid};
use super::baselines::{mean_lab_labels, pooled_word_labels};
use super::mutual_information::{SceneScore, score};
use image::{GrayImage, RgbImage};
use scene_model::habitats::{Habitats, measure};
use scene_model::project::{DownCamera, Observation, Pose};
use scene_model::topics::{ConfigError, SceneConfig, SceneModel};
use scene_model::words::{Measures, Word, WordConfig, WordExtractor};
use serde::Serialize;

/// A method that labels the cells of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// k-means on the mean Lab colour of each cell.
    MeanLab,
    /// k-means on the word shares of each cell and its eight neighbours.
    PooledWords,
    /// The habitats of the scene model, in place of its topics.
    Habitats,
    /// The topics of the scene model with [`SceneConfig::for_images`].
    SceneModel,
}

impl Method {
    /// All methods; the scene model is the last.
    pub const ALL: [Self; 4] = [Self::MeanLab, Self::PooledWords, Self::Habitats, Self::SceneModel];

    /// The name in reports: `kmeans_lab`, `kmeans_pooled_words`, `habitats` or `scene_model`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::MeanLab => "kmeans_lab",
            Self::PooledWords => "kmeans_pooled_words",
            Self::Habitats => "habitats",
            Self::SceneModel => "scene_model",
        }
    }
}

/// The settings that all methods and scenes of a comparison share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Trial {
    /// The maximum number of labels (K): 2 to 254.
    pub labels: u32,
    /// The number of cells in a row of the image, at least 1. Cells are square, with an edge of at least 4 pixels.
    pub cells_across: u32,
    /// The number of sweeps of the scene model over all words.
    pub sweeps: u32,
    /// The number of seeds, from 1 on; 0 counts as 1.
    pub seeds: u64,
}

impl Default for Trial {
    fn default() -> Self {
        Self { labels: 16, cells_across: 100, sweeps: 30, seeds: 3 }
    }
}

impl Trial {
    /// Returns the edge of a cell of an image that is `width` pixels wide, pixels.
    #[must_use]
    pub fn cell_px(&self, width: u32) -> f32 {
        (width as f32 / self.cells_across.max(1) as f32).max(MIN_CELL_PX)
    }
}

/// The score of a method on a scene: means over the seeds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MeanScore {
    /// Mutual information of map labels and annotated classes, nats.
    pub mutual_information_nats: f64,
    /// Mutual information over the geometric mean of both entropies, 0 to 1.
    pub normalised_mutual_information: f64,
    /// The harmonic mean of homogeneity and completeness, 0 to 1.
    pub v_measure: f64,
    /// The same with the tree of the labels cut at 8; only [`Method::Habitats`] has a tree.
    pub v_measure_at_8: Option<f64>,
    /// The mean mutual information of the flipped and shifted maps, nats.
    pub null_mutual_information_nats: f64,
    /// Mutual information minus that of the null model, nats.
    pub excess_nats: f64,
    /// The number of different labels in the map.
    pub labels_used: f64,
}

/// A scene cannot be scored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrialError {
    /// The image has too few pixels for several cells.
    #[error("the image has {0} x {1} pixels; a scene needs at least {MIN_IMAGE_PX} x {MIN_IMAGE_PX}")]
    Tiny(u32, u32),
    /// The annotations and the image differ in size.
    #[error(transparent)]
    Annotations(#[from] AnnotationError),
    /// No pixel has a class that is not ignored.
    #[error("no pixel is annotated")]
    NoClasses,
    /// A parameter is out of its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// The minimum width and height of an image, pixels.
const MIN_IMAGE_PX: u32 = 16;
/// The minimum edge of a cell, pixels.
const MIN_CELL_PX: f32 = 4.0;

/// An image with its annotations, and the words that the methods share.
pub struct AnnotatedScene<'a> {
    trial: Trial,
    image: &'a RgbImage,
    cell_px: f32,
    annotations: Annotations,
    words: Vec<Word>,
    vocabulary: u32,
}

impl<'a> AnnotatedScene<'a> {
    /// Extracts the words of an image. `classes` has the class of each pixel; pixels with a class in
    /// `ignore` count as not annotated.
    pub fn new(trial: Trial, image: &'a RgbImage, classes: &GrayImage, ignore: &[u8]) -> Result<Self, TrialError> {
        Self::with_words(trial, image, classes, ignore, WordExtractor::new(&WordConfig::default()))
    }

    /// As [`Self::new`], with the words of an extractor.
    pub fn with_words(
        trial: Trial,
        image: &'a RgbImage,
        classes: &GrayImage,
        ignore: &[u8],
        mut extractor: WordExtractor,
    ) -> Result<Self, TrialError> {
        let size = image.dimensions();
        if size.0.min(size.1) < MIN_IMAGE_PX {
            return Err(TrialError::Tiny(size.0, size.1));
        }
        let cell_px = trial.cell_px(size.0);
        let annotations = Annotations::new(classes, size, cell_px, ignore)?;
        if annotations.cells().is_none() {
            return Err(TrialError::NoClasses);
        }
        let words = extractor.extract(image, cell_px);
        Ok(Self { trial, image, cell_px, annotations, words, vocabulary: extractor.vocabulary_size() })
    }

    /// Returns the edge of a cell, pixels.
    #[must_use]
    pub fn cell_px(&self) -> f32 {
        self.cell_px
    }

    /// Returns the annotations of the cells.
    #[must_use]
    pub fn annotations(&self) -> &Annotations {
        &self.annotations
    }

    /// Returns the score of a method, mean over the seeds.
    pub fn mean_score(&self, method: Method) -> Result<MeanScore, TrialError> {
        let seeds = self.trial.seeds.max(1);
        let mut mean = MeanScore::default();
        for seed in 1..=seeds {
            mean.add(&score(&self.labels(method, seed)?, &self.annotations), 1.0 / seeds as f64);
        }
        if method == Method::Habitats {
            let cut = score(&self.habitats(8), &self.annotations);
            mean.v_measure_at_8 = Some(cut.mutual_information.v_measure());
        }
        Ok(mean)
    }

    /// Returns the label map of a method.
    pub fn labels(&self, method: Method, seed: u64) -> Result<LabelGrid, TrialError> {
        let (k, size) = (self.trial.labels as usize, self.image.dimensions());
        match method {
            Method::MeanLab => Ok(mean_lab_labels(self.image, self.cell_px, k, seed)),
            Method::PooledWords => Ok(pooled_word_labels(&self.words, self.vocabulary, size, self.cell_px, k, seed)),
            Method::Habitats => Ok(self.habitats(usize::MAX)),
            Method::SceneModel => self.scene_model_labels(seed),
        }
    }

    /// Places in the image, a cell being a metre.
    fn projected(&self, words: &[Word]) -> Vec<Observation> {
        let (width, height) = self.image.dimensions();
        let cells = |px: u32| f64::from(px) / f64::from(self.cell_px);
        let camera = DownCamera { metres_per_pixel: 1.0 / f64::from(self.cell_px), altitude_m: 0.0 };
        let middle = Pose { x: cells(width) / 2.0, y: -cells(height) / 2.0, z: 0.0, yaw_rad: 0.0 };
        camera.project(width, height, &middle, words)
    }

    /// The habitats, of which at most `count` are told apart. They depend on no random number.
    fn habitats(&self, count: usize) -> LabelGrid {
        let mut habitats = Habitats::new(self.trial.labels);
        let points = measure(self.image, self.cell_px);
        habitats.add(self.image.dimensions(), &points, &self.projected(&Habitats::as_words(&points)), 1.0);
        habitats.learn_whole();
        let (columns, rows) = self.annotations.size();
        let mut grid = LabelGrid::empty(columns, rows);
        for (index, label) in grid.labels.iter_mut().enumerate() {
            let own = habitats.label_at((index % columns) as i32, -1 - (index / columns) as i32);
            *label = own.map(|own| habitats.tree().at(own, count));
        }
        grid
    }

    fn scene_model_labels(&self, seed: u64) -> Result<LabelGrid, TrialError> {
        let config = SceneConfig {
            cell_m: [1.0, 1.0, 1e4],
            vocabulary: self.vocabulary,
            max_labels: self.trial.labels,
            seed,
            ..SceneConfig::for_images()
        };
        let mut model = SceneModel::new(config)?;
        model.insert(0.0, &self.projected(&self.words));
        model.sweep(self.trial.sweeps);
        let (columns, rows) = self.annotations.size();
        Ok(LabelGrid::from_map(&model.label_map(), 0, -1, columns, rows))
    }
}

impl MeanScore {
    fn add(&mut self, score: &SceneScore, share: f64) {
        self.mutual_information_nats += share * score.mutual_information.nats;
        self.normalised_mutual_information += share * score.mutual_information.normalised;
        self.v_measure += share * score.mutual_information.v_measure();
        self.null_mutual_information_nats += share * score.null_nats;
        self.excess_nats += share * score.excess_nats;
        self.labels_used += share * score.labels as f64;
    }

    /// Returns the median over scenes, each number on its own; zeros for an empty slice.
    #[must_use]
    pub fn median(scores: &[Self]) -> Self {
        let median = |pick: fn(&Self) -> f64| median(&scores.iter().map(pick).collect::<Vec<f64>>());
        let at_8: Option<Vec<f64>> = scores.iter().map(|s| s.v_measure_at_8).collect();
        Self {
            mutual_information_nats: median(|s| s.mutual_information_nats),
            normalised_mutual_information: median(|s| s.normalised_mutual_information),
            v_measure: median(|s| s.v_measure),
            v_measure_at_8: at_8.filter(|values| !values.is_empty()).map(|values| self::median(&values)),
            null_mutual_information_nats: median(|s| s.null_mutual_information_nats),
            excess_nats: median(|s| s.excess_nats),
            labels_used: median(|s| s.labels_used),
        }
    }
}

/// The middle value, or the mean of the two middle ones; 0 without any.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match (sorted.len() / 2, sorted.len() % 2) {
        (0, 0) => 0.0,
        (middle, 1) => sorted[middle],
        (middle, _) => 0.5 * (sorted[middle - 1] + sorted[middle]),
    }
}

/// Learns the measures of a vocabulary from a set of images before a mission, and freezes them.
///
/// Each image comes with the edge of a cell in its pixels. The training has two passes: the tone stretch of all images,
/// then the means and deviations of their features. `images` is therefore called twice and must give the same images
/// each time, so that not all of them are in memory at once. Images without pixels, or with a cell edge that is not
/// above 0, are skipped.
///
/// ```
/// use scene_model::words::{WordConfig, WordExtractor};
/// use scenecast_worlds::scoring::train_vocabulary;
///
/// let site = || (1..4).map(|seed| (scenecast_worlds::patches(seed, 120, 90, 20, 5).image, 25.0));
/// let mut extractor = WordExtractor::from_measures(train_vocabulary(&WordConfig::default(), site));
/// let image = scenecast_worlds::patches(9, 120, 90, 20, 5).image;
/// assert_eq!(extractor.extract(&image, 25.0), extractor.extract(&image, 25.0));
/// ```
pub fn train_vocabulary<I: Iterator<Item = (RgbImage, f32)>>(config: &WordConfig, images: impl Fn() -> I) -> Measures {
    let mut extractor = WordExtractor::new(config);
    let usable = || images().filter(|(image, cell_px)| image.width() > 0 && image.height() > 0 && *cell_px > 0.0);
    usable().for_each(|(image, _)| extractor.learn_tones(&image));
    usable().for_each(|(image, cell_px)| extractor.learn_statistics(&image, cell_px));
    extractor.freeze();
    extractor.measures()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::patches;
    use image::Rgb;

    #[test]
    fn scene_model_finds_more_of_a_reef_than_the_baselines() {
        let world = patches(3, 480, 360, 60, 5);
        let classes = GrayImage::from_raw(world.width, world.height, world.truth).unwrap();
        let trial = Trial { labels: 8, cells_across: 40, sweeps: 10, seeds: 1 };
        let scene = AnnotatedScene::new(trial, &world.image, &classes, &[255]).unwrap();
        let scores = Method::ALL.map(|method| scene.mean_score(method).unwrap());
        assert!(scores.iter().all(|score| score.excess_nats > 0.5 && score.labels_used <= 8.0), "{scores:?}");
        assert!(scores[3].excess_nats > scores[1].excess_nats, "{scores:?}");
        // At most 8 labels are allowed, so that the cut at 8 tells all apart.
        assert_eq!(scores.map(|score| score.v_measure_at_8), [None, None, Some(scores[2].v_measure), None]);
    }

    #[test]
    fn unusable_scenes_are_refused_by_name() {
        let refused = |image: (u32, u32), classes: (u32, u32), class| {
            let classes = GrayImage::from_pixel(classes.0, classes.1, image::Luma([class]));
            let image = RgbImage::new(image.0, image.1);
            AnnotatedScene::new(Trial::default(), &image, &classes, &[255]).map(|_| ()).unwrap_err()
        };
        assert_eq!(refused((1, 1), (1, 1), 0), TrialError::Tiny(1, 1));
        assert_eq!(refused((40, 30), (40, 30), 255), TrialError::NoClasses);
        assert!(matches!(refused((40, 30), (30, 40), 0), TrialError::Annotations(_)));
    }

    #[test]
    fn medians_are_taken_of_each_number() {
        let of = |mutual_information_nats, excess_nats| MeanScore {
            mutual_information_nats,
            excess_nats,
            ..MeanScore::default()
        };
        let median = MeanScore::median(&[of(1.0, 9.0), of(3.0, 7.0), of(8.0, 8.0), of(5.0, 1.0)]);
        assert_eq!((median.mutual_information_nats, median.excess_nats), (4.0, 7.5));
        assert_eq!(MeanScore::median(&[]), MeanScore::default());
    }

    fn speckle(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| {
            let bits = scene_model::random::mix(u64::from(x / 3) << 32 | u64::from(y / 2));
            Rgb([bits as u8, (bits >> 8) as u8 / 2, (bits >> 16) as u8 / 3 + 40])
        })
    }

    #[test]
    fn trained_measures_are_frozen() {
        let images = [(speckle(100, 80), 20.0), (RgbImage::from_pixel(50, 50, Rgb([200, 9, 9])), 20.0)];
        let measures = train_vocabulary(&WordConfig::default(), || images.iter().cloned());
        let mut extractor = WordExtractor::from_measures(measures);
        let first = extractor.extract(&images[0].0, 20.0);
        extractor.extract(&images[1].0, 20.0);
        assert_eq!(extractor.extract(&images[0].0, 20.0), first);
    }
}
