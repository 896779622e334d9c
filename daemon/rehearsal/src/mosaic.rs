//! A sea floor that is an image.

use image::RgbImage;
use scenecast_core::Area;
use scenecast_core::UserError;
use scenecast_files::{read_classes, read_image};
use scenecast_protocol::map::Cell;
use std::path::Path;

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
}
