//! The tone stretch: maps the 1st to 99th percentile of each channel to 0 to 1.

use image::RgbImage;
use serde::{Deserialize, Serialize};

use super::grey_plane::GreyPlane;

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

#[cfg(test)]
mod tests {
    use super::*;

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
