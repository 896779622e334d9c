//! A sea floor with relief, and the view of a camera over it.

use crate::relief::Relief;
use image::GrayImage;

/// Brightness on a grid with its north-west corner at the origin, mirrored beyond its bounds.
pub struct Floor {
    columns: usize,
    rows: usize,
    brightness: Vec<f32>,
    metres_per_pixel: f64,
}

/// A camera that looks straight down.
#[derive(Clone, Copy)]
pub struct View {
    pub x_m: f64,
    pub y_m: f64,
    pub heading_rad: f64,
    pub metres_per_pixel: f64,
    pub altitude_m: f64,
    pub columns: usize,
    pub rows: usize,
}

impl Floor {
    pub fn new(image: &GrayImage, metres_per_pixel: f64) -> Self {
        let brightness = image.as_raw().iter().map(|&value| f32::from(value)).collect();
        Self { columns: image.width() as usize, rows: image.height() as usize, brightness, metres_per_pixel }
    }

    /// Identical ripples of 0.29 m.
    pub fn ripples() -> Self {
        Self::painted(|x, _| 110.0 + 30.0 * (x / 29.0 * std::f32::consts::TAU).sin())
    }

    pub fn even() -> Self {
        Self::painted(|_, _| 110.0)
    }

    fn painted(colour: impl Fn(f32, f32) -> f32) -> Self {
        let (columns, rows) = (2900, 2030);
        let brightness = (0..columns * rows).map(|i| colour((i % columns) as f32, (i / columns) as f32)).collect();
        Self { columns, rows, brightness, metres_per_pixel: 0.01 }
    }

    /// Width and height, metres.
    pub fn size_m(&self) -> [f64; 2] {
        [self.columns as f64 * self.metres_per_pixel, self.rows as f64 * self.metres_per_pixel]
    }

    fn at(&self, x_m: f64, y_m: f64) -> f32 {
        let (x, y) = (x_m / self.metres_per_pixel - 0.5, self.rows as f64 - y_m / self.metres_per_pixel - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (fx, fy) = ((x - left) as f32, (y - top) as f32);
        let pixel = |column: i64, row: i64| {
            self.brightness[mirror(row, self.rows) * self.columns + mirror(column, self.columns)]
        };
        let (left, top) = (left as i64, top as i64);
        let upper = pixel(left, top) * (1.0 - fx) + pixel(left + 1, top) * fx;
        let lower = pixel(left, top + 1) * (1.0 - fx) + pixel(left + 1, top + 1) * fx;
        upper * (1.0 - fy) + lower * fy
    }

    /// The brightness of each pixel of a view.
    pub fn view(&self, view: &View, relief: &Relief) -> Vec<f32> {
        let (sin, cos) = view.heading_rad.sin_cos();
        let mut pixels = Vec::with_capacity(view.columns * view.rows);
        for row in 0..view.rows {
            let ahead = (view.rows as f64 / 2.0 - row as f64 - 0.5) * view.metres_per_pixel;
            for column in 0..view.columns {
                let right = (column as f64 + 0.5 - view.columns as f64 / 2.0) * view.metres_per_pixel;
                let (dx, dy) = (cos * right + sin * ahead, cos * ahead - sin * right);
                let mut share = 1.0;
                if !relief.is_flat() {
                    for _ in 0..4 {
                        let height = relief.height_m(view.x_m + share * dx, view.y_m + share * dy);
                        share = 1.0 - height / view.altitude_m;
                    }
                }
                pixels.push(self.at(view.x_m + share * dx, view.y_m + share * dy));
            }
        }
        pixels
    }
}

fn mirror(at: i64, size: usize) -> usize {
    let at = at.rem_euclid(2 * size as i64) as usize;
    if at < size { at } else { 2 * size - 1 - at }
}
