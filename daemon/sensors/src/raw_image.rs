//! Raw pixels in the encodings of ROS 2 (`sensor_msgs/image_encodings.hpp`): Bayer mosaics, and levels of 10, 12 or 14 bits.

use crate::MAX_PIXELS;
use image::{Rgb, RgbImage};

/// A raw image as it came in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RawImage<'a> {
    pub width: u32,
    pub height: u32,
    /// Name of the encoding, as `rgb8` or `bayer_rggb16`.
    pub encoding: &'a str,
    pub is_bigendian: bool,
    /// Bytes from one row to the next.
    pub step: u32,
    pub data: &'a [u8],
}

/// A raw image that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RawImageError {
    #[error(
        "the encoding {0:?} is not supported; allowed are mono8, mono16, rgb8, rgba8, bgr8, bgra8, rgb16, rgba16, bgr16, bgra16, 8UC1, 8UC3, 16UC1, 16UC3, uyvy, yuv422, yuyv, yuv422_yuy2, and bayer_rggb8, bayer_bggr8, bayer_gbrg8, bayer_grbg8 with 8 or 16 bits"
    )]
    Encoding(String),
    #[error("the image has {width} x {height} pixels; allowed are 1 to {MAX_PIXELS}")]
    Size { width: u32, height: u32 },
    #[error("{held} bytes are too few for {height} rows of {step} bytes")]
    Short { held: usize, height: u32, step: u32 },
    #[error("a row of {step} bytes is too short for {width} pixels of {encoding}")]
    Step { step: u32, width: u32, encoding: String },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Layout {
    /// Grey, or channels of which those at these indices are red, green and blue.
    Channels {
        count: usize,
        rgb: [usize; 3],
    },
    Bayer(BayerPattern),
    /// Two pixels in four bytes; the index of the first luma byte is 0 or 1.
    Yuv422 {
        luma: usize,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Encoding {
    layout: Layout,
    /// Bytes of one sample of one channel.
    depth: usize,
}

impl Encoding {
    fn parse(name: &str) -> Option<Self> {
        let channels = |count, rgb, depth| Some(Self { layout: Layout::Channels { count, rgb }, depth });
        let (grey, rgb, bgr) = ([0; 3], [0, 1, 2], [2, 1, 0]);
        match name {
            "mono8" | "8UC1" => channels(1, grey, 1),
            "mono16" | "16UC1" => channels(1, grey, 2),
            "rgb8" => channels(3, rgb, 1),
            "rgba8" => channels(4, rgb, 1),
            // OpenCV's order is blue, green, red.
            "bgr8" | "8UC3" => channels(3, bgr, 1),
            "bgra8" | "8UC4" => channels(4, bgr, 1),
            "rgb16" => channels(3, rgb, 2),
            "rgba16" => channels(4, rgb, 2),
            "bgr16" | "16UC3" => channels(3, bgr, 2),
            "bgra16" | "16UC4" => channels(4, bgr, 2),
            "uyvy" | "yuv422" => Some(Self { layout: Layout::Yuv422 { luma: 1 }, depth: 1 }),
            "yuyv" | "yuv422_yuy2" => Some(Self { layout: Layout::Yuv422 { luma: 0 }, depth: 1 }),
            _ => {
                let rest = name.strip_prefix("bayer_")?;
                let (pattern, depth) = match rest.strip_suffix("16") {
                    Some(pattern) => (pattern, 2),
                    None => (rest.strip_suffix('8')?, 1),
                };
                let pattern = match pattern {
                    "rggb" => BayerPattern::Rggb,
                    "bggr" => BayerPattern::Bggr,
                    "gbrg" => BayerPattern::Gbrg,
                    "grbg" => BayerPattern::Grbg,
                    _ => return None,
                };
                Some(Self { layout: Layout::Bayer(pattern), depth })
            }
        }
    }

    fn row_bytes(self, width: usize) -> usize {
        match self.layout {
            Layout::Channels { count, .. } => width * count * self.depth,
            Layout::Bayer(_) => width * self.depth,
            Layout::Yuv422 { .. } => width.div_ceil(2) * 4,
        }
    }
}

impl RawImage<'_> {
    /// The image with 8 bits a channel; of 16 bits, the nearest of 256 levels, of which `bits` gives the highest.
    pub fn to_rgb(&self, bits: &mut BitDepth) -> Result<RgbImage, RawImageError> {
        let encoding =
            Encoding::parse(self.encoding).ok_or_else(|| RawImageError::Encoding(shortened(self.encoding)))?;
        let (width, height, step) = (self.width as usize, self.height as usize, self.step as usize);
        let pixels = u64::from(self.width) * u64::from(self.height);
        if pixels == 0 || pixels > u64::from(MAX_PIXELS) {
            return Err(RawImageError::Size { width: self.width, height: self.height });
        }
        let row_bytes = encoding.row_bytes(width);
        if step < row_bytes {
            let encoding = self.encoding.to_owned();
            return Err(RawImageError::Step { step: self.step, width: self.width, encoding });
        }
        // The last row may end with its last pixel.
        if (self.data.len() as u64) < (height as u64 - 1) * step as u64 + row_bytes as u64 {
            return Err(RawImageError::Short { held: self.data.len(), height: self.height, step: self.step });
        }
        if encoding.depth == 2 {
            bits.learn((0..height).flat_map(|y| (0..row_bytes / 2).map(move |index| self.level(y * step + 2 * index))));
        }
        let bits = *bits;
        let sample = |y: usize, index: usize| match encoding.depth {
            1 => self.data[y * step + index],
            _ => bits.scaled(self.level(y * step + 2 * index)),
        };
        Ok(match encoding.layout {
            Layout::Channels { count, rgb } => RgbImage::from_fn(self.width, self.height, |x, y| {
                Rgb(rgb.map(|channel| sample(y as usize, x as usize * count + channel)))
            }),
            Layout::Bayer(pattern) => pattern.colours(width, height, |x, y| sample(y, x)),
            Layout::Yuv422 { luma } => RgbImage::from_fn(self.width, self.height, |x, y| {
                let (pair, is_second) = (x as usize / 2 * 4, x as usize % 2);
                let at = |index: usize| f32::from(sample(y as usize, pair + index));
                rgb_of_yuv(at(luma + 2 * is_second), at(1 - luma), at(3 - luma))
            }),
        })
    }

    /// The level of 16 bits at a byte.
    fn level(&self, at: usize) -> u16 {
        let pair = [self.data[at], self.data[at + 1]];
        if self.is_bigendian { u16::from_be_bytes(pair) } else { u16::from_le_bytes(pair) }
    }
}

/// The beginning of a text from outside, for a message.
fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}

/// ITU-R BT.601 with the full range of luma, as JPEG and most USB cameras use it.
fn rgb_of_yuv(y: f32, u: f32, v: f32) -> Rgb<u8> {
    let (u, v) = (u - 128.0, v - 128.0);
    let level = |value: f32| value.round().clamp(0.0, 255.0) as u8;
    Rgb([level(y + 1.402 * v), level(y - 0.344_136 * u - 0.714_136 * v), level(y + 1.772 * u)])
}

/// The colours of the first two rows and columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BayerPattern {
    Rggb,
    Bggr,
    Gbrg,
    Grbg,
}

impl BayerPattern {
    /// The colour of the filter over a pixel: 0 red, 1 green, 2 blue.
    fn colour(self, x: usize, y: usize) -> usize {
        let square = match self {
            Self::Rggb => [0, 1, 1, 2],
            Self::Bggr => [2, 1, 1, 0],
            Self::Gbrg => [1, 2, 0, 1],
            Self::Grbg => [1, 0, 2, 1],
        };
        square[(y % 2) * 2 + x % 2]
    }

    /// Each colour of a pixel is the mean of the pixels of that colour among itself and its eight neighbours, where its own
    /// colour counts alone.
    pub(crate) fn colours(self, width: usize, height: usize, grey: impl Fn(usize, usize) -> u8) -> RgbImage {
        let mut image = RgbImage::new(width as u32, height as u32);
        for y in 0..height {
            for x in 0..width {
                let (mut sums, mut counts) = ([0_u32; 3], [0_u32; 3]);
                for v in y.saturating_sub(1)..(y + 2).min(height) {
                    for u in x.saturating_sub(1)..(x + 2).min(width) {
                        let colour = self.colour(u, v);
                        sums[colour] += u32::from(grey(u, v));
                        counts[colour] += 1;
                    }
                }
                let own = self.colour(x, y);
                (sums[own], counts[own]) = (u32::from(grey(x, y)), 1);
                let mean = |i: usize| ((sums[i] + counts[i] / 2) / counts[i].max(1)) as u8;
                image.put_pixel(x as u32, y as u32, Rgb([mean(0), mean(1), mean(2)]));
            }
        }
        image
    }
}

/// The bits that the levels of 16-bit images have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitDepth {
    /// White is 2^n - 1.
    Fixed(u8),
    /// The least number of bits, from 8, that holds the levels of all images so far. It never shrinks, so that the images of a
    /// mission are alike once the brightest was seen.
    Auto(u8),
}

impl Default for BitDepth {
    fn default() -> Self {
        Self::Fixed(16)
    }
}

impl BitDepth {
    /// The bits of the setting `camera.bits`, where 0 stands for the automatic choice.
    pub fn of_setting(bits: u8) -> Self {
        if bits == 0 { Self::Auto(8) } else { Self::Fixed(bits.clamp(8, 16)) }
    }

    /// Looks at the levels of an image before they are scaled.
    pub(crate) fn learn(&mut self, levels: impl Iterator<Item = u16>) {
        if let Self::Auto(bits) = self {
            let highest = levels.max().unwrap_or_default();
            *bits = (*bits).max((16 - highest.leading_zeros()) as u8);
        }
    }

    /// A level in 8 bits, the nearest of 256; levels above white are white.
    pub(crate) fn scaled(self, level: u16) -> u8 {
        let (Self::Fixed(bits) | Self::Auto(bits)) = self;
        let white = (1_u32 << bits) - 1;
        ((u32::from(level).min(white) * 255 + white / 2) / white) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn image<'a>(encoding: &'a str, (width, height): (u32, u32), step: u32, data: &'a [u8]) -> RawImage<'a> {
        RawImage { width, height, encoding, is_bigendian: false, step, data }
    }

    #[test]
    fn channels_are_put_in_order_and_rows_may_be_padded() {
        let rgb = image("rgb8", (1, 2), 4, &[1, 2, 3, 0, 4, 5, 6]).to_rgb(&mut BitDepth::default()).unwrap();
        assert_eq!(rgb.into_raw(), [1, 2, 3, 4, 5, 6]);
        assert_eq!(
            image("bgra8", (1, 1), 4, &[1, 2, 3, 9]).to_rgb(&mut BitDepth::default()).unwrap().into_raw(),
            [3, 2, 1]
        );
        assert_eq!(
            image("mono8", (2, 1), 2, &[7, 8]).to_rgb(&mut BitDepth::default()).unwrap().into_raw(),
            [7, 7, 7, 8, 8, 8]
        );
    }

    #[test]
    fn sixteen_bits_become_eight_in_either_byte_order() {
        let mut mono = image("mono16", (2, 1), 4, &[0xFF, 0xFF, 0x00, 0x80]);
        assert_eq!(mono.to_rgb(&mut BitDepth::default()).unwrap().into_raw(), [255, 255, 255, 128, 128, 128]);
        mono.is_bigendian = true;
        assert_eq!(mono.to_rgb(&mut BitDepth::default()).unwrap().into_raw(), [255, 255, 255, 0, 0, 0]);
    }

    #[test]
    fn twelve_bits_in_sixteen_fill_the_eight() {
        let mono = image("mono16", (2, 1), 4, &[0xFF, 0x0F, 0x00, 0x08]);
        assert_eq!(mono.to_rgb(&mut BitDepth::of_setting(12)).unwrap().into_raw(), [255, 255, 255, 128, 128, 128]);
        let mut automatic = BitDepth::of_setting(0);
        assert_eq!(mono.to_rgb(&mut automatic).unwrap().into_raw()[3], 128);
        let dark = image("mono16", (1, 1), 2, &[0x00, 0x02]);
        assert_eq!(dark.to_rgb(&mut automatic).unwrap().into_raw()[0], 32, "a dark image stays dark");
        assert_eq!(image("mono8", (1, 1), 1, &[9]).to_rgb(&mut automatic).unwrap().into_raw()[0], 9);
    }

    #[test]
    fn a_grey_yuv_image_stays_grey() {
        assert_eq!(
            image("uyvy", (2, 1), 4, &[128, 10, 128, 20]).to_rgb(&mut BitDepth::default()).unwrap().into_raw(),
            [10, 10, 10, 20, 20, 20]
        );
        assert_eq!(
            image("yuyv", (2, 1), 4, &[10, 128, 20, 128]).to_rgb(&mut BitDepth::default()).unwrap().into_raw(),
            [10, 10, 10, 20, 20, 20]
        );
    }

    #[test]
    fn images_that_do_not_fit_their_header_are_named() {
        let text = |image: RawImage<'_>| image.to_rgb(&mut BitDepth::default()).unwrap_err().to_string();
        assert!(text(image("nv21", (1, 1), 3, &[0; 3])).contains("\"nv21\" is not supported; allowed are mono8"));
        assert!(text(image("rgb8", (0, 5), 0, &[])).contains("0 x 5 pixels"));
        assert!(text(image("rgb8", (2, 2), 6, &[0; 11])).contains("11 bytes are too few for 2 rows of 6 bytes"));
        assert!(text(image("rgb8", (2, 2), 5, &[0; 99])).contains("5 bytes is too short for 2 pixels of rgb8"));
        assert!(text(image("mono8", (u32::MAX, u32::MAX), u32::MAX, &[])).contains("allowed are 1 to"));
    }

    proptest! {
        #[test]
        fn any_header_gives_an_image_or_an_error(width in 0_u32..40, height in 0_u32..40, step in 0_u32..200,
            encoding in prop::sample::select(vec!["rgb8", "mono16", "bayer_grbg16", "bayer_rggb8", "uyvy", "bgra16", "x"]),
            data in prop::collection::vec(any::<u8>(), 0..4000)) {
            if let Ok(rgb) = image(encoding, (width, height), step, &data).to_rgb(&mut BitDepth::default()) {
                prop_assert_eq!(rgb.dimensions(), (width, height));
            }
        }
    }

    #[test]
    fn an_even_colour_is_recovered_from_each_pattern() {
        for pattern in [BayerPattern::Rggb, BayerPattern::Bggr, BayerPattern::Gbrg, BayerPattern::Grbg] {
            let image = pattern.colours(6, 5, |x, y| [200, 100, 50][pattern.colour(x, y)]);
            assert!(image.pixels().all(|pixel| pixel.0 == [200, 100, 50]), "{pattern:?}");
        }
    }

    #[test]
    fn levels_are_scaled_to_their_white() {
        let fixed = |bits, level| BitDepth::of_setting(bits).scaled(level);
        assert_eq!(
            [fixed(12, 4095), fixed(12, 2048), fixed(12, 9999), fixed(10, 512), fixed(8, 77)],
            [255, 128, 255, 128, 77]
        );
        for level in 0..=u16::MAX {
            assert_eq!(u32::from(fixed(16, level)), (u32::from(level) + 128) / 257, "{level}");
        }
    }

    #[test]
    fn the_automatic_choice_only_grows() {
        let mut bits = BitDepth::of_setting(0);
        let mut after = |highest: u16| {
            bits.learn([3, highest].into_iter());
            bits
        };
        assert_eq!([after(0), after(700), after(90), after(4000)], [8, 10, 10, 12].map(BitDepth::Auto));
    }
}
