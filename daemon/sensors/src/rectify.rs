//! The table by which distorted images are sampled.

use image::RgbImage;

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
