//! The label maps of the planning bench: drawn, or from a file of labels.

use crate::world::World;
use image::RgbImage;
use scene_model::project::{DownCamera, Pose};
use scene_model::publish::LabelBook;
use scene_model::topics::{Birth, SceneConfig, SceneModel};
use scene_model::words::{WordConfig, WordExtractor};
use scenecast_config::Config;
use scenecast_core::{Area, UserError};
use scenecast_protocol::directive::Utility;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::LabelRaster;
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

/// The cells of the longer side; a file with more pixels is made coarser.
const MAX_CELLS: usize = 125;
/// The shorter side has at least these cells: the camera sees eight of them at once.
const MIN_CELLS: usize = 24;

impl Scene {
    /// Reads an indexed PNG: pixel value = label. The value 0 stands for the sea floor without a label. The operator
    /// favours the rarest label that covers at least a twentieth of the map, or else the most common one.
    pub fn from_label_map(path: &Path) -> Result<Self, UserError> {
        let bytes = scenecast_config::read_regular(path, 1 << 30)?;
        let raster = LabelRaster::from_png(&bytes).map_err(|e| UserError::file(path, e))?;
        let name = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        Self::from_raster(name, &raster).map_err(|fault| UserError::file(path, fault))
    }

    fn from_raster(name: String, raster: &LabelRaster) -> Result<Self, RasterFault> {
        let pixels = raster.width.max(raster.height).div_ceil(MAX_CELLS).max(1);
        let (columns, rows) = (raster.width / pixels, raster.height / pixels);
        if columns.min(rows) < MIN_CELLS {
            return Err(RasterFault::Small { width: raster.width, height: raster.height });
        }
        let Some(bare) = (1..=254).find(|label| !raster.labels.contains(label)) else {
            return Err(RasterFault::Full);
        };
        let mut labels = LabelGrid::default();
        let mut cells: BTreeMap<u8, usize> = BTreeMap::new();
        for (y, x) in (0..rows).flat_map(|y| (0..columns).map(move |x| (y, x))) {
            let label = match most_common(raster, (x * pixels, y * pixels), pixels) {
                0 => bare,
                label => label,
            };
            *cells.entry(label).or_default() += 1;
            labels.set(Cell::new(x as i32, y as i32), label);
        }
        let favoured = favoured(&cells, bare).ok_or(RasterFault::Empty)?;
        let area = Area { west: 0.0, south: 0.0, east: columns as f64 * CELL_M, north: rows as f64 * CELL_M };
        let utility = Utility { exploration: EXPLORATION, weights: [(favoured, 100)].into(), ..Utility::default() };
        Ok(Self { name, labels, area, utility })
    }
}

/// Why a label map is no scene for a planner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
enum RasterFault {
    #[error("{width} x {height} pixels: the shorter side must be a fifth of the longer, and {MIN_CELLS}")]
    Small { width: usize, height: usize },
    #[error("it has 254 labels: at most 253 can be used")]
    Full,
    #[error("it has no label, only the value 0")]
    Empty,
}

/// The most common label of a square of pixels, the lower one of two equally common ones.
fn most_common(raster: &LabelRaster, (left, low): (usize, usize), pixels: usize) -> u8 {
    let mut counts = [0usize; 256];
    for row in low..low + pixels {
        let first = row * raster.width + left;
        raster.labels[first..first + pixels].iter().for_each(|&label| counts[usize::from(label)] += 1);
    }
    (0..=255).rev().max_by_key(|&label: &u8| counts[usize::from(label)]).unwrap_or(0)
}

fn favoured(cells: &BTreeMap<u8, usize>, bare: u8) -> Option<u8> {
    let all: usize = cells.values().sum();
    let labels = || cells.iter().filter(|(label, _)| **label != bare);
    let common = labels().filter(|(_, n)| **n as f64 >= MIN_SHARE * all as f64).min_by_key(|(_, n)| **n);
    common.or_else(|| labels().max_by_key(|(_, n)| **n)).map(|(&label, _)| label)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 250 x 120 pixels: label 9 in the lower half, 4 in the upper one, and 7 in a corner of 20 x 60.
    fn raster() -> LabelRaster {
        let label = |x: usize, y: usize| match (x, y) {
            (..20, ..60) => 7,
            (_, ..60) => 9,
            (_, 119) => 0,
            _ => 4,
        };
        let labels = (0..120).flat_map(|y| (0..250).map(move |x| label(x, y))).collect();
        LabelRaster { width: 250, height: 120, labels }
    }

    #[test]
    fn a_label_map_becomes_a_scene_of_at_most_125_cells() {
        let scene = Scene::from_raster("reef".to_owned(), &raster()).unwrap();
        assert_eq!((scene.area.east, scene.area.north), (125.0 * CELL_M, 60.0 * CELL_M));
        assert_eq!(scene.labels.get(Cell::new(0, 0)), 7);
        assert_eq!((scene.labels.get(Cell::new(124, 29)), scene.labels.get(Cell::new(124, 30))), (9, 4));
        assert_eq!(scene.utility.weights, [(9, 100)].into(), "7 covers less than a twentieth, and 4 more than 9");
    }

    #[test]
    fn maps_that_are_no_scene_are_refused() {
        let refused = |raster| Scene::from_raster(String::new(), &raster).unwrap_err().to_string();
        assert!(refused(LabelRaster::uniform(200, 30, 1)).starts_with("200 x 30 pixels"), "a cell has 2 x 2 pixels");
        assert!(refused(LabelRaster::uniform(60, 60, 0)).starts_with("it has no label"));
    }
}
