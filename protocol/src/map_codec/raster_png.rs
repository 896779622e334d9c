//! Maps as indexed PNG files.

use super::LabelRaster;
use crate::grid::MAX_LABEL;
use std::io::Cursor;

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
}
