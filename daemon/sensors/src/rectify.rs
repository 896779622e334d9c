//! The table by which distorted images are sampled.

use image::{Rgb, RgbImage};

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
        let raw = image.as_raw();
        let samples = self.places.iter().flat_map(|[x, y]| {
            // NaN becomes 0.
            let (x, y) = (x.max(0.0).min((width - 1) as f32), y.max(0.0).min((height - 1) as f32));
            let (left, top) = (x as usize, y as usize);
            let (right, below) = ((left + 1).min(width as usize - 1), (top + 1).min(height as usize - 1));
            let (part_x, part_y) = (x - left as f32, y - top as f32);
            let at = |column: usize, row: usize, channel: usize| {
                f32::from(raw[3 * (row * width as usize + column) + channel])
            };
            Rgb(std::array::from_fn::<u8, 3, _>(|channel| {
                let line = |row: usize| {
                    let from = at(left, row, channel);
                    from + (at(right, row, channel) - from) * part_x
                };
                let from = line(top);
                (from + (line(below) - from) * part_y + 0.5) as u8
            }))
            .0
        });
        let samples: Vec<u8> = samples.collect();
        RgbImage::from_raw(width, height, samples).unwrap_or_else(|| image.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
