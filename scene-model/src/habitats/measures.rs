//! What a place looks like: measures of a frame that depend on this frame alone.
//!
//! Logarithms of brightness and of colour ratios turn exposure and haze into shifts, and texture is relative to the local brightness. No
//! measure is compared with earlier frames, so a place has the same measures whenever it is seen.

use crate::words::{ColourField, GaborBank, GreyPlane};
use image::RgbImage;

/// The number of measures of a place.
pub const MEASURES: usize = 13;

/// The measures of a place, in a fixed order: brightness, red and blue against green; the deviations of these three in a window of two
/// cells; the energy of four bands of a difference of Gaussians; the Gabor energy at three scales. All are natural logarithms.
pub type MeasuredValues = [f64; MEASURES];

/// Points across a cell at which a frame is measured, and boxes of mean colours across a cell.
const POINTS_ACROSS: f32 = 3.0;
const BOXES_ACROSS: f32 = 6.0;
/// Added to a channel of 0 to 255, so that the noise of dark pixels does not become a colour.
const DARK: f32 = 2.0;
/// Added to deviations of logarithms, brightness first, so that sensor noise does not become a texture.
const SMOOTH: [f32; 3] = [0.02, 0.01, 0.01];
/// Added to a squared mean brightness, and to a relative energy.
const DIM: f64 = 1e-4;
const FLAT: f64 = 1e-5;
/// A Gaussian of 1.6 pixels: the middle and one side.
const GAUSSIAN: [f32; 5] = [0.250_404, 0.205_977, 0.114_644, 0.043_175, 0.011_002];
const BANDS: usize = 4;
const SCALES: usize = 3;

/// A place in a frame with its measures.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredPoint {
    /// Position in the frame, pixels.
    pub u: f32,
    /// Position in the frame, pixels.
    pub v: f32,
    /// Mean colour, logarithm of its deviation, and texture around the position.
    pub values: MeasuredValues,
}

/// Measures a frame at about nine points a cell; `cell_px` is the edge of a cell, pixels.
///
/// A frame without pixels, or a `cell_px` that is not above 0, has no points.
#[must_use]
pub fn measure(frame: &RgbImage, cell_px: f32) -> Vec<MeasuredPoint> {
    let is_usable = frame.width() > 0 && frame.height() > 0 && cell_px.is_finite() && cell_px > 0.0;
    if !is_usable {
        return Vec::new();
    }
    let field = ColourField::new(frame, cell_px / BOXES_ACROSS, cell_px, log_colour);
    let (means, _) = field.windows(2.0 / BOXES_ACROSS);
    let (_, deviations) = field.windows(2.0);
    let texture = Texture::new(frame, cell_px);
    let point = |(u, v, index): (f32, f32, usize)| {
        let mut values = [0.0; MEASURES];
        for k in 0..3 {
            values[k] = f64::from(means[index][k]);
            values[3 + k] = f64::from(deviations[index][k] + SMOOTH[k]).ln();
        }
        texture.measure(u, v, &mut values[6..]);
        MeasuredPoint { u, v, values }
    };
    field.sample(cell_px / POINTS_ACROSS).into_iter().map(point).collect()
}

/// Log brightness, and log ratios of red and blue to green.
fn log_colour(rgb: [f32; 3]) -> [f32; 3] {
    let [red, green, blue] = rgb.map(|value| (value + DARK).ln());
    [0.299 * red + 0.587 * green + 0.114 * blue, red - green, blue - green]
}

/// The energies of a frame's luma.
struct Texture {
    bank: GaborBank,
    planes: Vec<GreyPlane>,
    bands: Vec<Band>,
    cell_px: f32,
}

/// Sums of a difference of Gaussians, squared, and of the smoothed luma.
struct Band {
    energy: SumTable,
    luma: SumTable,
}

impl Texture {
    fn new(frame: &RgbImage, cell_px: f32) -> Self {
        let full = GreyPlane::luma(frame);
        let half = full.halved();
        let quarter = half.halved();
        let (mut bands, mut level) = (Vec::with_capacity(BANDS), full.clone());
        for _ in 0..BANDS {
            let smooth = level.filtered(&GAUSSIAN);
            let squares = level.grey.iter().zip(&smooth.grey).map(|(sharp, smooth)| (sharp - smooth).powi(2));
            bands.push(Band {
                energy: SumTable::new(level.width, squares),
                luma: SumTable::new(level.width, smooth.grey.iter().copied()),
            });
            level = smooth.halved();
        }
        Self { bank: GaborBank::new(), planes: vec![full, half, quarter], bands, cell_px }
    }

    /// Writes the energies of the bands, then those of the Gabor filters.
    fn measure(&self, u: f32, v: f32, values: &mut [f64]) {
        let relative = |energy: f64, mean: f64| (energy / (mean * mean + DIM) + FLAT).ln();
        let mut zoom = 1.0;
        for (value, band) in values[..BANDS].iter_mut().zip(&self.bands) {
            let radius = ((0.5 * self.cell_px * zoom).round() as usize).max(1);
            let (x, y) = ((u * zoom) as usize, (v * zoom) as usize);
            *value = relative(band.energy.mean(x, y, radius), band.luma.mean(x, y, radius));
            zoom *= 0.5;
        }
        let mut zoom = 1.0;
        for (value, plane) in values[BANDS..BANDS + SCALES].iter_mut().zip(&self.planes) {
            let (power, mean) = self.bank.power(plane, u * zoom, v * zoom);
            *value = relative(f64::from(power), f64::from(mean));
            zoom *= 0.5;
        }
    }
}

/// Sums over all rectangles from the top left corner, for means over any rectangle.
struct SumTable {
    width: usize,
    height: usize,
    sums: Vec<f64>,
}

impl SumTable {
    fn new(width: usize, values: impl Iterator<Item = f32>) -> Self {
        let mut sums = vec![0.0; width + 1];
        let (mut line, mut x) = (0.0, 0);
        for value in values {
            if x == 0 {
                line = 0.0;
                sums.push(0.0);
            }
            line += f64::from(value);
            sums.push(line + sums[sums.len() - width - 1]);
            x = (x + 1) % width;
        }
        Self { width, height: sums.len() / (width + 1) - 1, sums }
    }

    /// The mean over the square of 2 `radius` + 1 pixels around a pixel, cut off at the border.
    fn mean(&self, x: usize, y: usize, radius: usize) -> f64 {
        let (x, y) = (x.min(self.width - 1), y.min(self.height - 1));
        let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(self.width));
        let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(self.height));
        let at = |x: usize, y: usize| self.sums[y * (self.width + 1) + x];
        let sum = at(right, bottom) - at(left, bottom) - at(right, top) + at(left, top);
        sum.max(0.0) / ((right - left) * (bottom - top)) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::Rgb;

    fn speckled(exposure: f32) -> RgbImage {
        RgbImage::from_fn(160, 120, |x, y| {
            let bits = crate::random::mix(u64::from(x / 3) << 8 | u64::from(y / 3));
            let tone = |shift: u64| exposure * (40.0 + (bits >> shift) as u8 as f32 / 4.0);
            Rgb([tone(0) as u8, tone(8) as u8, tone(16) as u8])
        })
    }

    #[test]
    fn an_exposure_shifts_the_brightness_alone() {
        let [dark, bright] = [speckled(1.0), speckled(2.0)].map(|frame| measure(&frame, 24.0));
        let middle = dark.len() / 2;
        let shift: Vec<f64> = (0..MEASURES).map(|k| bright[middle].values[k] - dark[middle].values[k]).collect();
        assert!((shift[0] - 2f64.ln()).abs() < 0.05, "{shift:?}");
        assert!(shift[1..].iter().all(|shift| shift.abs() < 0.15), "{shift:?}");
    }

    #[test]
    fn a_mean_is_that_of_its_square() {
        let table = SumTable::new(5, (0..20).map(|i| i as f32));
        assert_eq!((table.height, table.mean(2, 1, 1)), (4, 7.0));
        assert_eq!(table.mean(0, 0, 1), (0.0 + 1.0 + 5.0 + 6.0) / 4.0);
        assert_eq!(table.mean(90, 90, 0), 19.0);
    }

    #[test]
    fn frames_of_any_size_are_measured_without_infinities() {
        for (width, height) in [(0, 0), (1, 1), (1, 90), (3, 2), (64, 48)] {
            let points = measure(&RgbImage::new(width, height), 8.0);
            assert_eq!(points.is_empty(), width == 0);
            assert!(points.iter().all(|point| point.values.iter().all(|value| value.is_finite())));
        }
        assert!(measure(&RgbImage::new(9, 9), f32::NAN).is_empty());
    }
}
