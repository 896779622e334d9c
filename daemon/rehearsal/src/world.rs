//! The sea floor of a rehearsal: drawn, an image or a recording, and its true classes.

use image::{Rgb, RgbImage};
use scenecast_config::{Config, WorldKind};
use scenecast_core::{Area, UserError, label_picture};
use scenecast_files::{read_classes, read_image};
use scenecast_protocol::map::{Cell, LabelGrid, Rect};
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

/// An image of the sea floor with its south-west corner at the origin, and the classes of its pixels if they are known.
#[derive(Debug, Clone)]
pub(crate) struct Mosaic {
    image: RgbImage,
    metres_per_pixel: f64,
    classes: Option<Vec<u8>>,
}

/// Class value for "not annotated".
const IGNORE: u8 = 255;

impl Mosaic {
    pub fn new(image: RgbImage, metres_per_pixel: f64, classes: Option<Vec<u8>>) -> Self {
        Self { image, metres_per_pixel, classes }
    }

    /// Reads a mosaic, and its annotation from a file of the same size.
    pub fn from_files(mosaic: &Path, annotations: Option<&Path>, metres_per_pixel: f64) -> Result<Self, UserError> {
        let image = read_image(mosaic)?.to_rgb8();
        if image.width() < 64 || image.height() < 64 {
            let (w, h) = image.dimensions();
            return Err(UserError::file(
                mosaic,
                format!("the image has {w} x {h} pixels; a mosaic needs at least 64 x 64"),
            ));
        }
        let classes = annotations.map(|path| read_classes(path, image.dimensions())).transpose()?;
        Ok(Self { image, metres_per_pixel, classes })
    }

    /// The bounds of the image, metres.
    pub fn area(&self) -> Area {
        let (w, h) = self.image.dimensions();
        let mpp = self.metres_per_pixel;
        Area { west: 0.0, south: 0.0, east: f64::from(w) * mpp, north: f64::from(h) * mpp }
    }

    /// Whether the world has annotated classes.
    pub fn is_annotated(&self) -> bool {
        self.classes.is_some()
    }

    /// The colour of the sea floor at a position in metres; `None` outside the image.
    pub fn colour_at(&self, x_m: f64, y_m: f64) -> Option<[u8; 3]> {
        let (column, line) =
            (x_m / self.metres_per_pixel, f64::from(self.image.height()) - y_m / self.metres_per_pixel);
        let inside = column >= 0.0 && line >= 0.0;
        inside.then(|| self.image.get_pixel_checked(column as u32, line as u32)).flatten().map(|p| p.0)
    }

    /// The view of a down-looking camera at a position (metres) and heading (radians clockwise from north). The image
    /// is mirrored beyond its bounds.
    pub fn view(&self, x_m: f64, y_m: f64, heading_rad: f64, width: u32, height: u32) -> RgbImage {
        let (w, h) = self.image.dimensions();
        let (sin, cos) = heading_rad.sin_cos();
        let (cx, cy) = (x_m / self.metres_per_pixel, f64::from(h) - y_m / self.metres_per_pixel);
        let mut view = RgbImage::new(width, height);
        for (v, row) in view.rows_mut().enumerate() {
            let back = v as f64 + 0.5 - f64::from(height) / 2.0;
            for (u, pixel) in row.enumerate() {
                let right = u as f64 + 0.5 - f64::from(width) / 2.0;
                let column = cx + cos * right - sin * back;
                let line = cy + sin * right + cos * back;
                *pixel = *self.image.get_pixel(mirror(column, w), mirror(line, h));
            }
        }
        view
    }

    /// The class of most annotated pixels of a cell; `None` outside the image or the annotated parts.
    pub fn class_of(&self, cell: Cell, cell_m: f64) -> Option<u8> {
        let classes = self.classes.as_ref()?;
        let (w, h) = (self.image.width() as i64, self.image.height() as i64);
        let px = cell_m / self.metres_per_pixel;
        let column = |c: i32| (f64::from(c) * px).round() as i64;
        let mut counts = [0u32; 256];
        for x in column(cell.x).max(0)..column(cell.x.saturating_add(1)).min(w) {
            for y in column(cell.y).max(0)..column(cell.y.saturating_add(1)).min(h) {
                counts[usize::from(classes[((h - 1 - y) * w + x) as usize])] += 1;
            }
        }
        counts[usize::from(IGNORE)] = 0;
        let (class, &n) = counts.iter().enumerate().rev().max_by_key(|(_, n)| **n)?;
        (n > 0).then_some(class as u8)
    }
}

fn mirror(at: f64, size: u32) -> u32 {
    let period = 2 * i64::from(size);
    let p = (at.floor() as i64).rem_euclid(period);
    (if p < i64::from(size) { p } else { period - 1 - p }) as u32
}

/// The true classes of a part of a sea floor, as a picture with one pixel a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Truth {
    /// The outline of the picture in the world frame, metres.
    pub area: Area,
    /// The classes of the picture, each with its pixel value and its name.
    pub classes: Vec<(u8, String)>,
    /// An indexed PNG, north up; 0 where the class is not known.
    pub png: Vec<u8>,
}

impl Truth {
    /// The classes of an area; `None` if the world has no known classes.
    pub fn new(world: &World, area: &Area, cell_m: f64) -> Result<Option<Self>, UserError> {
        if !world.is_annotated() {
            return Ok(None);
        }
        let bounds = cells_of(area, cell_m);
        let grid = true_classes(world, bounds, cell_m);
        let png = label_picture::encode_within(&grid, bounds).map_err(UserError::failed)?;
        let mut found: Vec<u8> = grid.iter().map(|(_, value)| value).collect();
        found.sort_unstable();
        found.dedup();
        let classes = found.into_iter().map(|value| (value, world.class_name(value - 1))).collect();
        let metres = |cells: i32| f64::from(cells) * cell_m;
        let area = Area {
            west: metres(bounds.x),
            south: metres(bounds.y),
            east: metres(bounds.x + bounds.width as i32),
            north: metres(bounds.y + bounds.height as i32),
        };
        Ok(Some(Self { area, classes, png }))
    }
}

/// The cells of an area, those at its edges included.
fn cells_of(area: &Area, cell_m: f64) -> Rect {
    let (x, y) = ((area.west / cell_m).floor() as i32, (area.south / cell_m).floor() as i32);
    let count = |high: f64, first: i32| ((high / cell_m).ceil() as i32 - first).max(1) as u32;
    Rect { x, y, width: count(area.east, x), height: count(area.north, y) }
}

/// The true classes of cells, shifted by one; a cell of unknown class is left out.
pub fn true_classes(world: &World, bounds: Rect, cell_m: f64) -> LabelGrid {
    let value = |cell: Cell| Some((cell, world.class_of(cell, cell_m)?.saturating_add(1).min(254)));
    bounds.cells().filter_map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    #[test]
    fn the_camera_has_north_at_the_top_and_turns_with_the_heading() {
        let image = RgbImage::from_fn(200, 200, |x, y| Rgb([x as u8, y as u8, 0]));
        let world = Mosaic { image, metres_per_pixel: 0.1, classes: None };
        let north = world.view(10.0, 10.0, 0.0, 64, 64);
        assert!(north.get_pixel(32, 0)[1] < north.get_pixel(32, 63)[1], "top is north: small row of the image");
        let east = world.view(10.0, 10.0, 90f64.to_radians(), 64, 64);
        assert!(east.get_pixel(32, 0)[0] > east.get_pixel(32, 63)[0], "heading east, top is east: large column");
    }

    #[test]
    fn a_cell_has_the_class_of_most_of_its_pixels_and_none_outside() {
        let classes = (0..100 * 50).map(|i| if i % 100 < 50 { 3 } else { IGNORE }).collect();
        let image = RgbImage::from_pixel(100, 50, Rgb([120, 120, 120]));
        let world = Mosaic { image, metres_per_pixel: 0.1, classes: Some(classes) };
        assert_eq!(world.class_of(Cell::new(0, 0), 1.0), Some(3));
        assert_eq!(world.class_of(Cell::new(8, 2), 1.0), None, "not annotated");
        assert_eq!(world.class_of(Cell::new(-1, 0), 1.0), None, "outside");
    }

    #[test]
    fn the_truth_of_a_reef_names_the_classes_of_its_cells() {
        let world = World::reef(1, 0.01);
        let area = Area { west: 50.1, south: 30.0, east: 60.0, north: 35.0 };
        let truth = Truth::new(&world, &area, 0.25).unwrap().unwrap();
        assert_eq!(truth.area, Area { west: 50.0, ..area });
        assert!(truth.classes.len() > 1, "{:?}", truth.classes);
        let (cell, class) = (Cell::new(210, 130), world.class_of(Cell::new(210, 130), 0.25).unwrap());
        let known = true_classes(&world, cells_of(&area, 0.25), 0.25).get(cell);
        assert_eq!(known, class + 1);
        assert!(truth.classes.contains(&(known, world.class_name(class))));
    }
}
