//! A camera frame as a grey image, as the small high-passed one that is compared with others, and the mean brightness at each
//! place of frames.

use crate::plane::Plane;
use serde::{Deserialize, Serialize};

/// Pixels of a reduced frame, about: 160 x 120 for a frame of 4 : 3.
const REDUCED_PX: f64 = 19_200.0;
/// The narrowest frame that is reduced, pixels: a narrower one has no room for a match.
const MIN_SIDE_PX: usize = 32;

/// The bytes of a frame, row by row from the top, one or three of them for each pixel.
#[derive(Debug, Clone, Copy)]
pub struct CameraImage<'a> {
    columns: usize,
    rows: usize,
    channels: usize,
    samples: &'a [u8],
}

impl<'a> CameraImage<'a> {
    /// A grey frame; `None` if the number of bytes is not `columns` x `rows`.
    pub fn grey(columns: usize, rows: usize, samples: &'a [u8]) -> Option<Self> {
        Self::new(columns, rows, 1, samples)
    }

    /// A colour frame; `None` if the number of bytes is not 3 x `columns` x `rows`.
    pub fn rgb(columns: usize, rows: usize, samples: &'a [u8]) -> Option<Self> {
        Self::new(columns, rows, 3, samples)
    }

    fn new(columns: usize, rows: usize, channels: usize, samples: &'a [u8]) -> Option<Self> {
        let bytes = columns.checked_mul(rows)?.checked_mul(channels)?;
        (samples.len() == bytes).then_some(Self { columns, rows, channels, samples })
    }

    /// Pixels of the frame in an edge of a pixel of the reduced plane. It is not rounded: a rounded one would be a
    /// scale error.
    pub(crate) fn reduction(&self) -> f64 {
        ((self.columns as f64 * self.rows as f64) / REDUCED_PX).sqrt().max(1.0)
    }

    /// The mean brightness, 0 to 255, in each pixel of the reduced plane, which has the middle of the frame; `None` for
    /// a frame that is too narrow.
    pub(crate) fn reduced(&self) -> Option<Plane> {
        let step = self.reduction();
        // Even numbers, so that a plane of half the size has the same middle.
        let even = |pixels: usize| (pixels as f64 / step / 2.0) as usize * 2;
        let (columns, rows) = (even(self.columns), even(self.rows));
        if columns < MIN_SIDE_PX || rows < MIN_SIDE_PX {
            return None;
        }
        let left = (self.columns as f64 - columns as f64 * step) / 2.0;
        let top = (self.rows as f64 - rows as f64 * step) / 2.0;
        let mut plane = Plane::new(columns, rows);
        let mut sums = vec![0u32; self.columns + 1];
        let mut line = vec![0.0f32; columns];
        let across: Vec<f64> = (0..=columns).map(|i| left + i as f64 * step).collect();
        for y in 0..self.rows {
            let (from, to) = ((y as f64 - top) / step, (y as f64 + 1.0 - top) / step);
            if to <= 0.0 || from >= rows as f64 {
                continue;
            }
            self.sum_row(y, &mut sums);
            reduce_row(&sums, &across, &mut line);
            // A row of the frame lies in at most two rows of the plane, as a step is at least 1.
            for row in (from.max(0.0) as usize)..(to.ceil() as usize).min(rows) {
                let share = to.min(row as f64 + 1.0) - from.max(row as f64);
                let weight = share.max(0.0) as f32;
                plane.row_mut(row).iter_mut().zip(&line).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        Some(plane)
    }

    /// The sums of the brightness of a row before each pixel.
    fn sum_row(&self, y: usize, sums: &mut [u32]) {
        let line = &self.samples[y * self.columns * self.channels..][..self.columns * self.channels];
        let mut sum = 0;
        if self.channels == 1 {
            for (at, &value) in sums[1..].iter_mut().zip(line) {
                sum += 4 * u32::from(value);
                *at = sum;
            }
        } else {
            for (at, pixel) in sums[1..].iter_mut().zip(line.as_chunks::<3>().0) {
                sum += u32::from(pixel[0]) + 2 * u32::from(pixel[1]) + u32::from(pixel[2]);
                *at = sum;
            }
        }
    }
}

/// The means of a row between the positions `across`, from its sums of four times the brightness.
fn reduce_row(sums: &[u32], across: &[f64], line: &mut [f32]) {
    let sum_before = |at: f64| {
        let whole = (at as usize).min(sums.len() - 2);
        let (low, high) = (f64::from(sums[whole]), f64::from(sums[whole + 1]));
        low + (high - low) * (at - whole as f64)
    };
    let mut before = sum_before(across[0]);
    for (value, bounds) in line.iter_mut().zip(across.windows(2)) {
        let next = sum_before(bounds[1]);
        *value = ((next - before) / (4.0 * (bounds[1] - bounds[0]))) as f32;
        before = next;
    }
}

/// Reach of the high-pass, pixels: three means over 2 x 7 + 1 pixels are about a Gaussian of 7.5 pixels.
const HIGH_PASS_PX: usize = 7;
/// A frame whose high-passed logarithm has a smaller root mean square has no texture.
const MIN_CONTRAST: f32 = 0.004;
/// Values beyond so many times the contrast are cut: snow and glints.
const MAX_VALUE: f32 = 3.0;
/// Steps of a stored value in a unit of contrast.
const STEPS: f32 = 40.0;

/// A reduced frame as bytes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Thumbnail {
    columns: u16,
    /// Edge of a pixel on the sea floor by the altitude, metres.
    pitch_m: f64,
    values: Vec<i8>,
}

impl Thumbnail {
    /// The largest number of pixels.
    const MAX_PX: usize = 20_000;

    /// Reduces a frame whose pixels measure `metres_per_pixel`, and learns its light. `None` without texture.
    pub(crate) fn new(image: &CameraImage, metres_per_pixel: f64, flat: &mut FlatField) -> Option<Self> {
        let mut logs = image.reduced()?;
        logs.values_mut().iter_mut().for_each(|value| *value = (*value + 1.0).ln());
        let mut level = flat.level(&logs);
        let blurred = level.blurred(HIGH_PASS_PX);
        level.values_mut().iter_mut().zip(blurred.values()).for_each(|(value, mean)| *value -= mean);
        let contrast = level.rms();
        if contrast.is_nan() || contrast < MIN_CONTRAST {
            return None;
        }
        let step = |value: &f32| ((value / contrast).clamp(-MAX_VALUE, MAX_VALUE) * STEPS).round() as i8;
        Some(Self {
            columns: level.columns() as u16,
            pitch_m: metres_per_pixel * image.reduction(),
            values: level.values().iter().map(step).collect(),
        })
    }

    /// Columns and rows of the finer plane, metres to the right and ahead.
    pub(crate) fn extent_m(&self) -> [f64; 2] {
        let columns = usize::from(self.columns);
        [columns as f64 * self.pitch_m, (self.values.len() / columns) as f64 * self.pitch_m]
    }

    pub(crate) fn unpacked(&self) -> Option<Scales> {
        let values = self.values.iter().map(|&value| f32::from(value) / STEPS).collect();
        let fine = Plane::from_values(usize::from(self.columns), values)?;
        Some(Scales { coarse: fine.halved(), fine, pitch_m: self.pitch_m })
    }

    pub(crate) fn is_sound(&self) -> bool {
        let columns = usize::from(self.columns);
        let is_whole = columns >= 32 && self.values.len() >= 32 * columns && self.values.len().is_multiple_of(columns);
        is_whole && self.values.len() <= Self::MAX_PX && self.pitch_m > 1e-7 && self.pitch_m < 1e3
    }
}

/// A thumbnail at two scales: pixels of the coarse one are twice as large.
#[derive(Debug, Clone)]
pub(crate) struct Scales {
    pub(crate) fine: Plane,
    pub(crate) coarse: Plane,
    /// Edge of a fine pixel on the sea floor by the altitude, metres.
    pub(crate) pitch_m: f64,
}

/// Frames that the running mean remembers. Without it, dirt on the lens is matched where the floor has no texture.
const FRAMES: u16 = 40;
/// Frames after which half of the mean is removed: before, it is the sea floor's own.
const HALF_FRAMES: f32 = 6.0;

/// A running mean of the logarithm of the brightness.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct FlatField {
    frames: u16,
    columns: u16,
    mean: Vec<f32>,
}

impl FlatField {
    /// Learns from a frame and returns it as an even light would show it. A frame of another size starts again.
    pub(crate) fn level(&mut self, logs: &Plane) -> Plane {
        if usize::from(self.columns) != logs.columns() || self.mean.len() != logs.values().len() {
            *self = Self { frames: 0, columns: logs.columns() as u16, mean: vec![0.0; logs.values().len()] };
        }
        self.frames = (self.frames + 1).min(FRAMES);
        let step = 1.0 / f32::from(self.frames);
        let share = f32::from(self.frames) / (f32::from(self.frames) + HALF_FRAMES);
        let mut level = logs.clone();
        for (value, mean) in level.values_mut().iter_mut().zip(&mut self.mean) {
            *mean += step * (*value - *mean);
            *value -= share * *mean;
        }
        level
    }

    /// Whether the numbers can be those of frames.
    pub(crate) fn is_sound(&self) -> bool {
        self.frames <= FRAMES && self.mean.len() <= 65_536 && self.mean.iter().all(|mean| mean.abs() < 100.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_reduced_by_a_ratio_that_is_not_rounded() {
        let slope: Vec<u8> = (0..1024).flat_map(|_| (0..1360u32).map(|x| (x / 8) as u8)).collect();
        let image = CameraImage::grey(1360, 1024, &slope).unwrap();
        let plane = image.reduced().unwrap();
        assert!((image.reduction() - 8.5166).abs() < 1e-3, "{}", image.reduction());
        let rise = (plane.row(60)[140] - plane.row(60)[20]) / 120.0 * 8.0;
        assert!((f64::from(rise) - image.reduction()).abs() < 0.02, "{rise} pixels of the frame in one of the plane");
    }

    #[test]
    fn the_mean_brightness_of_a_frame_stays() {
        let grey: Vec<u8> = (0..640 * 480u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let colour: Vec<u8> = grey.iter().flat_map(|&value| [value; 3]).collect();
        let mean = grey.iter().map(|&value| f64::from(value)).sum::<f64>() / grey.len() as f64;
        let grey = CameraImage::grey(640, 480, &grey).unwrap().reduced().unwrap();
        let colour = CameraImage::rgb(640, 480, &colour).unwrap().reduced().unwrap();
        assert_eq!((grey.columns(), grey.rows()), (160, 120));
        let reduced = f64::from(grey.values().iter().sum::<f32>()) / grey.values().len() as f64;
        assert!((reduced - mean).abs() < 0.1, "{reduced} {mean}");
        assert_eq!(grey.values(), colour.values());
    }

    #[test]
    fn frames_of_wrong_length_or_too_narrow_are_refused() {
        assert!(CameraImage::grey(10, 10, &[0; 99]).is_none());
        assert!(CameraImage::rgb(usize::MAX, 2, &[0; 6]).is_none());
        assert!(CameraImage::grey(0, 0, &[]).unwrap().reduced().is_none());
        assert!(CameraImage::grey(4000, 20, &[7; 80_000]).unwrap().reduced().is_none());
    }

    #[test]
    fn an_even_frame_has_no_texture() {
        let mut flat = FlatField::default();
        let even = vec![90u8; 640 * 480];
        let image = CameraImage::grey(640, 480, &even).unwrap();
        assert!(Thumbnail::new(&image, 0.01, &mut flat).is_none());
    }

    #[test]
    fn contrast_and_brightness_do_not_change_a_thumbnail() {
        let of = |gain: f64| {
            let value = |i: usize| {
                (gain * (60.0 + 30.0 * ((i % 640) as f64 / 9.0).sin() + 20.0 * ((i / 640) as f64 / 14.0).cos())) as u8
            };
            let samples: Vec<u8> = (0..640 * 480).map(value).collect();
            let image = CameraImage::grey(640, 480, &samples).unwrap();
            Thumbnail::new(&image, 0.01, &mut FlatField::default()).unwrap()
        };
        let (bright, dark) = (of(1.5), of(0.7));
        let off: i32 = bright.values.iter().zip(&dark.values).map(|(a, b)| (i32::from(*a) - i32::from(*b)).abs()).sum();
        assert!(off < 2 * bright.values.len() as i32, "{off} steps");
        assert!(bright.is_sound());
        assert_eq!((bright.extent_m(), bright.unpacked().unwrap().coarse.columns()), ([6.4, 4.8], 80));
    }

    #[test]
    fn dirt_on_the_lens_fades_from_the_frames() {
        let mut flat = FlatField::default();
        let dirty = |moment: usize| {
            let value =
                |i: usize| if i.is_multiple_of(7) { -1.0 } else { 0.0 } + ((i * 31 + moment * 17) % 13) as f32 * 0.02;
            Plane::from_values(40, (0..1200).map(value).collect()).unwrap()
        };
        let contrast = |plane: &Plane| (plane.row(3)[1] - plane.row(3)[13]).abs();
        let first = flat.level(&dirty(0));
        let last = (1..100).map(|moment| flat.level(&dirty(moment))).last().unwrap();
        assert!(contrast(&first) < 1.1 && last.rms() < 0.35 * first.rms(), "{} {}", first.rms(), last.rms());
        let other = Plane::new(50, 40);
        assert_eq!(flat.level(&other).values().len(), 2000, "another camera");
        assert!(flat.is_sound());
    }
}
