//! A camera frame as a grey image, and its reduction to a small plane.

use crate::plane::Plane;

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
}
