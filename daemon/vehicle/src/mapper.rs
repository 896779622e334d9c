//! The mapper: from camera frames to the label map.

use super::cells::{CellChanges, Cells, LayerScales};
use super::frame::{Frame, Projection};
use super::mosaic::Mosaic;
use super::picker::{Judge, PATCH_PX};
use super::placer::FramePlacer;
use crate::{LabelChanges, MapChanges, MapProducer, SeenCell, SeenFrame, SharedExemplars};
use image::RgbImage;
use scene_model::exemplars::{ExemplarPatch, ExemplarStore};
use scene_model::habitats::{Habitats, LabelTree as HabitatTree, measure};
use scene_model::online::OnlineInference;
use scene_model::project::{DownCamera, Pose};
use scene_model::publish::{LabelBook, PublishedCell};
use scene_model::topics::{Birth, FlatCell, SceneConfig, SceneModel, TopicId};
use scene_model::words::{FlatField, Measures, Word, WordConfig, WordExtractor};
use scenecast_config::{BirthRule, Config, SceneLabels, cell_m};
use scenecast_core::UserError;
use scenecast_protocol::directive::{Change, Registration, Settings, ShortDecimal};
use scenecast_protocol::map::{Cell, LabelTree};
use scenecast_protocol::schedule::BackgroundStream;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Exemplars that are kept of each label.
const EXEMPLARS_KEPT: usize = 4;

/// Smallest and largest edge of a cell in frames whose view gives the size of their pixels, pixels.
const CELL_PX: (f32, f32) = (4.0, 400.0);

/// The tree of the labels that are published.
fn published_tree(habitats: &HabitatTree, book: &LabelBook) -> Option<LabelTree> {
    let mut merges = Vec::new();
    // The label that stands for a habitat and those that have joined it, other than its own.
    let mut standing: BTreeMap<u32, u8> = BTreeMap::new();
    for &(into, joins) in habitats.merges() {
        let label = |habitat: u32| standing.get(&habitat).copied().or_else(|| book.label_of(TopicId(habitat)));
        match (label(into), label(joins)) {
            (Some(into), Some(joins)) => merges.push((into, joins)),
            (None, Some(label)) => _ = standing.insert(into, label),
            (_, None) => {}
        }
    }
    let clearest = habitats.clearest().filter(|&count| count <= merges.len());
    LabelTree::new(merges, clearest.map(|count| count as u8))
}

/// The scene model of one vehicle.
pub struct Mapper {
    pub(super) words: FrameWords,
    camera: DownCamera,
    cell_m: f64,
    pub(super) model: SceneModel,
    pub(super) online: OnlineInference,
    /// `None` if the labels are topics.
    pub(super) habitats: Option<Habitats>,
    pub(super) book: LabelBook,
    pub(super) exemplars: Exemplars,
    /// `None` if the configuration sends no image of the sea floor.
    mosaic: Option<Mosaic>,
    pub(super) cells: Cells,
    pub(super) placer: FramePlacer,
    scales: LayerScales,
    tuning: Tuning,
    pub(super) last_s: Option<f64>,
    pub(super) flat: Vec<FlatCell>,
}

/// The visual words of frames.
pub(super) struct FrameWords {
    pub(super) extractor: WordExtractor,
    /// The unevenness of the light in the frames; `None` if frames are mapped as they are.
    pub(super) light: Option<FlatField>,
}

impl FrameWords {
    /// The words of a frame, and the frame under even light.
    fn extract<'a>(&mut self, image: &'a RgbImage, cell_px: f32) -> (Vec<Word>, Cow<'a, RgbImage>) {
        let even = match &mut self.light {
            Some(light) => {
                light.learn(image);
                Cow::Owned(light.corrected(image))
            }
            None => Cow::Borrowed(image),
        };
        (self.extractor.extract(&even, cell_px), even)
    }
}

/// How much the model works, and the configured values that the operator's settings override.
struct Tuning {
    refine_words_per_s: f64,
    /// Maximum rate of camera frames, 1/s; `None`: every frame.
    frames_per_s: Option<f64>,
    configured: Configured,
}

/// The configured values of the settings: alpha, beta and gamma; others as [`Tuning`] has them; the most labels.
struct Configured {
    priors: [f64; 3],
    refine_words_per_s: f64,
    frames_per_s: Option<f64>,
    labels: u32,
}

impl Tuning {
    fn new(config: &Config) -> Self {
        let scene = &config.scene;
        let refine_words_per_s = f64::from(scene.refine_words_per_s);
        // 0 stands for every frame.
        let frames_per_s = (scene.frames_per_s > 0.0).then_some(scene.frames_per_s);
        let priors = [scene.alpha, scene.beta, scene.gamma];
        let configured = Configured { priors, refine_words_per_s, frames_per_s, labels: scene.max_labels };
        Self { refine_words_per_s, frames_per_s, configured }
    }

    /// Takes the rates of the settings; returns their priors and the most labels.
    fn tune(&mut self, settings: &Settings) -> ([f64; 3], u32) {
        let or = |change: Change<ShortDecimal>, configured: f64| change.value().map_or(configured, ShortDecimal::value);
        let Configured { priors: [alpha, beta, gamma], refine_words_per_s, frames_per_s, labels } = self.configured;
        self.refine_words_per_s = or(settings.refine_words_per_s, refine_words_per_s);
        self.frames_per_s = settings.frames_per_s.value().map(ShortDecimal::value).or(frames_per_s);
        let priors = [or(settings.alpha, alpha), or(settings.beta, beta), or(settings.gamma, gamma)];
        (priors, settings.labels.value().map_or(labels, u32::from))
    }

    /// Whether a frame at `t_s` is mapped after one at `last_s`. Each interval of the frame rate takes its first frame.
    fn takes(&self, last_s: Option<f64>, t_s: f64) -> bool {
        let Some(rate) = self.frames_per_s else { return true };
        let interval = |t_s: f64| (t_s * rate + 1e-6).floor();
        last_s.is_none_or(|last_s| interval(last_s) != interval(t_s))
    }

    /// Words to sample again after this many seconds.
    fn words_to_refine(&self, passed_s: f64) -> u64 {
        (self.refine_words_per_s * passed_s.clamp(0.0, 60.0)) as u64
    }
}

/// The best patches of the labels, and the map of them that was given out last.
pub(super) struct Exemplars {
    pub(super) store: ExemplarStore,
    shared: SharedExemplars,
}

impl Exemplars {
    fn new(metres_per_pixel: f64) -> Self {
        let store = ExemplarStore::new(EXEMPLARS_KEPT, PATCH_PX).with_distance(f64::from(PATCH_PX) * metres_per_pixel);
        Self { store, shared: SharedExemplars::default() }
    }

    fn of_label(&self, label: u8, book: &LabelBook) -> &[ExemplarPatch] {
        book.topic_of(label).map_or(&[], |topic| self.store.all(topic))
    }

    fn share(&mut self, book: &LabelBook) -> SharedExemplars {
        let now = || book.labels().map(|l| (l, self.of_label(l, book))).filter(|(_, patches)| !patches.is_empty());
        let is_same = |a: &[ExemplarPatch], b: &[ExemplarPatch]| {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| Arc::ptr_eq(&a.patch, &b.patch))
        };
        let is_current = now().count() == self.shared.len()
            && now().zip(self.shared.iter()).all(|((l, patches), (k, last))| l == *k && is_same(patches, last));
        if !is_current {
            self.shared = Arc::new(now().map(|(label, patches)| (label, patches.to_vec())).collect());
        }
        self.shared.clone()
    }
}

impl Mapper {
    /// An empty mapper. Its labels belong to `epoch`.
    pub fn new(config: &Config, vocabulary: Option<Measures>, epoch: u8, seed: u64) -> Result<Self, UserError> {
        let extractor =
            vocabulary.map_or_else(|| WordExtractor::new(&WordConfig::default()), WordExtractor::from_measures);
        let cell_m = cell_m(config);
        let birth = match config.scene.birth {
            BirthRule::Literal => Birth::Literal,
            BirthRule::Collapsed => Birth::Collapsed,
            BirthRule::Rost => Birth::Rost,
        };
        let scene = SceneConfig {
            cell_m: [cell_m, cell_m, 1e4],
            alpha: config.scene.alpha,
            beta: config.scene.beta,
            gamma: config.scene.gamma,
            birth,
            max_labels: config.scene.max_labels,
            vocabulary: extractor.vocabulary_size(),
            max_words_per_cell: config.scene.max_words_per_cell,
            seed,
            ..SceneConfig::for_images()
        };
        Ok(Self {
            words: FrameWords { extractor, light: config.camera.flat_field.then(FlatField::default) },
            camera: DownCamera {
                metres_per_pixel: config.camera.metres_per_pixel,
                altitude_m: config.survey.altitude_m,
            },
            cell_m,
            model: SceneModel::new(scene).map_err(|e| UserError::Input(format!("scene.{e}")))?,
            online: OnlineInference::default(),
            habitats: (config.scene.labels == SceneLabels::Habitats).then(|| Habitats::new(config.scene.max_labels)),
            book: LabelBook::new(epoch),
            exemplars: Exemplars::new(config.camera.metres_per_pixel),
            mosaic: config.link.background.has(BackgroundStream::Floor).then(Mosaic::default),
            cells: Cells::default(),
            placer: FramePlacer::new(config),
            scales: LayerScales::new(config),
            tuning: Tuning::new(config),
            last_s: None,
            flat: Vec::new(),
        })
    }

    /// Puts settings in force that were checked; those without a value are as configured. Labels keep their meaning.
    pub fn tune(&mut self, settings: &Settings) {
        let ([alpha, beta, gamma], labels) = self.tuning.tune(settings);
        if let Err(e) = self.model.set_priors(alpha, beta, gamma) {
            // The range of the settings lies within the range of the model.
            tracing::error!("the scene model keeps its priors: {e}");
        }
        if let Some(habitats) = &mut self.habitats {
            habitats.limit(labels);
        }
        self.placer.switch(settings.registration.value().map(|choice| choice == Registration::On));
    }

    /// Whether the frame of mission time `t_s` is to be mapped. Each interval of the frame rate takes its first frame.
    pub fn takes(&self, t_s: f64) -> bool {
        self.tuning.takes(self.last_s, t_s)
    }

    /// The priors in force: alpha, beta, gamma.
    pub fn priors(&self) -> [f64; 3] {
        let config = self.model.config();
        [config.alpha, config.beta, config.gamma]
    }

    /// Maps a frame of mission time `t_s`, and refines the model in proportion to the time since the last frame.
    pub fn handle_frame(&mut self, frame: &Frame<'_>, t_s: f64) -> MapChanges {
        let Frame { image, pose, .. } = *frame;
        let projection = Projection::of(frame, &self.camera);
        let mut cell_px = (self.cell_m / projection.metres_per_pixel()) as f32;
        if frame.view.is_some() {
            cell_px = cell_px.clamp(CELL_PX.0, CELL_PX.1);
        }
        let (words, even) = self.words.extract(image, cell_px);
        let (size, cell_m) = (image.dimensions(), self.cell_m);
        if let Some(mosaic) = &mut self.mosaic {
            mosaic.add(&even, |words| projection.project(size, &pose, words), cell_m, t_s);
        }
        let observations = projection.project(image.dimensions(), &pose, &words);
        self.online.expect(observations.len(), &mut self.model);
        self.model.insert(t_s, &observations);
        for seen in &observations {
            let cell = Cell::new(self.cell(seen.x), self.cell(seen.y));
            self.cells.see(cell, -seen.z, t_s);
        }
        let passed = t_s - self.last_s.replace(t_s).unwrap_or(t_s - 2.0);
        self.model.refine(self.tuning.words_to_refine(passed));
        self.flat = self.online.learn(t_s, &self.model);
        self.add_habitats(image, &projection, &pose, cell_px);
        let metres_per_pixel = projection.metres_per_pixel();
        let judge = Judge { flat: &self.flat, cell_m, metres_per_pixel };
        judge.review(&mut self.exemplars.store);
        let place = |u: f32, v: f32| {
            let centre = [Word { id: 0, u, v }];
            projection.project(image.dimensions(), &pose, &centre).first().map(|seen| (seen.x, seen.y))
        };
        judge.offer(&mut self.exemplars.store, image, place, t_s);
        self.publish(t_s, pose)
    }

    /// Adds a frame to the habitats, if the labels are habitats, and labels the map by them.
    fn add_habitats(&mut self, image: &RgbImage, projection: &Projection, pose: &Pose, cell_px: f32) {
        let Some(habitats) = &mut self.habitats else { return };
        let points = measure(image, cell_px);
        let places = projection.project(image.dimensions(), pose, &Habitats::as_words(&points));
        habitats.add(image.dimensions(), &points, &places, self.cell_m);
        if habitats.update() {
            tracing::debug!("the map has hardly grown for a while: its labels are corrected");
        }
        self.flat = habitats.labelled(&self.flat);
    }

    /// Publishes the model's map, and returns what the frame of mission time `t_s` has changed of it.
    fn publish(&mut self, t_s: f64, camera: Pose) -> MapChanges {
        let epoch = self.book.epoch();
        let published = self.book.publish(&self.flat);
        if self.book.epoch() != epoch {
            self.cells.clear_map();
        }
        let changes = self.cells.take(&published, t_s, &self.scales);
        let cells = changes.labels.iter().map(|shown| (Cell::new(shown.x, shown.y), shown.label)).collect();
        let frame = Some(self.seen_frame(&changes, t_s, camera));
        let settled = self.mosaic.as_mut().map(|mosaic| mosaic.poll_settled(self.cell_m, t_s));
        let floor = settled.unwrap_or_default();
        MapChanges { labels: Some(self.labelled(cells)), frame, floor, ..changes.into() }
    }

    fn seen_frame(&self, changes: &CellChanges<'_>, t_s: f64, camera: Pose) -> SeenFrame {
        let cell = |shown: &&PublishedCell| {
            let at = self.flat.binary_search_by_key(&(shown.y, shown.x), |cell| (cell.y, cell.x)).ok()?;
            let words = self.flat.get(at)?.words;
            Some(SeenCell { cell: Cell::new(shown.x, shown.y), words, confidence: shown.confidence })
        };
        SeenFrame { t_s, camera, cells: changes.labels.iter().filter_map(cell).collect() }
    }

    fn labelled(&self, cells: Vec<(Cell, u8)>) -> LabelChanges {
        let tree = self.habitats.as_ref().and_then(|habitats| published_tree(habitats.tree(), &self.book));
        LabelChanges { epoch: self.book.epoch(), highest: self.book.labels().count() as u8, cells, tree }
    }

    /// The whole map after the last frame, as changes of an empty one.
    pub fn current(&self) -> MapChanges {
        let (cells, layers) = self.cells.all();
        MapChanges { labels: Some(self.labelled(cells)), ..layers }
    }

    /// The changes of a frame that is not mapped: none.
    pub fn unchanged(&self) -> MapChanges {
        MapChanges { labels: Some(self.labelled(Vec::new())), ..MapChanges::default() }
    }

    /// Puts the map of the last frame on the cells, after a restart.
    pub(super) fn restore_map(&mut self) {
        self.flat = self.online.map(&self.model);
        if let Some(habitats) = &self.habitats {
            self.flat = habitats.labelled(&self.flat);
        }
        self.cells.restore(&self.book.published(&self.flat));
    }

    /// The configured size of a pixel on the sea floor, metres.
    pub(super) fn metres_per_pixel(&self) -> f64 {
        self.camera.metres_per_pixel
    }

    fn cell(&self, metres: f64) -> i32 {
        (metres / self.cell_m).floor() as i32
    }

    /// The best exemplars of a label, the best first.
    pub fn exemplars(&self, label: u8) -> &[ExemplarPatch] {
        self.exemplars.of_label(label, &self.book)
    }

    /// The best exemplars of all labels. The same map is given out until an exemplar comes, goes or changes its rank;
    /// scores are as they were then.
    pub fn shared_exemplars(&mut self) -> SharedExemplars {
        self.exemplars.share(&self.book)
    }

    pub fn cells(&self) -> usize {
        self.model.cells()
    }

    pub fn words(&self) -> u64 {
        self.model.words()
    }

    /// The scene model that labels the frames.
    pub fn model(&self) -> &SceneModel {
        &self.model
    }

    /// Perplexity of all words under the model.
    pub fn perplexity(&self) -> f64 {
        self.model.perplexity()
    }
}

impl MapProducer for Mapper {
    fn epoch(&self) -> u8 {
        self.book.epoch()
    }

    fn last_s(&self) -> Option<f64> {
        self.last_s
    }

    fn resume(&mut self, epoch: u8, published: u8) {
        if self.book.epoch() == epoch {
            self.book.resume(published);
        } else {
            self.book.begin_epoch(epoch);
            self.cells.clear_map();
        }
    }

    fn save(&self, lineage: u64) -> Vec<u8> {
        self.encode(lineage)
    }
}
