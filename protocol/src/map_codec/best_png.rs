//! The smallest PNG files of a label map, to compare the stream with.

use super::LabelRaster;
use std::collections::BTreeMap;

/// Lengths of raw deflate streams of some bytes.
pub trait Deflate {
    /// The length by a fast compressor, at least that of [`Self::shortest`].
    fn quick(&mut self, data: &[u8]) -> usize;
    /// The length by the best compressor.
    fn shortest(&mut self, data: &[u8]) -> usize;
}

/// An image whose quick length is more than the shortest quick one by this factor is not compressed again: the best
/// compressors save 3 to 8 % of a quick stream.
const MAX_QUICK_RATIO: f64 = 1.1;

/// One way to write a map as an indexed PNG.
struct PngImage {
    /// Bytes of the file beside the deflate stream.
    container_bytes: usize,
    scanlines: Vec<u8>,
}

impl LabelRaster {
    /// Bytes of the map as an indexed PNG: filter None, and the best of every depth and palette order that may win.
    ///
    /// The palette holds the values in use only, by value or by frequency; filter None wins on label maps.
    pub fn smallest_png(&self, deflate: &mut impl Deflate) -> usize {
        smallest(&self.png_images(), deflate)
    }

    /// Bytes of the change from `before` as an indexed PNG: the smaller of delta image and its dirty box.
    ///
    /// Pixel 0 = untouched; 0 bytes without a change.
    pub fn smallest_delta_png(&self, before: &Self, deflate: &mut impl Deflate) -> usize {
        if self == before {
            return 0;
        }
        let delta = self.delta_from(before);
        let dirty_box = delta.trimmed();
        let mut images = delta.png_images();
        if dirty_box != delta {
            images.extend(dirty_box.png_images());
        }
        smallest(&images, deflate)
    }

    fn png_images(&self) -> Vec<PngImage> {
        let mut counts: BTreeMap<u8, usize> = BTreeMap::new();
        self.labels.iter().for_each(|&label| *counts.entry(label).or_default() += 1);
        let by_value: Vec<u8> = counts.keys().copied().collect();
        let mut by_count = by_value.clone();
        by_count.sort_by_key(|value| std::cmp::Reverse(counts.get(value).copied()));
        let mut images = with_palette(self, &by_value, &[1, 2, 4, 8]);
        if by_value != by_count {
            // With a byte a pixel the order changes a few bytes of code lengths only.
            images.extend(with_palette(self, &by_count, &[1, 2, 4]));
        }
        images
    }
}

/// Bytes of the smallest file.
fn smallest(images: &[PngImage], deflate: &mut impl Deflate) -> usize {
    let quick: Vec<usize> = images.iter().map(|image| deflate.quick(&image.scanlines)).collect();
    let limit = quick.iter().min().map_or(0.0, |&least| least as f64 * MAX_QUICK_RATIO);
    let tried = images.iter().zip(&quick).filter(|(_, quick)| **quick as f64 <= limit);
    let sizes = tried.map(|(image, _)| image.container_bytes + deflate.shortest(&image.scanlines));
    sizes.min().unwrap_or(0)
}

/// The map with a palette, at each of these depths, bits a pixel, in which the palette has room.
fn with_palette(map: &LabelRaster, order: &[u8], depths: &[usize]) -> Vec<PngImage> {
    let place = |value: &u8| order.iter().position(|o| o == value).unwrap_or_default() as u8;
    let map = LabelRaster { labels: map.labels.iter().map(place).collect(), ..*map };
    // Signature, IHDR, PLTE, IDAT with zlib head and Adler-32, IEND.
    let container_bytes = 8 + 25 + (12 + 3 * order.len()) + (12 + 6) + 12;
    let depths = depths.iter().filter(|&depth| order.len() <= 1 << depth);
    depths.map(|&depth| PngImage { container_bytes, scanlines: scanlines(&map, depth) }).collect()
}

fn scanlines(map: &LabelRaster, depth: usize) -> Vec<u8> {
    let mut out = Vec::new();
    for row in map.labels.chunks(map.width.max(1)) {
        out.push(0);
        out.extend(
            row.chunks(8 / depth).map(|cells| {
                cells.iter().enumerate().fold(0, |byte, (i, &label)| byte | label << (8 - depth * (i + 1)))
            }),
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A compressor that only stores, so each length is that of the data.
    struct Stored;

    impl Deflate for Stored {
        fn quick(&mut self, data: &[u8]) -> usize {
            data.len()
        }

        fn shortest(&mut self, data: &[u8]) -> usize {
            data.len()
        }
    }

    #[test]
    fn the_shallowest_depth_is_found_and_the_container_counted() {
        let map = LabelRaster { width: 8, height: 2, labels: [[0u8, 9]; 8].concat() };
        // Two rows of a filter byte and eight pixels of a bit; two colours.
        assert_eq!(map.smallest_png(&mut Stored), 8 + 25 + 12 + 6 + 12 + 6 + 4 + 12);
    }

    #[test]
    fn the_smaller_of_box_and_delta_counts() {
        let before = LabelRaster::uniform(40, 40, 1);
        let mut after = before.clone();
        assert_eq!(after.smallest_delta_png(&before, &mut Stored), 0);
        after.set(7, 9, 2);
        assert_eq!(after.smallest_delta_png(&before, &mut Stored), 8 + 25 + 12 + 3 + 12 + 6 + 2 + 12);
    }
}
