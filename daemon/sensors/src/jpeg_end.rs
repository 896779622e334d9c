//! Whether a JPEG is whole.

use crate::complete_length;
use image::DynamicImage;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::options::DecoderOptions;

fn is_jpeg(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0xFF, 0xD8])
}

/// Whether the end of a JPEG is missing. What follows the end, as of cameras that write blocks, does not count.
pub(crate) fn is_cut_jpeg(bytes: &[u8]) -> bool {
    is_jpeg(bytes) && complete_length(bytes).is_none()
}

/// The first row of a decoded JPEG, counted from 1, for which it has no data though it has an end; `None` if it is whole. The decoder
/// takes zeros instead, or grey, which would be mapped as sea floor.
pub(crate) fn missing_rows(bytes: &[u8], image: &DynamicImage) -> Option<u32> {
    if !is_jpeg(bytes) || !ends_in_a_pattern(image) {
        return None;
    }
    let end = complete_length(bytes)?.checked_sub(2)?;
    // Where the data are complete, nothing between them and the end is read.
    let decode_with = |filler: u8| {
        let (data, end) = bytes.split_at(end);
        decode_strictly(&[data, &[filler; FILLER_BYTES], end].concat())
    };
    let (Some(one), Some(other)) = (decode_with(0x55), decode_with(0xAA)) else {
        return Some(image.height() + 1 - grey_rows(image));
    };
    let row_bytes = one.len().min(other.len()) / image.height().max(1) as usize;
    let rows = one.chunks_exact(row_bytes.max(1)).zip(other.chunks_exact(row_bytes.max(1)));
    rows.zip(1..).find(|((a, b), _)| a != b).map(|(_, row)| row)
}

/// Bytes that stand in for what may be missing: those of a few blocks at least.
const FILLER_BYTES: usize = 4096;

/// A multiple of the width of every unit of a JPEG, pixels.
const PERIOD: usize = 32;

/// Whether the last row of an image may have been decoded without data: all units of a JPEG are then the same. A cheap sign, which
/// walls of one colour have too.
fn ends_in_a_pattern(image: &DynamicImage) -> bool {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let pixel_bytes = image.as_bytes().len() / (width * height).max(1);
    let row = image.as_bytes().rchunks_exact((width * pixel_bytes).max(1)).next().unwrap_or_default();
    // The left half may be that of the row in which it breaks off; the last unit reaches beyond the image.
    let inner = row.get(width / 2 * pixel_bytes..width.saturating_sub(PERIOD) * pixel_bytes).unwrap_or_default();
    inner.iter().zip(inner.iter().skip(PERIOD * pixel_bytes)).all(|(a, b)| a == b)
}

/// Rows at the end of an image that are all of the grey with which a decoder fills it.
fn grey_rows(image: &DynamicImage) -> u32 {
    let row_bytes = image.as_bytes().len() / image.height().max(1) as usize;
    let rows = image.as_bytes().rchunks_exact(row_bytes.max(1));
    rows.take_while(|row| row.iter().all(|level| *level == 128)).count().max(1) as u32
}

/// The pixels of a JPEG in which a decoder finds no fault.
fn decode_strictly(bytes: &[u8]) -> Option<Vec<u8>> {
    let options = DecoderOptions::default().set_strict_mode(true).set_max_width(usize::MAX).set_max_height(usize::MAX);
    JpegDecoder::new_with_options(ZCursor::new(bytes), options).decode().ok()
}

#[cfg(test)]
mod tests {
    use crate::{BitDepth, DecodeError, decode};
    use image::codecs::jpeg::JpegEncoder;
    use image::{Rgb, RgbImage};

    fn jpeg(image: &RgbImage) -> Vec<u8> {
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, 90).encode_image(image).unwrap();
        bytes
    }

    #[test]
    fn a_jpeg_that_was_cut_and_closed_is_refused_with_its_row() {
        let image = RgbImage::from_fn(320, 200, |x, y| Rgb([(x * y) as u8, (x * 97 % 251) as u8, y as u8]));
        let whole = jpeg(&image);
        let closed = [&whole[..whole.len() / 2], &[0xFF, 0xD9]].concat();
        let error = decode(&closed, BitDepth::Fixed(16)).err();
        assert!(matches!(error, Some(DecodeError::BreaksOff { row: 40..160, rows: 200 })), "{error:?}");
        assert!(decode(&whole, BitDepth::Fixed(16)).is_ok());
    }

    #[test]
    fn a_jpeg_of_one_grey_is_whole() {
        for (width, height, level) in [(64, 48, 128), (33, 17, 128), (64, 48, 0), (9, 7, 255)] {
            let grey = RgbImage::from_pixel(width, height, Rgb([level; 3]));
            assert_eq!(decode(&jpeg(&grey), BitDepth::Fixed(16)), Ok(grey), "{width} x {height} of {level}");
        }
    }
}
