//! A dense map of labels, as an indexed PNG file, and as the smallest ones, to compare the stream with.

use crate::grid::{Cell, LabelGrid, MAX_LABEL};
use std::collections::BTreeMap;
use std::io::Cursor;

/// A map that stores a label for each cell of a rectangle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelRaster {
    /// The number of columns, at least 1.
    pub width: usize,
    /// The number of rows, at least 1.
    pub height: usize,
    /// `width * height` labels, row by row from the south; 0 is unexplored.
    pub labels: Vec<u8>,
}

impl LabelRaster {
    /// A map with one label everywhere.
    pub fn uniform(width: usize, height: usize, label: u8) -> Self {
        Self { width, height, labels: vec![label; width * height] }
    }

    /// The map as a grid whose cell (0, 0) is the first label.
    pub fn to_grid(&self) -> LabelGrid {
        let cells = self.labels.iter().enumerate().filter(|&(_, &label)| label != 0);
        cells.map(|(i, &label)| (Cell::new((i % self.width) as i32, (i / self.width) as i32), label)).collect()
    }

    /// The part of `grid` from cell (0, 0) on that has `width` columns and `height` rows.
    pub fn from_grid(grid: &LabelGrid, width: usize, height: usize) -> Self {
        Self { width, height, labels: grid.copy_area(0, 0, width, height) }
    }

    /// The change from `before`, which has the same size: 0 = untouched, 255 = becomes unexplored.
    pub fn delta_from(&self, before: &Self) -> Self {
        let delta = self.labels.iter().zip(&before.labels).map(|(&new, &old)| match new {
            same if same == old => 0,
            0 => 255,
            new => new,
        });
        Self { width: self.width, height: self.height, labels: delta.collect() }
    }

    /// The smallest part that holds every cell other than 0; one cell if there is none.
    pub fn trimmed(&self) -> Self {
        let set: Vec<usize> = (0..self.labels.len()).filter(|&i| self.labels[i] != 0).collect();
        let columns = || set.iter().map(|i| i % self.width);
        let (left, right) = (columns().min().unwrap_or(0), columns().max().unwrap_or(0));
        let (first, last) = (set.first().unwrap_or(&0) / self.width, set.last().unwrap_or(&0) / self.width);
        let labels = (first..=last).flat_map(|row| (left..=right).map(move |column| self.get(column, row))).collect();
        Self { width: right - left + 1, height: last - first + 1, labels }
    }

    /// The label in `column` of `row`.
    pub fn get(&self, column: usize, row: usize) -> u8 {
        self.labels[row * self.width + column]
    }

    /// Sets the label in `column` of `row`.
    pub fn set(&mut self, column: usize, row: usize, label: u8) {
        self.labels[row * self.width + column] = label;
    }
}

/// Why a PNG file is not a label map.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RasterPngError {
    /// Not a PNG file, or a damaged or too large one.
    #[error("not a readable PNG: {0}")]
    Unreadable(#[from] png::DecodingError),
    /// Its pixels are colours instead of indexes.
    #[error("the PNG is {0:?}; an indexed one is needed, its pixel values being the labels")]
    NotIndexed(png::ColorType),
    /// A pixel value is above 254.
    #[error("the PNG has pixel value {0}; labels go up to {MAX_LABEL}")]
    NoLabel(u8),
}

/// Bytes that decoding a file may take.
const MAX_BYTES: usize = 1 << 26;

impl LabelRaster {
    /// Reads an indexed PNG whose pixel values are the labels (0 = unexplored), first row first.
    pub fn from_png(file: &[u8]) -> Result<Self, RasterPngError> {
        let limits = png::Limits { bytes: MAX_BYTES };
        let mut decoder = png::Decoder::new_with_limits(Cursor::new(file), limits);
        decoder.set_transformations(png::Transformations::IDENTITY);
        let mut reader = decoder.read_info()?;
        let colours = reader.info().color_type;
        if colours != png::ColorType::Indexed {
            return Err(RasterPngError::NotIndexed(colours));
        }
        let size = reader.output_buffer_size().filter(|&size| size <= MAX_BYTES);
        let mut data = vec![0; size.ok_or(png::DecodingError::LimitsExceeded)?];
        let info = reader.next_frame(&mut data)?;
        let bits = info.bit_depth as usize;
        let (width, height) = (info.width as usize, info.height as usize);
        let mut labels = Vec::with_capacity(width * height);
        for row in data.chunks(info.line_size).take(height) {
            let pixels = row.iter().flat_map(|&byte| (0..8 / bits).map(move |i| byte << (i * bits) >> (8 - bits)));
            labels.extend(pixels.take(width));
        }
        match labels.iter().find(|&&label| label > MAX_LABEL) {
            Some(&label) => Err(RasterPngError::NoLabel(label)),
            None => Ok(Self { width, height, labels }),
        }
    }

    /// The map as an indexed PNG: black for unexplored, a colour of its own for each label.
    pub fn to_png(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, self.width as u32, self.height as u32);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        let highest = self.labels.iter().copied().max().unwrap_or(0);
        encoder.set_palette((0..=highest).flat_map(colour).collect::<Vec<u8>>());
        encoder.set_compression(png::Compression::High);
        encoder.set_filter(png::Filter::NoFilter);
        // Writing to memory cannot fail, and the size is that of the labels.
        let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(&self.labels));
        debug_assert!(written.is_ok());
        file
    }
}

/// Colours far apart for labels next to each other: hues by the golden angle.
fn colour(label: u8) -> [u8; 3] {
    if label == 0 {
        return [0; 3];
    }
    let hue = (u32::from(label - 1) * 949) % 1536;
    let (sector, rise) = (hue / 256, (hue % 256) as u8);
    let dim = 255 - (label / 8 % 4) * 40;
    let [r, g, b] = match sector {
        0 => [255, rise, 0],
        1 => [255 - rise, 255, 0],
        2 => [0, 255, rise],
        3 => [0, 255 - rise, 255],
        4 => [rise, 0, 255],
        _ => [255, 0, 255 - rise],
    };
    [r, g, b].map(|part| (u16::from(part) * u16::from(dim) / 255) as u8)
}

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
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn a_map_reads_back_from_its_file() {
        let raster = LabelRaster { width: 5, height: 3, labels: vec![0, 1, 2, 3, 254, 7, 7, 7, 0, 0, 9, 9, 9, 9, 200] };
        assert_eq!(LabelRaster::from_png(&raster.to_png()).unwrap(), raster);
    }

    #[test]
    fn files_that_are_no_maps_are_refused() {
        let mut rgb = Vec::new();
        let mut encoder = png::Encoder::new(&mut rgb, 1, 1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header().unwrap().write_image_data(&[1, 2, 3]).unwrap();
        assert!(matches!(LabelRaster::from_png(&rgb), Err(RasterPngError::NotIndexed(png::ColorType::Rgb))));
        assert!(matches!(LabelRaster::from_png(b"no image"), Err(RasterPngError::Unreadable(_))));
        let too_high = LabelRaster { width: 1, height: 1, labels: vec![255] };
        assert!(matches!(LabelRaster::from_png(&too_high.to_png()), Err(RasterPngError::NoLabel(255))));
    }

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
