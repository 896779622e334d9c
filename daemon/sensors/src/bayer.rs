//! Colour from the mosaic of a sensor with a Bayer pattern.

use image::{Rgb, RgbImage};

/// The colours of the first two rows and columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BayerPattern {
    Rggb,
    Bggr,
    Gbrg,
    Grbg,
}

impl BayerPattern {
    /// The colour of the filter over a pixel: 0 red, 1 green, 2 blue.
    fn colour(self, x: usize, y: usize) -> usize {
        let square = match self {
            Self::Rggb => [0, 1, 1, 2],
            Self::Bggr => [2, 1, 1, 0],
            Self::Gbrg => [1, 2, 0, 1],
            Self::Grbg => [1, 0, 2, 1],
        };
        square[(y % 2) * 2 + x % 2]
    }

    /// Each colour of a pixel is the mean of the pixels of that colour among itself and its eight neighbours, where its own
    /// colour counts alone.
    pub(crate) fn colours(self, width: usize, height: usize, grey: impl Fn(usize, usize) -> u8) -> RgbImage {
        let mut image = RgbImage::new(width as u32, height as u32);
        for y in 0..height {
            for x in 0..width {
                let (mut sums, mut counts) = ([0_u32; 3], [0_u32; 3]);
                for v in y.saturating_sub(1)..(y + 2).min(height) {
                    for u in x.saturating_sub(1)..(x + 2).min(width) {
                        let colour = self.colour(u, v);
                        sums[colour] += u32::from(grey(u, v));
                        counts[colour] += 1;
                    }
                }
                let own = self.colour(x, y);
                (sums[own], counts[own]) = (u32::from(grey(x, y)), 1);
                let mean = |i: usize| ((sums[i] + counts[i] / 2) / counts[i].max(1)) as u8;
                image.put_pixel(x as u32, y as u32, Rgb([mean(0), mean(1), mean(2)]));
            }
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_even_colour_is_recovered_from_each_pattern() {
        for pattern in [BayerPattern::Rggb, BayerPattern::Bggr, BayerPattern::Gbrg, BayerPattern::Grbg] {
            let image = pattern.colours(6, 5, |x, y| [200, 100, 50][pattern.colour(x, y)]);
            assert!(image.pixels().all(|pixel| pixel.0 == [200, 100, 50]), "{pattern:?}");
        }
    }
}
