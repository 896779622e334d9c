//! Exemplars: their size, their compression to small WebP images for the link, and the structural similarity (SSIM) that measures
//! it.
//!
//! Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, "Image quality assessment: from error visibility to structural
//! similarity", IEEE Transactions on Image Processing 13, 2004. It is computed on luma (ITU-R BT.601) with a Gaussian
//! window of 11 x 11 pixels and a standard deviation of 1.5, K1 = 0.01, K2 = 0.03 and L = 255, as the mean over all
//! places at which the window lies inside the image. `structural_similarity(data_range=255, gaussian_weights=True,
//! sigma=1.5, use_sample_covariance=False)` of scikit-image gives the same values.

use image::{RgbImage, imageops};
use scenecast_protocol::exemplar::{edge_px, strip, unstrip};

/// The structural similarity beyond which more bytes bring no visible gain.
pub const GOOD_SSIM: f64 = 0.9;

/// The size class of the middle of a patch, at most `size`.
pub fn middle_size(patch: &RgbImage, size: u8) -> Option<u8> {
    let least = patch.width().min(patch.height());
    (0..=size.min(3)).rev().find(|&s| edge_px(s) <= least)
}

/// Crops the middle of a patch to at most the edge of `size`, and returns the size class that it has.
pub fn middle(patch: &RgbImage, size: u8) -> Option<(u8, RgbImage)> {
    let size = middle_size(patch, size)?;
    let edge = edge_px(size);
    let (x, y) = ((patch.width() - edge) / 2, (patch.height() - edge) / 2);
    Some((size, imageops::crop_imm(patch, x, y, edge, edge).to_image()))
}

#[derive(Debug, Clone, PartialEq)]
pub struct Compressed {
    pub bytes: Vec<u8>,
    /// Structural similarity with the patch, -1 to 1.
    pub ssim: f64,
}

/// Compresses a square patch with a quality of 0 to 100.
pub fn compress(patch: &RgbImage, quality: u8) -> Option<Compressed> {
    // Measured on 156 patches of reef photos at SSIM 0.9: one segment is 4 % smaller than four, and the most thorough
    // search is 3 % smaller than the default. Sharp chroma, other filters and noise shaping have no effect.
    let mut config = webp::WebPConfig::new().ok()?;
    config.quality = f32::from(quality.min(100));
    (config.method, config.segments, config.sns_strength) = (6, 1, 0);
    let encoder = webp::Encoder::from_rgb(patch.as_raw(), patch.width(), patch.height());
    let file = encoder.encode_advanced(&config).ok()?;
    let bytes = strip(&file)?;
    let shown = decode_webp(&unstrip(&bytes, patch.width() as u16)?)?;
    Some(Compressed { bytes, ssim: Luma::of(patch).ssim(&Luma::of(&shown)) })
}

/// The shortest file with at least the similarity `ssim`, if it has at most `most` bytes; otherwise the most similar
/// file of at most `most` bytes; otherwise the shortest of all. `None` if the patch cannot be compressed.
pub fn compress_to(patch: &RgbImage, ssim: f64, most: usize) -> Option<Compressed> {
    // Bytes and similarity grow with the quality, up to a percent, so that seven steps of bisection find it.
    let is_enough = |c: &Compressed| c.ssim >= ssim || c.bytes.len() > most;
    let (mut low, mut high) = (0, 100);
    let mut best = compress(patch, 0)?;
    while low < high {
        let quality = (low + high) / 2;
        let tried = compress(patch, quality)?;
        (low, high) = if is_enough(&tried) { (low, quality) } else { (quality + 1, high) };
        if is_better(&tried, &best, ssim, most) {
            best = tried;
        }
    }
    Some(best)
}

fn is_better(a: &Compressed, b: &Compressed, ssim: f64, most: usize) -> bool {
    let fits = |c: &Compressed| c.bytes.len() <= most;
    let reaches = |c: &Compressed| c.ssim >= ssim;
    match (fits(a), fits(b)) {
        (true, true) if reaches(a) && reaches(b) => a.bytes.len() < b.bytes.len(),
        (true, true) => a.ssim > b.ssim,
        (false, false) => a.bytes.len() < b.bytes.len(),
        (fits, _) => fits,
    }
}

/// Decodes a WebP file without transparency.
pub fn decode_webp(file: &[u8]) -> Option<RgbImage> {
    let image = webp::Decoder::new(file).decode().filter(|i| !i.is_alpha())?;
    RgbImage::from_raw(image.width(), image.height(), image.to_vec())
}

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
    use scenecast_protocol::exemplar::{Exemplar, ExemplarView, max_bytes};

    #[test]
    fn an_image_fits_its_budget_and_decodes_at_the_other_end() {
        let patch = RgbImage::from_fn(128, 128, |x, y| image::Rgb([(x * 2) as u8, (y * 2) as u8, ((x ^ y) * 2) as u8]));
        for size in [0, 1, 2] {
            let (cut, small) = middle(&patch, size).unwrap();
            assert_eq!((u32::from(cut), small.width()), (u32::from(size.min(1)), edge_px(cut)));
            let bytes = compress_to(&small, GOOD_SSIM, max_bytes(cut)).unwrap().bytes;
            let sent =
                Exemplar { epoch: 1, label: 5, serial: 2, size: cut, picture: 1, view: ExemplarView::default(), bytes };
            assert!(sent.encode().len() <= 700 << (2 * cut));
            let file = Exemplar::decode(&sent.encode()).unwrap().webp().unwrap();
            assert_eq!(decode_webp(&file).unwrap().width(), edge_px(cut));
        }
        assert_eq!(middle(&RgbImage::new(63, 80), 0), None);
    }

    fn patch(edge: u32, roughness: u32) -> RgbImage {
        let value =
            |x: u32, y: u32| 90 + (x + y) * 60 / edge + (x * 7919 + y * 104_729 + x * y * 31) % 97 * roughness / 97;
        RgbImage::from_fn(edge, edge, |x, y| {
            image::Rgb([value(x, y) as u8, value(y, x) as u8, (40 + x * 50 / edge) as u8])
        })
    }

    #[test]
    fn a_stripped_file_is_restored_byte_for_byte() {
        for edge in [64, 128] {
            let patch = patch(edge, 30);
            let file = webp::Encoder::from_rgb(patch.as_raw(), edge, edge).encode(50.0).to_vec();
            let bytes = strip(&file).unwrap();
            assert!(file.len() - bytes.len() >= 27, "{} of {} bytes", bytes.len(), file.len());
            assert_eq!(unstrip(&bytes, edge as u16), Some(file));
        }
        assert_eq!(strip(b"RIFF\x04\0\0\0WEBPVP8L"), None);
    }

    #[test]
    fn compression_stops_at_the_similarity_and_the_byte_limit() {
        let smooth = patch(64, 20);
        let enough = compress_to(&smooth, 0.9, 700).unwrap();
        assert!(enough.ssim >= 0.9 && enough.bytes.len() <= 700, "{} at {}", enough.bytes.len(), enough.ssim);
        let better = compress_to(&smooth, 0.95, 700).unwrap();
        assert!(better.bytes.len() > enough.bytes.len(), "{} after {}", better.bytes.len(), enough.bytes.len());
        let rough = patch(64, 97);
        let bounded = compress_to(&rough, 0.99, 500).unwrap();
        assert!(bounded.bytes.len() <= 500 && bounded.ssim < 0.99, "{} at {}", bounded.bytes.len(), bounded.ssim);
        let tighter = compress_to(&rough, 0.99, 300).unwrap();
        assert!(tighter.ssim < bounded.ssim && tighter.bytes.len() <= 300);
    }

    #[test]
    fn any_bytes_make_a_file_that_is_decoded_or_refused() {
        let good = compress(&patch(64, 30), 30).unwrap().bytes;
        for at in 0..good.len() {
            let mut bytes = good.clone();
            bytes[at] ^= 0x55;
            bytes.truncate(good.len() - at / 2);
            let _ = unstrip(&bytes, 64).and_then(|file| decode_webp(&file));
        }
        for wrong in [&[1, 2][..], &[0x11, 0, 0, 9], &[0x00, 0, 0, 9], &[0x1E, 0, 0, 9], &[0x50, 0, 0, 9]] {
            assert_eq!(unstrip(wrong, 64), None, "{wrong:?}");
        }
        assert!(unstrip(&[0x10, 0, 0, 9], 64).is_some());
    }

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
