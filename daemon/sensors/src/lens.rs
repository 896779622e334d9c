//! Distortion models of ROS 2 (`sensor_msgs/distortion_models.hpp`, REP 104) by the formulas of OpenCV's calib3d, and the table
//! by which distorted images are sampled.

use image::RgbImage;

/// The distortion of a lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Lens {
    None,
    /// k1, k2, p1, p2, k3, k4, k5, k6 of Brown's model with a rational factor; those of plumb_bob end at k3.
    Rational([f64; 8]),
    /// k1 to k4 of an equidistant lens (Kannala and Brandt 2006).
    Fisheye([f64; 4]),
}

/// A distortion that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LensError {
    #[error(
        "the distortion model {0:?} is not supported; allowed are plumb_bob, rational_polynomial, equidistant and fisheye"
    )]
    Model(String),
    #[error("{model} has {count} distortion coefficients; expected {expected}")]
    Count { model: String, count: usize, expected: &'static str },
    #[error("a distortion coefficient is not a finite number")]
    NotFinite,
}

/// The largest coefficient that is taken for one.
const MAX: f64 = 1e6;

impl Lens {
    pub(crate) fn new(model: &str, d: &[f64]) -> Result<Self, LensError> {
        if !d.iter().all(|number| number.abs() <= MAX) {
            return Err(LensError::NotFinite);
        }
        if d.iter().all(|&number| number == 0.0) && (d.is_empty() || model.is_empty()) {
            return Ok(Self::None);
        }
        let is_straight = d.iter().all(|&number| number == 0.0);
        let rational = || {
            let mut coefficients = [0.0; 8];
            coefficients.iter_mut().zip(d).for_each(|(to, from)| *to = *from);
            if is_straight { Self::None } else { Self::Rational(coefficients) }
        };
        let wrong = |expected| LensError::Count { model: model.to_owned(), count: d.len(), expected };
        match (model, d.len()) {
            ("plumb_bob", 4 | 5) | ("rational_polynomial", 8) => Ok(rational()),
            // OpenCV may add coefficients of thin prisms and a tilted sensor, which are 0.
            ("rational_polynomial", 12 | 14) if d[8..].iter().all(|&number| number == 0.0) => Ok(rational()),
            ("equidistant" | "fisheye", 4) => Ok(Self::Fisheye([d[0], d[1], d[2], d[3]])),
            ("plumb_bob", _) => Err(wrong("5")),
            ("rational_polynomial", _) => Err(wrong("8, or zeros behind them")),
            ("equidistant" | "fisheye", _) => Err(wrong("4")),
            _ => Err(LensError::Model(model.chars().take(40).collect())),
        }
    }

    /// The distorted place of a point at a distance of 1 along the optical axis.
    pub(crate) fn distort(&self, x: f64, y: f64) -> (f64, f64) {
        let r2 = x * x + y * y;
        match self {
            Self::None => (x, y),
            Self::Rational([k1, k2, p1, p2, k3, k4, k5, k6]) => {
                let factor = (1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1.0 + r2 * (k4 + r2 * (k5 + r2 * k6)));
                (
                    x * factor + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                    y * factor + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
                )
            }
            Self::Fisheye([k1, k2, k3, k4]) => {
                let r = r2.sqrt();
                let angle = r.atan();
                let a2 = angle * angle;
                let bent = angle * (1.0 + a2 * (k1 + a2 * (k2 + a2 * (k3 + a2 * k4))));
                let factor = if r > 0.0 { bent / r } else { 1.0 };
                (x * factor, y * factor)
            }
        }
    }
}

/// For each pixel of a rectified image, the place in the raw one.
#[derive(Debug, Clone)]
pub(crate) struct Remap {
    size: (u32, u32),
    /// Column and row, row by row.
    places: Vec<[f32; 2]>,
}

impl Remap {
    /// A table for images of `size`, which are not empty.
    pub(crate) fn new(size: (u32, u32), place: impl Fn(f64, f64) -> (f64, f64)) -> Self {
        let pixels = (0..size.1).flat_map(|v| (0..size.0).map(move |u| (u, v)));
        let places = pixels.map(|(u, v)| {
            let (x, y) = place(u.into(), v.into());
            [x as f32, y as f32]
        });
        Self { size, places: places.collect() }
    }

    /// The rectified image: each pixel between the four nearest ones of the raw image, linear in both directions. Where the
    /// raw image shows nothing, its border is repeated.
    pub(crate) fn apply(&self, image: &RgbImage) -> RgbImage {
        let (width, height) = self.size;
        if image.dimensions() != self.size {
            return image.clone();
        }
        let raw = image.as_raw().as_chunks::<3>().0;
        let (last_x, last_y) = (width as usize - 1, height as usize - 1);
        let mut samples = vec![0; raw.len() * 3];
        for (to, [x, y]) in samples.as_chunks_mut::<3>().0.iter_mut().zip(&self.places) {
            // NaN becomes 0.
            let (x, y) = (x.max(0.0).min(last_x as f32), y.max(0.0).min(last_y as f32));
            let (left, top) = (x as usize, y as usize);
            let (right, below) = ((left + 1).min(last_x), (top + 1).min(last_y));
            let (part_x, part_y) = (x - left as f32, y - top as f32);
            let row = |row: usize| &raw[row * width as usize..][..width as usize];
            let (above, under) = (row(top), row(below));
            for (channel, to) in to.iter_mut().enumerate() {
                let line = |row: &[[u8; 3]]| {
                    let (from, beside) = (f32::from(row[left][channel]), f32::from(row[right][channel]));
                    from + (beside - from) * part_x
                };
                let from = line(above);
                *to = (from + (line(under) - from) * part_y + 0.5) as u8;
            }
        }
        RgbImage::from_raw(width, height, samples).unwrap_or_else(|| image.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn image() -> RgbImage {
        RgbImage::from_fn(4, 2, |x, y| Rgb([(10 * x + 100 * y) as u8, 0, 255]))
    }

    #[test]
    fn pixels_are_sampled_between_their_neighbours() {
        let shifted = Remap::new((4, 2), |u, v| (u + 0.5, v)).apply(&image());
        let reds: Vec<u8> = shifted.pixels().map(|pixel| pixel.0[0]).collect();
        assert_eq!(reds, [5, 15, 25, 30, 105, 115, 125, 130]);
        assert_eq!(Remap::new((4, 2), |u, v| (u, v)).apply(&image()), image());
    }

    #[test]
    fn beyond_the_raw_image_its_border_is_repeated() {
        let far = |place: (f64, f64)| Remap::new((4, 2), move |_, _| place).apply(&image()).get_pixel(0, 0).0[0];
        assert_eq!([far((-9.0, 1.0)), far((1e30, 0.0)), far((f64::NAN, f64::INFINITY))], [100, 30, 100]);
    }
}
