//! A camera frame as it is compared with others: small, grey, high-passed, of unit contrast.

use crate::camera_image::CameraImage;
use crate::flat_field::FlatField;
use crate::plane::Plane;
use serde::{Deserialize, Serialize};

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

#[cfg(test)]
mod tests {
    use super::*;

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
}
