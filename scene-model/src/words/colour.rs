//! Colour words: z-scored CIE Lab on an 8 x 8 x 8 lattice.

use image::RgbImage;

use super::grid::{bounds, centres};
use super::stretch::Stretch;
use super::{Moments, Word};

const LEVELS: u32 = 8;
/// The lattice spans this many standard deviations either side of the mean.
const REACH: f32 = 2.0;

/// Number of colour words.
pub(crate) const SIZE: u32 = LEVELS * LEVELS * LEVELS;

/// Mean and spread of L, a and b in the frames learnt from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Colour {
    lab: [Moments; 3],
}

impl Colour {
    /// One word for each box of `spacing` pixels: the lattice point of its mean colour.
    pub(crate) fn extract(
        &mut self,
        frame: &RgbImage,
        stretch: &Stretch,
        spacing: f32,
        learn: bool,
        first_id: u32,
        words: &mut Vec<Word>,
    ) {
        let colours: Vec<[f32; 3]> = box_means(frame, spacing).into_iter().map(|c| lab(stretch.apply(c))).collect();
        if learn {
            for colour in &colours {
                self.lab.iter_mut().zip(colour).for_each(|(moments, &value)| moments.add(value));
            }
        }
        let scales = self.lab.map(|moments| moments.scale());
        let across = centres(frame.width(), spacing);
        let down = centres(frame.height(), spacing);
        let places = down.iter().flat_map(|&v| across.iter().map(move |&u| (u, v)));
        words.extend(colours.iter().zip(places).map(|(colour, (u, v))| {
            let mut id = 0;
            for (value, (mean, gain)) in colour.iter().zip(scales) {
                id = id * LEVELS + level((value - mean) * gain);
            }
            Word { id: first_id + id, u, v }
        }));
    }
}

fn level(z: f32) -> u32 {
    let step = 2.0 * REACH / LEVELS as f32;
    ((z + REACH) / step).clamp(0.0, LEVELS as f32 - 1.0) as u32
}

/// Mean colours of the boxes of a regular grid, row by row.
pub(crate) fn box_means(frame: &RgbImage, spacing: f32) -> Vec<[f32; 3]> {
    let across = bounds(frame.width(), spacing);
    let down = bounds(frame.height(), spacing);
    let stride = frame.width() as usize;
    let pixels = frame.as_raw().as_chunks::<3>().0;
    let mut means = Vec::with_capacity((across.len() - 1) * (down.len() - 1));
    let mut sums = vec![[0u32; 3]; across.len() - 1];
    for rows in down.windows(2) {
        sums.fill([0; 3]);
        for y in rows[0]..rows[1] {
            let row = &pixels[y as usize * stride..][..stride];
            for (sum, span) in sums.iter_mut().zip(across.windows(2)) {
                for pixel in &row[span[0] as usize..span[1] as usize] {
                    sum[0] += u32::from(pixel[0]);
                    sum[1] += u32::from(pixel[1]);
                    sum[2] += u32::from(pixel[2]);
                }
            }
        }
        for (sum, span) in sums.iter().zip(across.windows(2)) {
            let share = 1.0 / ((span[1] - span[0]) * (rows[1] - rows[0])) as f32;
            means.push(sum.map(|value| value as f32 * share));
        }
    }
    means
}

/// CIE Lab (D65) of an sRGB colour with channels 0 to 1.
pub(crate) fn lab(rgb: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(linear);
    let x = (0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47;
    let y = 0.212_673 * r + 0.715_152 * g + 0.072_175 * b;
    let z = (0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83;
    let [fx, fy, fz] = [x, y, z].map(|t| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// The sRGB curve, as a cubic that stays within 0.002 of it (a power costs ten times as much).
fn linear(value: f32) -> f32 {
    value * (value * (value * 0.305_306 + 0.682_171) + 0.012_523)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_white_and_black_is_black() {
        let [l, a, b] = lab([1.0; 3]);
        assert!((l - 100.0).abs() < 0.1 && a.abs() < 0.1 && b.abs() < 0.1);
        assert!(lab([0.0; 3])[0].abs() < 0.1);
    }

    #[test]
    fn box_means_are_means() {
        let frame = RgbImage::from_fn(8, 4, |x, _| image::Rgb([if x < 4 { 10 } else { 30 }, 7, x as u8]));
        assert_eq!(box_means(&frame, 4.0), vec![[10.0, 7.0, 1.5], [30.0, 7.0, 5.5]]);
    }
}
