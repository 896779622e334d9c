//! The label maps of the planning bench.

use crate::world::World;
use image::RgbImage;
use scene_model::project::{DownCamera, Pose};
use scene_model::publish::LabelBook;
use scene_model::topics::{Birth, SceneConfig, SceneModel};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_config::Config;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_protocol::directive::Utility;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_worlds::Reef;
use std::collections::BTreeMap;
use std::path::Path;

/// Edge of a cell, metres; a scene is about a hundred cells wide.
pub(crate) const CELL_M: f64 = 0.25;
const CELLS: f64 = 100.0;
/// Pixels of a cell in a drawn scene.
const DRAWN_PX: u32 = 10;
/// Number of sweeps over all words.
const SWEEPS: u64 = 25;
pub(crate) const EXPLORATION: i8 = 5;
/// Minimum share of the annotated cells for the class that the operator favours.
pub(crate) const MIN_SHARE: f64 = 0.05;

/// A label map of the scene model, and the operator's utility on it.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    pub name: String,
    /// Bounds of the scene, metres; the south-west corner is the origin.
    pub labels: LabelGrid,
    pub area: Area,
    pub utility: Utility,
}

impl Scene {
    pub fn from_files(image: &Path, annotations: &Path, seed: u64) -> Result<Self, UserError> {
        let rgb = image::open(image).map_err(|e| UserError::file(image, e))?.to_rgb8();
        let px = (f64::from(rgb.width()) / CELLS).floor().max(4.0);
        let world = World::from_files(image, Some(annotations), CELL_M / px)?;
        let name = image.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Self::new(name, &rgb, px, &world, seed))
    }

    /// Drawn patches of 125 x 100 cells.
    pub fn patches(seed: u64) -> Self {
        Self::draw_patches(seed, 1250, 1000)
    }

    /// Drawn patches of 50 x 40 cells.
    #[cfg(test)]
    pub fn small(seed: u64) -> Self {
        Self::draw_patches(seed, 500, 400)
    }

    fn draw_patches(seed: u64, width: u32, height: u32) -> Self {
        let patches = scenecast_worlds::patches(seed, width, height, 3 * DRAWN_PX, 8);
        let image = patches.image.clone();
        let world = World::from_patches(patches, CELL_M / f64::from(DRAWN_PX));
        Self::new("patches".to_owned(), &image, f64::from(DRAWN_PX), &world, seed)
    }

    /// The survey area of a drawn reef, 120 x 100 cells.
    pub fn reef(seed: u64) -> Self {
        let reef = Reef::new(seed);
        let [west, south, east, north] = Reef::SURVEY_M;
        let (pitch, cells) = (CELL_M / f64::from(DRAWN_PX), |metres: f64| (metres / CELL_M).round() as u32);
        let (columns, rows) = (cells(east - west), cells(north - south));
        let image = reef.picture(west, south, columns * DRAWN_PX, rows * DRAWN_PX, pitch);
        let class = |cell: Cell| {
            let (x, y) = (west + f64::from(cell.x) * CELL_M, south + f64::from(cell.y) * CELL_M);
            Some(reef.class_of_square(x, y, CELL_M))
        };
        Self::labelled("reef".to_owned(), &image, f64::from(DRAWN_PX), class, seed)
    }

    fn new(name: String, image: &RgbImage, px: f64, world: &World, seed: u64) -> Self {
        Self::labelled(name, image, px, |cell| world.class_of(cell, CELL_M), seed)
    }

    fn labelled(name: String, image: &RgbImage, px: f64, class_of: impl Fn(Cell) -> Option<u8>, seed: u64) -> Self {
        let labels = label(image, px, seed);
        let cells = |n: u32| (f64::from(n) / px).floor() * CELL_M;
        let area = Area { west: 0.0, south: 0.0, east: cells(image.width()), north: cells(image.height()) };
        let utility = favour(&labels, class_of);
        Self { name, labels, area, utility }
    }
}

/// The labels of a whole image that is seen at once.
fn label(image: &RgbImage, px: f64, seed: u64) -> LabelGrid {
    let (words, scene) = (WordConfig::default(), Config::default().scene);
    let camera = DownCamera { metres_per_pixel: CELL_M / px, altitude_m: 4.0 };
    let (w, h) = image.dimensions();
    let middle = |n: u32| f64::from(n) / 2.0 * camera.metres_per_pixel;
    let pose = Pose { x: middle(w), y: middle(h), z: -4.0, yaw_rad: 0.0 };
    let seen = camera.project(w, h, &pose, &WordExtractor::new(&words).extract(image, px as f32));
    let config = SceneConfig {
        cell_m: [CELL_M, CELL_M, 1e4],
        alpha: scene.alpha,
        beta: scene.beta,
        gamma: scene.gamma,
        birth: Birth::Literal,
        max_labels: 16,
        vocabulary: words.vocabulary_size(),
        max_words_per_cell: scene.max_words_per_cell,
        seed,
        ..SceneConfig::for_images()
    };
    let Ok(mut model) = SceneModel::new(config) else { return LabelGrid::default() };
    model.insert(0.0, &seen);
    model.refine(seen.len() as u64 * SWEEPS);
    let flat = model.label_map();
    let mut book = LabelBook::new(0);
    // A topic gets a label when it has lasted for two maps.
    book.publish(&flat);
    book.publish(&flat).iter().map(|c| (Cell::new(c.x, c.y), c.label)).collect()
}

/// The utility of an operator who looks for the rarest class that covers at least a twentieth of the scene.
/// The weight of a label grows with the share of that class in it: 1 for the best label, 0 at or below the
/// share in the whole scene.
fn favour(labels: &LabelGrid, class_of: impl Fn(Cell) -> Option<u8>) -> Utility {
    let mut counts: BTreeMap<u8, BTreeMap<u8, f64>> = BTreeMap::new();
    let mut classes: BTreeMap<u8, f64> = BTreeMap::new();
    for (cell, label) in labels.iter() {
        let Some(class) = class_of(cell) else { continue };
        *classes.entry(class).or_default() += 1.0;
        *counts.entry(label).or_default().entry(class).or_default() += 1.0;
    }
    let cells: f64 = classes.values().sum();
    let common = classes.iter().filter(|(_, n)| **n >= MIN_SHARE * cells);
    let Some((&favoured, &n)) = common.min_by(|a, b| a.1.total_cmp(b.1)) else { return Utility::default() };
    let share = |of: &BTreeMap<u8, f64>| of.get(&favoured).unwrap_or(&0.0) / of.values().sum::<f64>();
    let best = counts.values().map(share).fold(0.0, f64::max).max(1e-9);
    let weights = counts.iter().filter(|(_, of)| share(of) > n / cells);
    let weights = weights.map(|(&label, of)| (label, (100.0 * share(of) / best).round() as i8)).collect();
    Utility { exploration: EXPLORATION, weights, ..Utility::default() }
}
