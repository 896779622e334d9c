//! The flat field (how bright lamp, lens and water make each part of a frame, learnt from the frames themselves), the tone
//! stretch of each channel, and running means and variances.

use super::grey_plane::GreyPlane;
use image::RgbImage;
use serde::{Deserialize, Serialize};

const COLUMNS: usize = 16;
const ROWS: usize = 12;
/// Frames after which half of the measured difference is corrected: before, it may be the sea floor's own.
const HALF_FRAMES: f32 = 12.0;
/// Frames that are learnt from. Later frames change nothing, so that words keep their meaning.
const FRAMES: u32 = 500;
/// The largest correction of a channel, as the natural logarithm of its factor.
const MAX_LOG: f32 = 1.5;

type Field = [[f32; 3]; COLUMNS * ROWS];

/// Corrects frames for a brightness that depends on the place in the frame alone.
///
/// The mean logarithm of the brightness at each place, over all frames, is fitted by a quadratic in both directions, for each
/// channel: a Gaussian lamp cone with any centre and slant. A frame is divided by it, so that its mean brightness stays.
///
/// ```
/// use image::{Rgb, RgbImage};
/// use scene_model::words::FlatField;
///
/// let lit = RgbImage::from_fn(64, 48, |x, _| Rgb([200 - 2 * x as u8; 3]));
/// let mut flat = FlatField::default();
/// (0..300).for_each(|_| flat.learn(&lit));
/// let even = flat.corrected(&lit);
/// assert!(even.get_pixel(2, 20)[0].abs_diff(even.get_pixel(61, 20)[0]) < 30);
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FlatField {
    frames: u32,
    /// Sums over the frames of the moments with x, y, xy, x² and y² of the logarithm of each channel.
    moments: [[f64; 3]; TERMS],
}

const TERMS: usize = 5;

impl FlatField {
    /// Learns from a frame. The first 500 frames count; one without pixels does not.
    pub fn learn(&mut self, frame: &RgbImage) {
        if self.frames >= FRAMES || frame.width() == 0 || frame.height() == 0 {
            return;
        }
        self.frames += 1;
        let logs = box_logs(frame);
        for (k, moments) in self.moments.iter_mut().enumerate() {
            for (node, log) in logs.iter().enumerate() {
                let term = term(k, node);
                moments.iter_mut().zip(log).for_each(|(sum, log)| *sum += f64::from(term * log));
            }
        }
    }

    /// The frame as an even light would show it.
    #[must_use]
    pub fn corrected(&self, frame: &RgbImage) -> RgbImage {
        let mut even = frame.clone();
        let (width, height) = (frame.width() as usize, frame.height() as usize);
        if self.frames == 0 || width == 0 || height == 0 {
            return even;
        }
        let gains = self.gains();
        let across: Vec<(usize, f32)> = (0..width).map(|x| between(x, width, COLUMNS)).collect();
        for (y, line) in even.as_flat_samples_mut().samples.chunks_exact_mut(3 * width).enumerate() {
            let (row, part) = between(y, height, ROWS);
            let (above, below) = (&gains[row * COLUMNS..][..COLUMNS], &gains[(row + 1) * COLUMNS..][..COLUMNS]);
            let nodes: [[f32; 3]; COLUMNS] = std::array::from_fn(|i| mix(&above[i], &below[i], part));
            for (pixel, &(column, part)) in line.as_chunks_mut::<3>().0.iter_mut().zip(&across) {
                let gain = mix(&nodes[column], &nodes[column + 1], part);
                pixel.iter_mut().zip(gain).for_each(|(value, gain)| *value = (f32::from(*value) * gain + 0.5) as u8);
            }
        }
        even
    }

    /// The factor of each channel at each node.
    fn gains(&self) -> Field {
        let frames = self.frames as f32;
        let share = frames / (frames + HALF_FRAMES) / frames;
        let norm: [f32; TERMS] = std::array::from_fn(|k| (0..COLUMNS * ROWS).map(|node| term(k, node).powi(2)).sum());
        std::array::from_fn(|node| {
            std::array::from_fn(|channel| {
                let fit = |k: usize| self.moments[k][channel] as f32 / norm[k] * term(k, node);
                let log: f32 = (0..TERMS).map(fit).sum();
                (-share * log).clamp(-MAX_LOG, MAX_LOG).exp()
            })
        })
    }
}

/// A place along an edge, from -1 to 1.
fn along(index: usize, count: usize) -> f32 {
    (2.0 * index as f32 + 1.0) / count as f32 - 1.0
}

/// The mean of the squares of all places along an edge.
fn mean_square(count: usize) -> f32 {
    let count = count as f32;
    (1.0 - 1.0 / (count * count)) / 3.0
}

/// The `k`-th term at a node. On the grid the terms are orthogonal to each other and to a constant.
fn term(k: usize, node: usize) -> f32 {
    let (x, y) = (along(node % COLUMNS, COLUMNS), along(node / COLUMNS, ROWS));
    match k {
        0 => x,
        1 => y,
        2 => x * y,
        3 => x * x - mean_square(COLUMNS),
        _ => y * y - mean_square(ROWS),
    }
}

/// The logarithm of the mean of each channel in each box of the grid. A channel that is dark counts as 1 of 255.
fn box_logs(frame: &RgbImage) -> Field {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let pixels = frame.as_raw().as_chunks::<3>().0;
    std::array::from_fn(|node| {
        let span = |index: usize, length: usize, count: usize| {
            let first = (index * length / count).min(length - 1);
            first..((index + 1) * length / count).max(first + 1)
        };
        let columns = span(node % COLUMNS, width, COLUMNS);
        let rows = span(node / COLUMNS, height, ROWS);
        let count = (columns.len() * rows.len()) as f32;
        let mut sums = [0u32; 3];
        for row in rows {
            for pixel in &pixels[row * width..][columns.clone()] {
                sums.iter_mut().zip(pixel).for_each(|(sum, &value)| *sum += u32::from(value));
            }
        }
        sums.map(|sum| (sum as f32 / count).max(1.0).ln())
    })
}

/// The node before a pixel, and the part of the distance to the next one.
fn between(pixel: usize, pixels: usize, nodes: usize) -> (usize, f32) {
    let at = ((pixel as f32 + 0.5) / pixels as f32 * nodes as f32 - 0.5).clamp(0.0, (nodes - 1) as f32);
    let node = (at as usize).min(nodes - 2);
    (node, at - node as f32)
}

fn mix(a: &[f32; 3], b: &[f32; 3], part: f32) -> [f32; 3] {
    std::array::from_fn(|i| a[i] + (b[i] - a[i]) * part)
}

const LOW: f64 = 0.01;
const HIGH: f64 = 0.99;

/// The histograms of the channels, and the stretch that follows from them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Stretch {
    histograms: [Vec<u64>; 3],
    /// The value that becomes 0, and 1 / range, of each channel.
    tones: [(f32, f32); 3],
}

impl Default for Stretch {
    fn default() -> Self {
        Self { histograms: [vec![0; 256], vec![0; 256], vec![0; 256]], tones: [(0.0, 1.0 / 255.0); 3] }
    }
}

impl Stretch {
    /// Repairs the shape of deserialised histograms.
    pub(crate) fn restored(mut self) -> Self {
        self.histograms.iter_mut().for_each(|histogram| histogram.resize(256, 0));
        self
    }

    /// Adds a frame to the histograms.
    pub(crate) fn learn(&mut self, frame: &RgbImage) {
        let [red, green, blue] = &mut self.histograms;
        for pixel in frame.as_raw().as_chunks::<3>().0 {
            red[pixel[0] as usize] += 1;
            green[pixel[1] as usize] += 1;
            blue[pixel[2] as usize] += 1;
        }
        for (tones, histogram) in self.tones.iter_mut().zip(&self.histograms) {
            let low = percentile(histogram, LOW);
            let range = (percentile(histogram, HIGH) - low).max(1.0);
            *tones = (low, 1.0 / range);
        }
    }

    /// Stretches a colour with channels of 0 to 255 to channels of 0 to 1.
    pub(crate) fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let mut out = rgb;
        for (value, (low, gain)) in out.iter_mut().zip(self.tones) {
            *value = ((*value - low) * gain).clamp(0.0, 1.0);
        }
        out
    }

    /// The stretched luma of a frame, 0 to 1, with the weights of Rec. 601.
    pub(crate) fn grey(&self, frame: &RgbImage) -> GreyPlane {
        let table = |channel: usize, weight: f32| -> Vec<f32> {
            let (low, gain) = self.tones[channel];
            (0..256).map(|value| weight * ((value as f32 - low) * gain).clamp(0.0, 1.0)).collect()
        };
        let (red, green, blue) = (table(0, 0.299), table(1, 0.587), table(2, 0.114));
        let pixels = frame.as_raw().as_chunks::<3>().0;
        let grey = pixels.iter().map(|p| red[p[0] as usize] + green[p[1] as usize] + blue[p[2] as usize]).collect();
        GreyPlane { width: frame.width() as usize, height: frame.height() as usize, grey }
    }
}

fn percentile(histogram: &[u64], share: f64) -> f32 {
    let total: u64 = histogram.iter().sum();
    let goal = share * total as f64;
    let mut below = 0;
    for (value, &count) in histogram.iter().enumerate() {
        below += count;
        if below as f64 > goal {
            return value as f32;
        }
    }
    255.0
}

/// The sums behind the mean and the variance of one measured quantity.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Moments {
    count: f64,
    sum: f64,
    squares: f64,
}

impl Moments {
    pub(super) fn add(&mut self, value: f32) {
        self.count += 1.0;
        self.sum += f64::from(value);
        self.squares += f64::from(value).powi(2);
    }

    /// Adds the points of a sample, each component to its own moments.
    pub(super) fn learn<const N: usize>(moments: &mut [Self; N], sample: &[[f32; N]]) {
        for point in sample {
            moments.iter_mut().zip(point).for_each(|(moments, &value)| moments.add(value));
        }
    }

    /// The mean, and 1 / standard deviation (0 if the variance is 0).
    pub(super) fn scale(&self) -> (f32, f32) {
        let count = self.count.max(1.0);
        let mean = self.sum / count;
        let variance = (self.squares / count - mean * mean).max(0.0);
        let inverse = if variance > 1e-12 { 1.0 / variance.sqrt() } else { 0.0 };
        (mean as f32, inverse as f32)
    }
}

/// The z-scores of values, given the mean and 1 / standard deviation of each.
pub(super) fn standardised<const N: usize>(values: &[f32; N], scales: &[(f32, f32); N]) -> [f32; N] {
    std::array::from_fn(|i| (values[i] - scales[i].0) * scales[i].1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    /// A floor of random boxes under a lamp that stands to the left.
    fn lit(moment: u64) -> (RgbImage, RgbImage) {
        let floor = RgbImage::from_fn(160, 120, |x, y| {
            let bits = crate::random::mix(moment << 32 | u64::from(x / 40) << 8 | u64::from(y / 40));
            Rgb([60 + (bits % 120) as u8, 60 + (bits / 128 % 100) as u8, 50 + (bits / 65_536 % 90) as u8])
        });
        let lamp = |x: u32, y: u32| {
            let (right, down) = (f64::from(x) / 80.0 - 0.7, f64::from(y) / 60.0 - 1.0);
            (-0.5 * (right * right + down * down)).exp()
        };
        let seen = RgbImage::from_fn(160, 120, |x, y| {
            Rgb(floor.get_pixel(x, y).0.map(|value| (f64::from(value) * lamp(x, y)).round() as u8))
        });
        (floor, seen)
    }

    /// The deviation of the ratio of two frames, relative to its mean, over the middles of boxes.
    fn unevenness(a: &RgbImage, b: &RgbImage) -> f64 {
        let ratio = |x: u32, y: u32| f64::from(a.get_pixel(x, y)[1]) / f64::from(b.get_pixel(x, y)[1]);
        let ratios: Vec<f64> = (0..12).flat_map(|y| (0..16).map(move |x| ratio(10 * x + 5, 10 * y + 5))).collect();
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        (ratios.iter().map(|r| (r / mean - 1.0).powi(2)).sum::<f64>() / ratios.len() as f64).sqrt()
    }

    #[test]
    fn a_lamp_cone_is_levelled() {
        let mut flat = FlatField::default();
        (0..200).for_each(|moment| flat.learn(&lit(moment).1));
        let (floor, seen) = lit(1000);
        let (before, after) = (unevenness(&seen, &floor), unevenness(&flat.corrected(&seen), &floor));
        assert!(before > 0.2 && after < 0.05, "{before} {after}");
    }

    #[test]
    fn an_even_light_is_left_as_it_is() {
        let mut flat = FlatField::default();
        (0..200).for_each(|moment| flat.learn(&lit(moment).0));
        let floor = lit(1000).0;
        assert!(unevenness(&flat.corrected(&floor), &floor) < 0.05);
        assert_eq!(FlatField::default().corrected(&floor), floor);
    }

    #[test]
    fn a_single_frame_is_hardly_changed() {
        let mut flat = FlatField::default();
        let half = RgbImage::from_fn(160, 120, |x, _| Rgb([if x < 80 { 40 } else { 160 }; 3]));
        flat.learn(&half);
        assert!(unevenness(&flat.corrected(&half), &half) < 0.1);
    }

    #[test]
    fn frames_of_any_size_and_tone_are_accepted() {
        let mut flat = FlatField::default();
        for (width, height) in [(0, 0), (1, 1), (1, 40), (3, 2), (700, 11)] {
            let frame = RgbImage::from_pixel(width, height, Rgb([0, 255, 7]));
            flat.learn(&frame);
            assert_eq!(flat.corrected(&frame).dimensions(), (width, height));
        }
    }

    #[test]
    fn outliers_do_not_set_the_range() {
        let mut frame = RgbImage::from_fn(100, 100, |x, _| image::Rgb([50 + x as u8, 100, 0]));
        frame.put_pixel(0, 0, image::Rgb([255, 0, 0]));
        let mut stretch = Stretch::default();
        stretch.learn(&frame);
        let low = stretch.apply([51.0, 0.0, 0.0])[0];
        let high = stretch.apply([148.0, 0.0, 0.0])[0];
        assert!(low < 0.02 && high > 0.98, "{low} {high}");
    }
}
