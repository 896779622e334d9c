//! The sea floor of a rehearsal.

use crate::mosaic::Mosaic;
use image::{Rgb, RgbImage};
use scenecast_config::{Config, WorldKind};
use scenecast_core::{Area, UserError};
use scenecast_protocol::map::Cell;
use scenecast_worlds::{Reef, ReefCamera, View};
use std::path::Path;

/// Metres that a picture shows around the survey of a reef.
const MARGIN_M: f64 = 3.0;

/// An image of the sea floor, or a reef that is drawn where the camera looks. The south-west corner is the origin.
#[derive(Debug, Clone)]
pub struct World(Floor);

#[derive(Debug, Clone)]
enum Floor {
    Mosaic(Mosaic),
    Reef(Box<ReefCamera>),
}

impl World {
    /// The sea floor of `world.kind`.
    pub fn procedural(config: &Config, seed: u64) -> Self {
        let metres_per_pixel = config.camera.metres_per_pixel;
        match config.world.kind {
            WorldKind::Reef => Self::reef(seed, metres_per_pixel),
            WorldKind::Patches => Self::patches(seed, metres_per_pixel),
        }
    }

    /// A reef of 120 x 80 m, seen by a camera with pixels of the given size.
    pub fn reef(seed: u64, metres_per_pixel: f64) -> Self {
        Self(Floor::Reef(Box::new(ReefCamera::new(Reef::new(seed), metres_per_pixel))))
    }

    /// Patches of about 26 x 18 m in all, drawn from the scene model's own generative process.
    pub fn patches(seed: u64, metres_per_pixel: f64) -> Self {
        Self::from_patches(scenecast_worlds::patches(seed, 2600, 1800, 25, 8), metres_per_pixel)
    }

    /// A world of patches that was drawn before.
    pub(crate) fn from_patches(world: scenecast_worlds::Patches, metres_per_pixel: f64) -> Self {
        Self(Floor::Mosaic(Mosaic::new(world.image, metres_per_pixel, Some(world.truth))))
    }

    /// Reads a mosaic, and its annotation from a file of the same size.
    pub fn from_files(mosaic: &Path, annotations: Option<&Path>, metres_per_pixel: f64) -> Result<Self, UserError> {
        Ok(Self(Floor::Mosaic(Mosaic::from_files(mosaic, annotations, metres_per_pixel)?)))
    }

    /// The bounds of the sea floor, metres.
    pub fn area(&self) -> Area {
        match &self.0 {
            Floor::Mosaic(mosaic) => mosaic.area(),
            Floor::Reef(_) => {
                let [east, north] = Reef::SIZE_M;
                Area { west: 0.0, south: 0.0, east, north }
            }
        }
    }

    /// The area of a survey that has no configured one: a mosaic as a whole, or the middle of a reef.
    pub fn survey_area(&self) -> Area {
        match &self.0 {
            Floor::Mosaic(mosaic) => mosaic.area(),
            Floor::Reef(_) => {
                let [west, south, east, north] = Reef::SURVEY_M;
                Area { west, south, east, north }
            }
        }
    }

    /// The part of the world around a surveyed area that pictures of a mission show, metres.
    pub(crate) fn pictured_area(&self, surveyed: &Area) -> Area {
        match &self.0 {
            Floor::Mosaic(mosaic) => mosaic.area(),
            Floor::Reef(_) => Area {
                west: surveyed.west - MARGIN_M,
                south: surveyed.south - MARGIN_M,
                east: surveyed.east + MARGIN_M,
                north: surveyed.north + MARGIN_M,
            },
        }
    }

    /// Whether the world has known classes.
    pub fn is_annotated(&self) -> bool {
        match &self.0 {
            Floor::Mosaic(mosaic) => mosaic.is_annotated(),
            Floor::Reef(_) => true,
        }
    }

    /// The name of a class.
    pub fn class_name(&self, class: u8) -> String {
        let name = match &self.0 {
            Floor::Mosaic(_) => None,
            Floor::Reef(_) => Reef::class_names().get(usize::from(class)),
        };
        name.map_or_else(|| format!("class {class}"), |&name| name.to_owned())
    }

    /// Depth of the sea floor where it is `nominal_m` on the whole, metres.
    pub fn depth_m(&self, nominal_m: f64, x_m: f64, y_m: f64) -> f64 {
        match &self.0 {
            Floor::Mosaic(_) => nominal_m,
            Floor::Reef(camera) => (nominal_m - camera.reef().relief_m(x_m, y_m)).max(0.0),
        }
    }

    /// The sea floor from above in pixels of a given size, from a north-west corner; black outside of a mosaic.
    pub(crate) fn picture(&self, area: &Area, columns: u32, rows: u32, metres_per_pixel: f64) -> Vec<Option<Rgb<u8>>> {
        let place = |i: u32| {
            let (column, row) = (f64::from(i % columns), f64::from(i / columns));
            (area.west + (column + 0.5) * metres_per_pixel, area.north - (row + 0.5) * metres_per_pixel)
        };
        match &self.0 {
            Floor::Mosaic(mosaic) => (0..columns * rows)
                .map(|i| {
                    let (x, y) = place(i);
                    mosaic.colour_at(x, y).map(Rgb)
                })
                .collect(),
            Floor::Reef(camera) => {
                let south = area.north - f64::from(rows) * metres_per_pixel;
                let image = camera.reef().picture(area.west, south, columns, rows, metres_per_pixel);
                image.pixels().copied().map(Some).collect()
            }
        }
    }

    /// The view of a down-looking camera. A mosaic is mirrored beyond its bounds and seen as it is; a reef is seen
    /// through water.
    pub fn view(&mut self, view: &View) -> RgbImage {
        match &mut self.0 {
            Floor::Mosaic(mosaic) => mosaic.view(view.x_m, view.y_m, view.heading_rad, view.width_px, view.height_px),
            Floor::Reef(camera) => camera.frame(view),
        }
    }

    /// The class of most annotated pixels of a cell; `None` outside the world or the annotated parts.
    pub fn class_of(&self, cell: Cell, cell_m: f64) -> Option<u8> {
        match &self.0 {
            Floor::Mosaic(mosaic) => mosaic.class_of(cell, cell_m),
            Floor::Reef(camera) => {
                let (west, south) = (f64::from(cell.x) * cell_m, f64::from(cell.y) * cell_m);
                let [east, north] = Reef::SIZE_M;
                let inside = west >= 0.0 && south >= 0.0 && west + cell_m <= east && south + cell_m <= north;
                inside.then(|| camera.reef().class_of_square(west, south, cell_m))
            }
        }
    }
}
