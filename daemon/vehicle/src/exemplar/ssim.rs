//! The structural similarity index (SSIM) of two images.
//!
//! Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", IEEE Transactions on Image Processing 13, 2004. It is computed on luma (ITU-R BT.601) with a Gaussian
//! window of 11 x 11 pixels and a standard deviation of 1.5, K1 = 0.01, K2 = 0.03 and L = 255, as the mean over all
//! places at which the window lies inside the image. `structural_similarity(data_range=255, gaussian_weights=True,
//! sigma=1.5, use_sample_covariance=False)` of scikit-image gives the same values.

use image::RgbImage;

const WINDOW: usize = 11;
const SIGMA: f64 = 1.5;
/// (K1 L)^2 and (K2 L)^2.
const STEADY: (f64, f64) = (0.01 * 255.0 * 0.01 * 255.0, 0.03 * 255.0 * 0.03 * 255.0);

/// The luma of an image, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Luma {
    width: usize,
    values: Vec<f64>,
}

impl Luma {
    /// Converts an image to luma (ITU-R BT.601), 0 to 255.
    pub fn of(image: &RgbImage) -> Self {
        let luma =
            |p: &image::Rgb<u8>| 0.299 * f64::from(p.0[0]) + 0.587 * f64::from(p.0[1]) + 0.114 * f64::from(p.0[2]);
        Self { width: image.width() as usize, values: image.pixels().map(luma).collect() }
    }

    /// Mean structural similarity with an image of the same size, -1 to 1; 0 for images smaller than the window.
    pub fn ssim(&self, other: &Self) -> f64 {
        let height = self.values.len() / self.width.max(1);
        if (self.width, self.values.len()) != (other.width, other.values.len()) || self.width.min(height) < WINDOW {
            return 0.0;
        }
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
        let mean = |values: &[f64]| smooth(values, self.width);
        let (a, b) = (&self.values[..], &other.values[..]);
        let (mean_a, mean_b) = (mean(a), mean(b));
        let (square_a, square_b, both) = (mean(&product(a, a)), mean(&product(b, b)), mean(&product(a, b)));
        let at = |i: usize| {
            let (ma, mb) = (mean_a[i], mean_b[i]);
            let (va, vb, cov) = (square_a[i] - ma * ma, square_b[i] - mb * mb, both[i] - ma * mb);
            let (c1, c2) = STEADY;
            (2.0 * ma * mb + c1) * (2.0 * cov + c2) / ((ma * ma + mb * mb + c1) * (va + vb + c2))
        };
        (0..mean_a.len()).map(at).sum::<f64>() / mean_a.len() as f64
    }
}

/// The weighted mean under the window at each place at which it lies inside the image.
fn smooth(values: &[f64], width: usize) -> Vec<f64> {
    let weight = |i: usize| (-(i as f64 - 5.0).powi(2) / (2.0 * SIGMA * SIGMA)).exp();
    let sum: f64 = (0..WINDOW).map(weight).sum();
    let weights: [f64; WINDOW] = std::array::from_fn(|i| weight(i) / sum);
    let columns = width + 1 - WINDOW;
    let mut across = Vec::with_capacity(values.len());
    for row in values.chunks_exact(width) {
        across.extend(row.windows(WINDOW).map(|w| weights.iter().zip(w).map(|(w, v)| w * v).sum::<f64>()));
    }
    let mut down = vec![0.0; across.len() - columns * (WINDOW - 1)];
    for (i, weight) in weights.iter().enumerate() {
        down.iter_mut().zip(&across[i * columns..]).for_each(|(sum, v)| *sum += weight * v);
    }
    down
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: impl Fn(u32, u32) -> f64) -> Luma {
        let values = (0..24 * 24).map(|i| value(i % 24, i / 24)).collect();
        Luma { width: 24, values }
    }

    /// Values of scikit-image 0.26 over the places at which the window lies inside the image.
    #[test]
    fn values_equal_those_of_scikit_image() {
        let wave = |x: u32, y: u32| f64::from((x * 9 + y * 5 + (x * y) % 17 * 4) % 256);
        let noisy = |x: u32, y: u32| {
            let noise = f64::from((x * 31 + y * 17) % 23);
            (wave(x, y) * 0.8 + 20.0 + noise - 11.0).round_ties_even().clamp(0.0, 255.0)
        };
        let same = |luma: &Luma, known: f64| {
            let found = grey(wave).ssim(luma);
            assert!((found - known).abs() < 1e-9, "{found} instead of {known}");
        };
        same(&grey(wave), 1.0);
        same(&grey(noisy), 0.9402517968548557);
        same(&grey(|x, y| 255.0 - wave(x, y)), -0.6768830530076239);
        same(&grey(|_, _| 128.0), 0.06015686451342731);
    }

    #[test]
    fn images_of_other_sizes_are_not_similar() {
        let small = Luma { width: 10, values: vec![1.0; 100] };
        assert_eq!((small.ssim(&small), grey(|_, _| 1.0).ssim(&small)), (0.0, 0.0));
    }
}
