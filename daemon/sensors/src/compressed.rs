//! Compressed images: JPEG, PNG, PPM and TIFF.

use crate::exif::{exif_orientation, exif_stamp};
use crate::tiff_pages::{Prepared, Samples, has_all_its_data, prepared, samples};
use crate::{BitDepth, MAX_PIXELS, Stamp, complete_length};
use image::error::{ImageError, UnsupportedErrorKind};
use image::metadata::Orientation;
use image::{
    ColorType, DynamicImage, ExtendedColorType, ImageBuffer, ImageDecoder, ImageFormat, ImageReader, Limits, Rgb,
    RgbImage,
};
use std::io::Cursor;
use std::panic::{AssertUnwindSafe, catch_unwind};
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::options::DecoderOptions;

/// An image that cannot be used, as one line for people.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DecodeError {
    #[error("it is empty")]
    Empty,
    #[error("not a JPEG, PNG, PPM or TIFF image")]
    UnknownFormat,
    #[error("the JPEG has no end, so a part of it is missing")]
    CutJpeg,
    /// Nothing says which of them is white.
    #[error(
        "its levels have 32 bits or more, or are floats or signed numbers: convert it to 8 or 16 bits, from black to white, as with \
             gdal_translate -ot Byte -scale"
    )]
    WideLevels,
    #[error("the image has {width} x {height} pixels; allowed are up to {MAX_PIXELS}")]
    TooLarge { width: u32, height: u32 },
    /// Mosaics in TIFF often have them.
    #[error(
        "its colours are not red, green and blue, as in a TIFF with JPEG inside: convert it, as with gdal_translate -expand rgb, or \
             gdal_translate -co PHOTOMETRIC=RGB -co COMPRESS=DEFLATE"
    )]
    OtherColours,
    #[error(
        "it is grey with transparency: convert it, as with gdal_translate -b 1 -b 1 -b 1 -b 2 -co PHOTOMETRIC=RGB -co ALPHA=YES"
    )]
    GreyWithAlpha,
    #[error(
        "its levels have {bits} bits: convert it to 8 bits, as with gdal_translate -ot Byte -co NBITS=8 -scale 0 {highest} 0 255"
    )]
    OddBits { bits: usize, highest: u64 },
    #[error("it breaks off before its last row")]
    CutOff,
    #[error(
        "its data are compressed in a way that is not read: convert it, as with gdal_translate -co COMPRESS=DEFLATE"
    )]
    OtherCompression,
    /// The rows from `row` on are missing or damaged.
    #[error("it breaks off in row {row} of {rows}")]
    BreaksOff { row: u32, rows: u32 },
    #[error("it needs more memory than the {megabytes} MB that are allowed for an image")]
    TooMuchMemory { megabytes: u64 },
    /// A panic within a library.
    #[error("not an image that can be read: its decoder failed; save it anew, or in another format")]
    DecoderFailed,
    #[error("not an image that can be read: {0}")]
    Broken(String),
    #[error(
        "it has a form that is not read: {0}; convert it, as with gdal_translate -co COMPRESS=DEFLATE -co PHOTOMETRIC=RGB -ot Byte"
    )]
    Unsupported(String),
}

/// BigTIFF, with offsets of 64 bits; the library reads it but does not recognise it.
fn is_big_tiff(bytes: &[u8]) -> bool {
    bytes.starts_with(b"II+\0") || bytes.starts_with(b"MM\0+")
}

/// The decoder of an image, in whatever format it has.
fn decoder_of(bytes: &[u8], limits: Limits) -> Result<impl ImageDecoder, DecodeError> {
    if bytes.is_empty() {
        return Err(DecodeError::Empty);
    }
    if is_cut_jpeg(bytes) {
        return Err(DecodeError::CutJpeg);
    }
    let reader = ImageReader::new(Cursor::new(bytes));
    let guessed = reader.with_guessed_format().map_err(|e| DecodeError::Broken(e.to_string()))?;
    let format = if is_big_tiff(bytes) { Some(ImageFormat::Tiff) } else { guessed.format() };
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format.ok_or(DecodeError::UnknownFormat)?);
    let broken = broken_within(&limits);
    reader.limits(limits);
    reader.into_decoder().map_err(broken)
}

/// What the library says of an image that was read within `limits`, in words for people.
fn broken_within(limits: &Limits) -> impl Fn(ImageError) -> DecodeError + use<> {
    let megabytes = limits.max_alloc.unwrap_or(u64::MAX) >> 20;
    move |error| match &error {
        ImageError::Unsupported(unsupported) => match unsupported.kind() {
            // Grey levels of so many bits: floats or whole numbers.
            UnsupportedErrorKind::Color(ExtendedColorType::Unknown(32 | 64 | 96 | 128)) => DecodeError::WideLevels,
            UnsupportedErrorKind::Color(_) => DecodeError::OtherColours,
            _ => DecodeError::Unsupported(error.to_string()),
        },
        ImageError::IoError(cause) if cause.kind() == std::io::ErrorKind::UnexpectedEof => DecodeError::CutOff,
        ImageError::Limits(_) => DecodeError::TooMuchMemory { megabytes },
        _ => DecodeError::Broken(error.to_string()),
    }
}

/// Runs a decoder, whose panic is an error of the image and does not end the process.
fn guarded<T>(decodes: impl FnOnce() -> Result<T, DecodeError>) -> Result<T, DecodeError> {
    // The image is dropped with all that the decoder had begun.
    catch_unwind(AssertUnwindSafe(decodes)).unwrap_or(Err(DecodeError::DecoderFailed))
}

/// The image of a decoder, turned as its EXIF data say.
fn upright(
    mut decoder: impl ImageDecoder,
    prepared: &Prepared,
    mut limits: Limits,
) -> Result<DynamicImage, DecodeError> {
    let bytes: &[u8] = &prepared.bytes;
    let broken = broken_within(&limits);
    // The decoder counts its own memory only.
    limits.reserve(decoder.total_bytes()).map_err(&broken)?;
    let orientation = match decoder.orientation().map_err(&broken)? {
        // The library reads it only as a number of 16 bits.
        Orientation::NoTransforms => exif_orientation(bytes).unwrap_or(Orientation::NoTransforms),
        turned => turned,
    };
    if matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F) {
        return Err(DecodeError::WideLevels);
    }
    let mut image = DynamicImage::from_decoder(decoder).map_err(&broken)?;
    if let Some(row) = missing_rows(bytes, &image) {
        return Err(DecodeError::BreaksOff { row, rows: image.height() });
    }
    if let Some((width, height)) = prepared.crop {
        image = image.crop_imm(0, 0, width, height);
    }
    image.apply_orientation(orientation);
    Ok(image)
}

/// Decodes an image of at most so many pixels, of a TIFF its first whole page.
fn decode_within(bytes: &[u8], max_pixels: u64, limits: Limits) -> Result<DynamicImage, DecodeError> {
    let prepared = prepared(bytes);
    let decoded = guarded(|| {
        let decoder = decoder_of(&prepared.bytes, limits.clone())?;
        let (width, height) = decoder.dimensions();
        if u64::from(width) * u64::from(height) > max_pixels {
            return Err(DecodeError::TooLarge { width, height });
        }
        upright(decoder, &prepared, limits)
    });
    // Some files with LZW end too early for the library.
    decoded.map_err(|error| match error {
        DecodeError::CutOff if has_all_its_data(bytes) => DecodeError::OtherCompression,
        DecodeError::OtherColours | DecodeError::WideLevels | DecodeError::Unsupported(_) => {
            cause_in_samples(bytes).unwrap_or(error)
        }
        error => error,
    })
}

/// Why the pixels of a TIFF are not read; the library says only how many bits they have.
fn cause_in_samples(bytes: &[u8]) -> Option<DecodeError> {
    match samples(bytes)? {
        Samples { bits: 8 | 16, count: 2, is_grey: true, .. } => Some(DecodeError::GreyWithAlpha),
        Samples { bits, .. } if bits < 32 && !matches!(bits, 8 | 16) => {
            Some(DecodeError::OddBits { bits, highest: (1 << bits) - 1 })
        }
        Samples { are_unsigned: false, .. } => Some(DecodeError::WideLevels),
        Samples { has_plain_colours: false, .. } => Some(DecodeError::OtherColours),
        Samples { is_packed_well: false, .. } => Some(DecodeError::OtherCompression),
        Samples { .. } => None,
    }
}

/// Decodes an image of a file and turns it upright as its EXIF data say. `limits` bounds its size and the memory for it.
///
/// # Errors
/// The format is not known, a part of the image is missing, or it is larger than `limits`.
pub fn decode_upright(bytes: &[u8], limits: Limits) -> Result<DynamicImage, DecodeError> {
    decode_within(bytes, u64::MAX, limits)
}

/// Decodes an image to 8 bits a channel; of 16 bits, `bits` gives the highest level, or 16 where it is automatic. Transparency is
/// dropped.
pub fn decode(bytes: &[u8], bits: BitDepth) -> Result<RgbImage, DecodeError> {
    Ok(match (decode_within(bytes, u64::from(MAX_PIXELS), limits())?, bits) {
        (image, BitDepth::Fixed(bits)) if bits < 16 && is_deep(&image) => scaled(&image.into_rgb16(), bits),
        (image, _) => image.into_rgb8(),
    })
}

fn is_deep(image: &DynamicImage) -> bool {
    use DynamicImage::{ImageLuma16, ImageLumaA16, ImageRgb16, ImageRgba16};
    matches!(image, ImageLuma16(_) | ImageLumaA16(_) | ImageRgb16(_) | ImageRgba16(_))
}

fn scaled(image: &ImageBuffer<Rgb<u16>, Vec<u16>>, bits: u8) -> RgbImage {
    let level = |level| BitDepth::Fixed(bits).scaled(level);
    RgbImage::from_fn(image.width(), image.height(), |x, y| Rgb(image.get_pixel(x, y).0.map(level)))
}

fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_alloc = Some(u64::from(MAX_PIXELS) * 8);
    limits
}

/// Bytes at the head of an image among which its own time is looked for.
const HEAD_BYTES: usize = 4096;

/// The time at which an image was taken, if the image itself says so: by a text `stamp=SECONDS` in a comment of a PPM or JPEG, or
/// in a tEXt chunk with the keyword `stamp` of a PNG, within the first 4096 bytes; or by EXIF data whose
/// `DateTimeOriginal` has a fraction and a zone.
pub fn own_stamp(bytes: &[u8]) -> Option<Stamp> {
    stamp_in_text(bytes).or_else(|| exif_stamp(bytes))
}

fn stamp_in_text(bytes: &[u8]) -> Option<Stamp> {
    let head = &bytes[..bytes.len().min(HEAD_BYTES)];
    let find = |key: &[u8]| head.windows(key.len()).position(|w| w == key);
    let text = if head.starts_with(b"\x89PNG") {
        const KEY: &[u8] = b"tEXtstamp\0";
        let at = find(KEY)?;
        // The length of the chunk's data, which begin behind the type, stands before the type.
        let length = u32::from_be_bytes(*head.get(at.checked_sub(4)?..at)?.first_chunk()?) as usize;
        head.get(at + KEY.len()..at + length.checked_add(4)?)?
    } else if [&b"P6"[..], b"P5", b"\xFF\xD8"].iter().any(|magic| head.starts_with(magic)) {
        const KEY: &[u8] = b"stamp=";
        let text = &head[find(KEY)? + KEY.len()..];
        &text[..text.iter().position(|b| !b.is_ascii_digit() && *b != b'.').unwrap_or(text.len())]
    } else {
        return None;
    };
    Stamp::parse(std::str::from_utf8(text).ok()?)
}

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
    use super::*;
    use crate::{BitDepth, DecodeError, decode};
    use image::codecs::jpeg::JpegEncoder;
    use image::{ImageFormat, Rgb, RgbImage};

    fn image() -> RgbImage {
        RgbImage::from_fn(9, 7, |x, y| Rgb([x as u8 * 20, y as u8 * 30, 7]))
    }

    const WHOLE: BitDepth = BitDepth::Fixed(16);

    fn encoded(format: ImageFormat) -> Vec<u8> {
        if format == ImageFormat::Pnm {
            return [b"P6 9 7 255\n".as_slice(), image().as_raw()].concat();
        }
        let mut bytes = Cursor::new(Vec::new());
        image().write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn levels_of_twelve_bits_are_scaled_to_their_white() {
        let levels = [0, 2048, 4095, 60_000];
        let deep = ImageBuffer::<image::Luma<u16>, _>::from_vec(4, 1, levels.to_vec()).unwrap();
        for format in [ImageFormat::Png, ImageFormat::Tiff] {
            let mut bytes = Cursor::new(Vec::new());
            DynamicImage::ImageLuma16(deep.clone()).write_to(&mut bytes, format).unwrap();
            let greys = |bits| decode(bytes.get_ref(), bits).unwrap().pixels().map(|p| p.0[0]).collect::<Vec<_>>();
            assert_eq!(greys(BitDepth::Fixed(12)), [0, 128, 255, 255], "{format:?}");
            assert_eq!(greys(WHOLE), [0, 8, 16, 233], "{format:?}");
        }
        assert_eq!(decode(&encoded(ImageFormat::Png), BitDepth::Fixed(12)).unwrap(), image(), "8 bits stay");
    }

    #[test]
    fn an_image_of_floats_is_refused_by_name() {
        let floats = ImageBuffer::<Rgb<f32>, _>::from_vec(2, 1, vec![0.0, 10.0, 255.0, 1.0, 2.0, 3.0]).unwrap();
        let mut bytes = Cursor::new(Vec::new());
        DynamicImage::ImageRgb32F(floats).write_to(&mut bytes, ImageFormat::Tiff).unwrap();
        assert_eq!(decode(bytes.get_ref(), WHOLE), Err(DecodeError::WideLevels));
        assert_eq!(decode_upright(bytes.get_ref(), Limits::default()), Err(DecodeError::WideLevels));
        // One grey pixel of 32 bits: width, height, bits, no compression, black is 0, its place, one row, its bytes, IEEE floats.
        let tags =
            [(256u16, 1u32), (257, 1), (258, 32), (259, 1), (262, 1), (273, 8), (277, 1), (278, 1), (279, 4), (339, 3)];
        let entry =
            |(tag, value): &(u16, u32)| [&tag.to_le_bytes()[..], &[4, 0, 1, 0, 0, 0], &value.to_le_bytes()].concat();
        let entries: Vec<u8> = tags.iter().flat_map(entry).collect();
        let grey = [&b"II*\0\x0C\0\0\0"[..], &1f32.to_le_bytes(), &[tags.len() as u8, 0], &entries, &[0; 4]].concat();
        assert_eq!(decode(&grey, WHOLE), Err(DecodeError::WideLevels));
    }

    #[test]
    fn images_are_decoded_and_others_named() {
        for format in [ImageFormat::Png, ImageFormat::Pnm, ImageFormat::Tiff] {
            assert_eq!(decode(&encoded(format), WHOLE).unwrap(), image(), "{format:?}");
        }
        let jpeg = encoded(ImageFormat::Jpeg);
        assert_eq!(decode(&jpeg, WHOLE).unwrap().dimensions(), (9, 7));
        assert_eq!(decode(&jpeg[..jpeg.len() - 2], WHOLE), Err(DecodeError::CutJpeg));
        assert_eq!(decode(b"no image at all", WHOLE), Err(DecodeError::UnknownFormat));
        let huge = b"P6\n100000 100000\n255\n";
        assert_eq!(decode(huge, WHOLE), Err(DecodeError::TooLarge { width: 100_000, height: 100_000 }));
        let cut = encoded(ImageFormat::Png);
        assert!(matches!(decode(&cut[..60], WHOLE), Err(DecodeError::Broken(_) | DecodeError::CutOff)));
    }

    #[test]
    fn a_head_that_names_a_huge_image_takes_no_memory() {
        let classic = b"II*\0\x08\0\0\0";
        // One strip of an image of 100 000 x 100 000 pixels, in TIFF and in BigTIFF.
        let tags = [
            (256u16, 100_000u32),
            (257, 100_000),
            (258, 8),
            (259, 1),
            (262, 1),
            (273, 8),
            (277, 1),
            (278, 100_000),
            (279, 1),
        ];
        let entry =
            |(tag, value): &(u16, u32)| [&tag.to_le_bytes()[..], &[4, 0], &[1, 0, 0, 0], &value.to_le_bytes()].concat();
        let small =
            [&classic[..], &[tags.len() as u8, 0], &tags.iter().flat_map(entry).collect::<Vec<_>>(), &[0; 4]].concat();
        let long = |(tag, value): &(u16, u32)| {
            [&tag.to_le_bytes()[..], &[4, 0], &1u64.to_le_bytes(), &u64::from(*value).to_le_bytes()].concat()
        };
        let head = [&b"II+\0\x08\0\0\0"[..], &16u64.to_le_bytes(), &(tags.len() as u64).to_le_bytes()].concat();
        let big = [head, tags.iter().flat_map(long).collect(), vec![0; 8]].concat();
        for bytes in [small, big] {
            assert!(decode(&bytes, WHOLE).is_err() && decode_upright(&bytes, Limits::default()).is_err());
        }
    }

    #[test]
    fn bytes_after_the_end_of_a_jpeg_are_ignored() {
        let jpeg = encoded(ImageFormat::Jpeg);
        let whole = decode(&jpeg, WHOLE).unwrap();
        for padding in [vec![0; 3], vec![0; 6000], vec![0xFF; 9000], jpeg.clone()] {
            assert_eq!(decode(&[&jpeg[..], &padding].concat(), WHOLE).as_ref(), Ok(&whole));
            assert_eq!(decode(&[&jpeg[..jpeg.len() - 2], &vec![0; 10][..]].concat(), WHOLE), Err(DecodeError::CutJpeg));
        }
    }

    #[test]
    fn an_image_is_turned_upright_as_its_exif_data_say() {
        let png = encoded(ImageFormat::Png);
        let upright = image();
        for (orientation, turned) in [
            (3u8, image::imageops::rotate180(&upright)),
            (6, image::imageops::rotate90(&upright)),
            (2, image::imageops::flip_horizontal(&upright)),
        ] {
            // A TIFF header with one tag, the orientation (0x0112), as a chunk of a PNG behind its head.
            let exif = [&b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..], &[orientation], &[0; 6]].concat();
            let body = [&b"eXIf"[..], &exif].concat();
            let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&body);
            let chunk = [&(exif.len() as u32).to_be_bytes()[..], &body, &crc.to_be_bytes()].concat();
            let with_exif = [&png[..33], &chunk, &png[33..]].concat();
            assert_eq!(decode(&with_exif, WHOLE).unwrap(), turned, "orientation {orientation}");
        }
    }

    #[test]
    fn forms_of_a_tiff_that_are_not_read_are_named() {
        let tiff = |bits: [u8; 2], count: u8, [packing, colours]: [u16; 2]| {
            let ([p, q], [c, d]) = (packing.to_le_bytes(), colours.to_le_bytes());
            // Tag, type (short, or long for 273 and 279), count, value.
            let fields: [(u16, u8, u8, [u8; 4]); 9] = [
                (256, 3, 1, [2, 0, 0, 0]),
                (257, 3, 1, [1, 0, 0, 0]),
                (258, 3, count, [bits[0], 0, bits[1], 0]),
                (259, 3, 1, [p, q, 0, 0]),
                (262, 3, 1, [c, d, 0, 0]),
                (273, 4, 1, [130, 0, 0, 0]),
                (277, 3, 1, [count, 0, 0, 0]),
                (278, 3, 1, [1, 0, 0, 0]),
                (279, 4, 1, [8, 0, 0, 0]),
            ];
            let field = |(tag, kind, count, value): (u16, u8, u8, [u8; 4])| {
                [&tag.to_le_bytes()[..], &[kind, 0, count, 0, 0, 0], &value].concat()
            };
            [&b"II*\0\x08\0\0\0\x09\0"[..], &fields.map(field).concat(), &[0; 20]].concat()
        };
        let grey = [1, 1];
        assert_eq!(decode(&tiff([8, 8], 2, grey), WHOLE), Err(DecodeError::GreyWithAlpha));
        assert_eq!(decode(&tiff([16, 16], 2, grey), WHOLE), Err(DecodeError::GreyWithAlpha));
        assert_eq!(decode(&tiff([12, 0], 1, grey), WHOLE), Err(DecodeError::OddBits { bits: 12, highest: 4095 }));
        for packing in [34_925, 50_000, 50_001] {
            let told = decode(&tiff([8, 0], 1, [packing, 1]), WHOLE);
            assert_eq!(told, Err(DecodeError::OtherCompression), "LZMA, Zstandard, WebP");
        }
        for colours in [3, 6, 8] {
            let told = decode(&tiff([8, 0], 1, [1, colours]), WHOLE);
            assert_eq!(told, Err(DecodeError::OtherColours), "a palette, YCbCr, CIELab");
        }
    }

    #[test]
    fn a_panic_of_a_decoder_is_an_error_of_the_image() {
        let failed: Result<(), _> = guarded(|| panic!("within a library"));
        assert_eq!(failed, Err(DecodeError::DecoderFailed));
    }

    #[test]
    fn an_empty_file_and_the_limit_of_memory_are_named() {
        assert_eq!(decode(b"", WHOLE), Err(DecodeError::Empty));
        let mut small = Limits::default();
        small.max_alloc = Some(1 << 20);
        let wide = RgbImage::new(1000, 1000);
        let mut bytes = Cursor::new(Vec::new());
        wide.write_to(&mut bytes, ImageFormat::Png).unwrap();
        let refused = decode_upright(bytes.get_ref(), small);
        assert_eq!(refused, Err(DecodeError::TooMuchMemory { megabytes: 1 }));
    }

    #[test]
    fn an_image_says_when_it_was_taken() {
        assert_eq!(own_stamp(b"P6\n# stamp=12.5\n1 1\n255\nabc"), Some(Stamp::from_nanos(12_500_000_000)));
        assert_eq!(own_stamp(b"\xFF\xD8\xFF\xFE\0\x0Cstamp=7.25\xFF"), Some(Stamp::from_nanos(7_250_000_000)));
        assert_eq!(own_stamp(b"\x89PNG....\0\0\0\x12tEXtstamp\x001305031102.57777"), Stamp::parse("1305031102.5"));
        assert_eq!(own_stamp(b"P6\n1 1\n255\nabc"), None);
        assert_eq!(own_stamp(b"stamp=3"), None);
        assert_eq!(own_stamp(b"\x89PNG\xFF\xFF\xFF\xFFtEXtstamp\x0013"), None);
        assert_eq!(own_stamp(&encoded(ImageFormat::Png)), None);
    }

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
