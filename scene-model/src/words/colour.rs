//! Colour words: the colours of a frame on a regular grid, z-scored CIE Lab on an 8 x 8 x 8 lattice.

use super::config::{Word, bounds, centres};
use super::flat_field::{Moments, Stretch, standardised};
use image::RgbImage;
use serde::{Deserialize, Serialize};

/// The levels of L, of a and of b on the lattice of colour words: the first 8 x 8 x 8 ids are (L x 8 + a) x 8 + b.
pub(crate) const LEVELS: u32 = 8;
/// The lattice spans this many standard deviations on either side of the mean.
const REACH: f32 = 2.0;

/// The number of colour words.
pub(crate) const SIZE: u32 = LEVELS * LEVELS * LEVELS;

/// The moments of L, a and b.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ColourWords {
    lab: [Moments; 3],
}

impl ColourWords {
    /// Appends one word for each point of the field: the lattice point of its colour.
    pub(crate) fn extract(&mut self, field: &ColourField, learn: bool, first_id: u32, words: &mut Vec<Word>) {
        if learn {
            Moments::learn(&mut self.lab, &field.colours);
        }
        let scales = self.lab.map(|moments| moments.scale());
        words.extend(field.colours.iter().zip(field.places()).map(|(colour, (u, v))| {
            let mut id = 0;
            for (value, (mean, gain)) in colour.iter().zip(scales) {
                id = id * LEVELS + level((value - mean) * gain, REACH, LEVELS);
            }
            Word { id: first_id + id, u, v }
        }));
    }

    /// Appends the positions about `spacing` pixels apart, and the z-scores of the field's colours there, to `kept`.
    pub(crate) fn scores(&self, field: &ColourField, spacing: f32, kept: &mut Vec<(f32, f32, [f32; 3])>) {
        let scales = self.lab.map(|moments| moments.scale());
        let scored = |(u, v, index): (f32, f32, usize)| (u, v, standardised(&field.colours[index], &scales));
        kept.extend(field.sample(spacing).into_iter().map(scored));
    }
}

/// The level of a z-score on `levels` equal steps from `-reach` to `reach`; values beyond take the outer levels.
pub(super) fn level(z: f32, reach: f32, levels: u32) -> u32 {
    let step = 2.0 * reach / levels as f32;
    ((z + reach) / step).clamp(0.0, levels as f32 - 1.0) as u32
}

/// Colours on a regular grid, row by row from the top.
#[derive(Clone, Debug)]
pub(crate) struct ColourField {
    across: Vec<f32>,
    down: Vec<f32>,
    /// Width and height of the frame, pixels.
    size: [u32; 2],
    cell_px: f32,
    pub(crate) colours: Vec<[f32; 3]>,
}

impl ColourField {
    /// The tone-stretched CIE Lab colours of boxes of `spacing` pixels; `cell_px` is the edge of a cell, pixels.
    pub(crate) fn lab(frame: &RgbImage, stretch: &Stretch, spacing: f32, cell_px: f32) -> Self {
        Self::new(frame, spacing, cell_px, |colour| lab(stretch.apply(colour)))
    }

    /// The mean colours of boxes of `spacing` pixels, with channels of 0 to 255, as `colour_of` converts them.
    pub(crate) fn new(
        frame: &RgbImage,
        spacing: f32,
        cell_px: f32,
        colour_of: impl FnMut([f32; 3]) -> [f32; 3],
    ) -> Self {
        Self {
            across: centres(frame.width(), spacing),
            down: centres(frame.height(), spacing),
            size: [frame.width(), frame.height()],
            cell_px,
            colours: box_means(frame, spacing).into_iter().map(colour_of).collect(),
        }
    }

    /// The positions of the grid points, pixels.
    pub(crate) fn places(&self) -> impl Iterator<Item = (f32, f32)> {
        self.down.iter().flat_map(|&v| self.across.iter().map(move |&u| (u, v)))
    }

    /// Positions about `spacing` pixels apart, each with the index of its grid point.
    pub(crate) fn sample(&self, spacing: f32) -> Vec<(f32, f32, usize)> {
        let (columns, rows) = (self.across.len(), self.down.len());
        let index =
            |place: f32, length: u32, count: usize| ((place / length as f32 * count as f32) as usize).min(count - 1);
        let mut sample = Vec::new();
        for v in centres(self.size[1], spacing) {
            let row = index(v, self.size[1], rows);
            sample.extend(
                centres(self.size[0], spacing)
                    .into_iter()
                    .map(|u| (u, v, row * columns + index(u, self.size[0], columns))),
            );
        }
        sample
    }

    /// The mean and the standard deviation of the channels in a window of about `cells` cells around each grid point.
    pub(crate) fn windows(&self, cells: f32) -> (Vec<[f32; 3]>, Vec<[f32; 3]>) {
        let step = self.size[0] as f32 / self.across.len() as f32;
        let radius = (0.5 * cells * self.cell_px / step).round() as usize;
        let squares: Vec<[f32; 3]> = self.colours.iter().map(|colour| colour.map(|value| value * value)).collect();
        let means = self.blur(&self.colours, radius);
        let squares = self.blur(&squares, radius);
        let deviation = |mean: &[f32; 3], square: &[f32; 3]| {
            std::array::from_fn(|i| (square[i] - mean[i] * mean[i]).max(0.0).sqrt())
        };
        let spreads = means.iter().zip(&squares).map(|(mean, square)| deviation(mean, square)).collect();
        (means, spreads)
    }

    /// Means over squares with an edge of 2 `radius` + 1 grid points, cut off at the edges of the frame.
    fn blur(&self, values: &[[f32; 3]], radius: usize) -> Vec<[f32; 3]> {
        let (columns, rows) = (self.across.len(), self.down.len());
        let mut rowwise = values.to_vec();
        for row in 0..rows {
            blur_line(values, &mut rowwise, radius, columns, row * columns, 1);
        }
        let mut both = rowwise.clone();
        for column in 0..columns {
            blur_line(&rowwise, &mut both, radius, rows, column, columns);
        }
        both
    }
}

/// Running means along a line of `count` points, from index `first` on in steps of `stride`.
fn blur_line(from: &[[f32; 3]], to: &mut [[f32; 3]], radius: usize, count: usize, first: usize, stride: usize) {
    let mut sum = [0.0f64; 3];
    let add = |sum: &mut [f64; 3], i: usize, sign: f64| {
        sum.iter_mut().zip(from[first + i * stride]).for_each(|(sum, value)| *sum += sign * f64::from(value));
    };
    for i in 0..radius.min(count) {
        add(&mut sum, i, 1.0);
    }
    for i in 0..count {
        if i + radius < count {
            add(&mut sum, i + radius, 1.0);
        }
        if i > radius {
            add(&mut sum, i - radius - 1, -1.0);
        }
        let points = (i + radius).min(count - 1) - i.saturating_sub(radius) + 1;
        to[first + i * stride] = sum.map(|sum| (sum / points as f64) as f32);
    }
}

/// The mean colours of the boxes of a regular grid, row by row.
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

/// Returns the CIE Lab coordinates (D65) of an sRGB colour with channels of 0 to 1: L from 0 to 100, a and b around 0.
///
/// The sRGB curve is approximated by a cubic, with an error below 0.002.
///
/// ```
/// let [l, a, b] = scene_model::words::cie_lab([1.0, 1.0, 1.0]);
/// assert!((l - 100.0).abs() < 0.1 && a.abs() < 0.1 && b.abs() < 0.1);
/// ```
#[inline]
#[must_use]
pub fn lab(rgb: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = rgb.map(linear);
    let x = (0.412_456 * r + 0.357_576 * g + 0.180_438 * b) / 0.950_47;
    let y = 0.212_673 * r + 0.715_152 * g + 0.072_175 * b;
    let z = (0.019_334 * r + 0.119_192 * g + 0.950_304 * b) / 1.088_83;
    let [fx, fy, fz] = [x, y, z].map(|t| if t > 0.008_856 { t.cbrt() } else { 7.787 * t + 16.0 / 116.0 });
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// The sRGB transfer curve as a cubic with an error below 0.002; a power would take ten times as long.
fn linear(value: f32) -> f32 {
    value * (value * (value * 0.305_306 + 0.682_171) + 0.012_523)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_have_the_mean_and_deviation_of_their_points() {
        let frame = RgbImage::from_fn(60, 40, |x, _| image::Rgb([if x % 2 == 0 { 20 } else { 220 }; 3]));
        let field = ColourField::lab(&frame, &Stretch::default(), 1.0, 5.0);
        let (means, spreads) = field.windows(2.0);
        let (dark, bright) = (field.colours[0][0], field.colours[1][0]);
        let middle = 20 * 60 + 30;
        assert!((means[middle][0] - (6.0 * bright + 5.0 * dark) / 11.0).abs() < 6.0);
        assert!((spreads[middle][0] - 0.5 * (bright - dark)).abs() < 1.0);
        assert!(spreads[middle][1] < 0.1 && spreads[0][0] > 30.0);
    }

    #[test]
    fn black_and_white_have_no_chroma() {
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
