//! A scene from a file of labels.

use super::scene::{CELL_M, EXPLORATION, MIN_SHARE, Scene};
use scenecast_core::{Area, UserError};
use scenecast_protocol::directive::Utility;
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::map_codec::LabelRaster;
use std::collections::BTreeMap;
use std::path::Path;

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

    fn from_raster(name: String, raster: &LabelRaster) -> Result<Self, String> {
        let pixels = raster.width.max(raster.height).div_ceil(MAX_CELLS).max(1);
        let (columns, rows) = (raster.width / pixels, raster.height / pixels);
        if columns.min(rows) < MIN_CELLS {
            let (width, height) = (raster.width, raster.height);
            return Err(format!(
                "{width} x {height} pixels: the shorter side must be a fifth of the longer, and {MIN_CELLS}"
            ));
        }
        let Some(bare) = (1..=254).find(|label| !raster.labels.contains(label)) else {
            return Err("it has 254 labels: at most 253 can be used".to_owned());
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
        let favoured = favoured(&cells, bare).ok_or("it has no label, only the value 0")?;
        let area = Area { west: 0.0, south: 0.0, east: columns as f64 * CELL_M, north: rows as f64 * CELL_M };
        let utility = Utility { exploration: EXPLORATION, weights: [(favoured, 100)].into(), ..Utility::default() };
        Ok(Self { name, labels, area, utility })
    }
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
        let refused = |raster| Scene::from_raster(String::new(), &raster).unwrap_err();
        assert!(refused(LabelRaster::uniform(200, 30, 1)).starts_with("200 x 30 pixels"), "a cell has 2 x 2 pixels");
        assert!(refused(LabelRaster::uniform(60, 60, 0)).starts_with("it has no label"));
    }
}
