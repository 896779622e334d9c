//! TIFF files in the form in which the library reads them (TIFF 6.0, Adobe 1992).

use crate::exif::ExifData;
use std::borrow::Cow;

const NEW_SUBFILE_TYPE: u16 = 254;
const IMAGE_WIDTH: u16 = 256;
const IMAGE_LENGTH: u16 = 257;
const BITS_PER_SAMPLE: u16 = 258;
const COMPRESSION: u16 = 259;
const PHOTOMETRIC: u16 = 262;
const SAMPLES_PER_PIXEL: u16 = 277;
const PLANAR_CONFIGURATION: u16 = 284;
const TILE_WIDTH: u16 = 322;
const TILE_LENGTH: u16 = 323;
const SAMPLE_FORMAT: u16 = 339;

/// The places of the data of strips and of tiles, and their lengths.
const DATA: [(u16, u16); 2] = [(273, 279), (324, 325)];

/// Bits of `NEW_SUBFILE_TYPE`: a reduced image, a mask.
const NOT_WHOLE: usize = 1 | MASK;
const MASK: usize = 4;
/// The planar configuration 2: each band has a plane of its own.
const PLANAR: usize = 2;
/// Pages that are looked at.
const MAX_PAGES: usize = 64;

/// The bytes of an image for the library, and the size to which its picture is then cropped.
#[derive(Debug, PartialEq)]
pub(crate) struct Prepared<'a> {
    pub(crate) bytes: Cow<'a, [u8]>,
    pub(crate) crop: Option<(u32, u32)>,
}

/// Prepares an image; one that is no TIFF, or a TIFF that needs nothing, is left as it is.
///
/// The library reads the first page, which may be a reduced image: the first whole one is put there. Of separate planes in tiles,
/// tiff 0.11.3 reads only images whose size is a multiple of the tile's: the size is that of the tiles, until it is cropped.
pub(crate) fn prepared(bytes: &[u8]) -> Prepared<'_> {
    let as_it_is = Prepared { bytes: Cow::Borrowed(bytes), crop: None };
    let Some(tiff) = ExifData::of_tiff(bytes) else { return as_it_is };
    let Some((first, page)) = tiff.long(4).zip(first_whole_page(&tiff)) else { return as_it_is };
    let padded = padded_size(&tiff, page);
    if first == page && padded.is_none() {
        return as_it_is;
    }
    let mut changed = bytes.to_vec();
    write_long(&mut changed, 4, page as u32, tiff.is_little_endian());
    let crop = padded.map(|sizes| {
        for (tag, size) in [(IMAGE_WIDTH, sizes.padded.0), (IMAGE_LENGTH, sizes.padded.1)] {
            if let Some(entry) = tiff.entry(page, tag) {
                write_as_long(&mut changed, entry, size, tiff.is_little_endian());
            }
        }
        sizes.own
    });
    Prepared { bytes: Cow::Owned(changed), crop }
}

/// Where the first page that is neither reduced nor a mask begins; without one, where the first page does.
fn first_whole_page(tiff: &ExifData) -> Option<usize> {
    let first = tiff.long(4)?;
    let next = |page: &usize| tiff.next_directory(*page);
    let is_whole = |page: &usize| tiff.number(*page, NEW_SUBFILE_TYPE).is_none_or(|kind| kind & NOT_WHOLE == 0);
    std::iter::successors(Some(first), next).take(MAX_PAGES).find(is_whole).or(Some(first))
}

/// The samples of the pixels of a TIFF's first whole page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Samples {
    pub(crate) bits: usize,
    pub(crate) count: usize,
    /// Whether the first one is a level of grey.
    pub(crate) is_grey: bool,
    /// Whether they are whole numbers without a sign.
    pub(crate) are_unsigned: bool,
    /// Whether they are red, green and blue, grey, or the four of print.
    pub(crate) has_plain_colours: bool,
    /// Whether they are packed in a way that is read.
    pub(crate) is_packed_well: bool,
}

pub(crate) fn samples(bytes: &[u8]) -> Option<Samples> {
    let tiff = ExifData::of_tiff(bytes)?;
    let page = first_whole_page(&tiff)?;
    let number = |tag, default| tiff.numbers(page, tag).and_then(|all| all.first().copied()).unwrap_or(default);
    // White may be 0.
    let is_grey = number(PHOTOMETRIC, 0) < 2;
    let are_unsigned = number(SAMPLE_FORMAT, 1) == 1;
    // 2 is red, green and blue, 5 is print.
    let has_plain_colours = is_grey || matches!(number(PHOTOMETRIC, 0), 2 | 5);
    // None, LZW, deflate in both forms, PackBits.
    let is_packed_well = matches!(number(COMPRESSION, 1), 1 | 5 | 8 | 32_773 | 32_946);
    let (bits, count) = (number(BITS_PER_SAMPLE, 1), number(SAMPLES_PER_PIXEL, 1));
    Some(Samples { bits, count, is_grey, are_unsigned, has_plain_colours, is_packed_well })
}

/// Metres across a pixel, as a GeoTIFF with a projection in metres has it (OGC 19-008r4).
pub fn geotiff_scale_m(bytes: &[u8]) -> Option<f64> {
    const PIXEL_SCALE: u16 = 33_550;
    const MODEL_TRANSFORMATION: u16 = 34_264;
    const GEO_KEYS: u16 = 34_735;
    const MODEL_TYPE: usize = 1024;
    const PROJECTED: usize = 1;
    const LINEAR_UNITS: usize = 3076;
    const METRE: usize = 9001;
    let tiff = ExifData::of_tiff(bytes)?;
    let page = first_whole_page(&tiff)?;
    let keys = tiff.numbers(page, GEO_KEYS)?;
    // Behind a head of four numbers each key has four: key, place of its value (0: here), count, value.
    let value = |wanted| {
        keys.chunks_exact(4).skip(1).find_map(|key| match *key {
            [key, 0, _, value] if key == wanted => Some(value),
            _ => None,
        })
    };
    let is_in_metres = value(MODEL_TYPE) == Some(PROJECTED) && value(LINEAR_UNITS).is_none_or(|unit| unit == METRE);
    // A map that is turned has a matrix instead, row by row.
    let matrix = |nth| tiff.double(page, MODEL_TRANSFORMATION, nth);
    let turned = || Some(matrix(0)?.hypot(matrix(4)?));
    let scale_m = tiff.double(page, PIXEL_SCALE, 0).or_else(turned);
    scale_m.filter(|m| is_in_metres && m.is_finite() && *m > 0.0)
}

/// What else than transparency says where a TIFF has no data, for people: it is not read.
pub fn unread_emptiness(bytes: &[u8]) -> Option<String> {
    const GDAL_NODATA: u16 = 42_113;
    let tiff = ExifData::of_tiff(bytes)?;
    let page = first_whole_page(&tiff)?;
    let pages = std::iter::successors(tiff.long(4), |page| tiff.next_directory(*page)).take(MAX_PAGES);
    let is_mask = |page: usize| tiff.number(page, NEW_SUBFILE_TYPE).is_some_and(|kind| kind & MASK != 0);
    match tiff.text(page, GDAL_NODATA) {
        Some(value) => Some(format!("the level {value} for no data")),
        None => pages.into_iter().any(is_mask).then(|| "a mask".to_owned()),
    }
}

/// Whether all the data of the first whole page of a TIFF are in the file.
pub(crate) fn has_all_its_data(bytes: &[u8]) -> bool {
    let Some(tiff) = ExifData::of_tiff(bytes) else { return false };
    let Some(page) = first_whole_page(&tiff) else { return false };
    DATA.into_iter().any(|(places, lengths)| {
        let pieces = tiff.numbers(page, places).zip(tiff.numbers(page, lengths));
        pieces.is_some_and(|(places, lengths)| {
            let are_in_file = places.iter().zip(&lengths).all(|(place, length)| tiff.has(*place, *length));
            !places.is_empty() && places.len() == lengths.len() && lengths.iter().all(|n| *n > 0) && are_in_file
        })
    })
}

struct Sizes {
    own: (u32, u32),
    /// That of all tiles together.
    padded: (u32, u32),
}

/// The sizes of a page of separate planes in tiles, if they differ.
fn padded_size(tiff: &ExifData, page: usize) -> Option<Sizes> {
    if tiff.number(page, PLANAR_CONFIGURATION)? != PLANAR {
        return None;
    }
    let size = |tag| u32::try_from(tiff.number(page, tag)?).ok();
    let own = (size(IMAGE_WIDTH)?, size(IMAGE_LENGTH)?);
    let padded =
        (own.0.checked_next_multiple_of(size(TILE_WIDTH)?)?, own.1.checked_next_multiple_of(size(TILE_LENGTH)?)?);
    (own != padded).then_some(Sizes { own, padded })
}

fn write_long(bytes: &mut [u8], at: usize, number: u32, is_little_endian: bool) {
    let number = if is_little_endian { number.to_le_bytes() } else { number.to_be_bytes() };
    if let Some(place) = bytes.get_mut(at..at + 4) {
        place.copy_from_slice(&number);
    }
}

/// Makes an entry one number of 32 bits.
fn write_as_long(bytes: &mut [u8], entry: usize, number: u32, is_little_endian: bool) {
    const LONG: u16 = 4;
    let kind = if is_little_endian { LONG.to_le_bytes() } else { LONG.to_be_bytes() };
    if let Some(place) = bytes.get_mut(entry + 2..entry + 4) {
        place.copy_from_slice(&kind);
    }
    write_long(bytes, entry + 8, number, is_little_endian);
}

#[cfg(test)]
mod tests {
    use crate::{BitDepth, decode};
    use image::{Rgb, RgbImage};

    const SHORT: u16 = 3;
    const LONG: u16 = 4;

    /// Entries of a directory in little-endian order: tag, type and numbers, which stand behind it where they are many.
    fn directory(at: u32, entries: &[(u16, u16, Vec<u32>)], next: u32) -> Vec<u8> {
        let mut after = at + 2 + 12 * entries.len() as u32 + 4;
        let (mut head, mut values) = ((entries.len() as u16).to_le_bytes().to_vec(), Vec::new());
        for (tag, kind, numbers) in entries {
            head.extend([&tag.to_le_bytes()[..], &kind.to_le_bytes(), &(numbers.len() as u32).to_le_bytes()].concat());
            let bytes: Vec<u8> = match *kind {
                SHORT => numbers.iter().flat_map(|n| (*n as u16).to_le_bytes()).collect(),
                _ => numbers.iter().flat_map(|n| n.to_le_bytes()).collect(),
            };
            if bytes.len() <= 4 {
                head.extend([&bytes[..], &[0; 4]].concat()[..4].iter());
            } else {
                head.extend(after.to_le_bytes());
                after += bytes.len() as u32;
                values.extend(bytes);
            }
        }
        [head, next.to_le_bytes().to_vec(), values].concat()
    }

    #[test]
    fn the_scale_of_a_projection_in_metres_is_read_and_no_other() {
        const DOUBLE: u16 = 12;
        let scale = |model: u32, unit: u32| {
            let keys = vec![1, 1, 0, 2, 1024, 0, 1, model, 3076, 0, 1, unit];
            let bits = 0.25f64.to_bits();
            let halves = vec![bits as u32, (bits >> 32) as u32];
            let mut page = directory(8, &[(33_550, DOUBLE, halves), (34_735, SHORT, keys)], 0);
            // The number of floats, and not of their halves.
            page[6] = 1;
            super::geotiff_scale_m(&[&b"II*\0\x08\0\0\0"[..], &page].concat())
        };
        assert_eq!([scale(1, 9001), scale(2, 9001), scale(1, 9002)], [Some(0.25), None, None]);
    }

    fn pixel(x: u32, y: u32) -> [u8; 3] {
        [x as u8 * 5, y as u8 * 7, (x + y) as u8]
    }

    #[test]
    fn a_page_whose_data_are_beyond_its_end_is_cut() {
        let whole = planar_tiled();
        assert!(super::has_all_its_data(&whole));
        let mut cut = whole.clone();
        // The place of the first tile.
        let at = cut.windows(8).position(|w| w == [8, 0, 0, 0, 8, 1, 0, 0]).unwrap();
        cut[at + 2] = 99;
        assert!(!super::has_all_its_data(&cut));
        assert!(!super::has_all_its_data(b"II*\0") && !super::has_all_its_data(b"P6"));
    }

    /// Three planes of 20 x 18 pixels in tiles of 16 x 16.
    fn planar_tiled() -> Vec<u8> {
        let tiles = (0..3).flat_map(|plane| (0..4).map(move |tile| (plane, tile)));
        let bytes: Vec<u8> = tiles
            .flat_map(|(plane, tile)| (0..256).map(move |i| (plane, tile % 2 * 16 + i % 16, tile / 2 * 16 + i / 16)))
            .map(|(plane, x, y)| if x < 20 && y < 18 { pixel(x, y)[plane] } else { 77 })
            .collect();
        let at = 8 + bytes.len() as u32;
        let entries = [
            (256, SHORT, vec![20]),
            (257, SHORT, vec![18]),
            (258, SHORT, vec![8, 8, 8]),
            (259, SHORT, vec![1]),
            (262, SHORT, vec![2]),
            (277, SHORT, vec![3]),
            (284, SHORT, vec![2]),
            (322, SHORT, vec![16]),
            (323, SHORT, vec![16]),
            (324, LONG, (0..12).map(|i| 8 + 256 * i).collect()),
            (325, LONG, vec![256; 12]),
        ];
        [&b"II*\0"[..], &at.to_le_bytes(), &bytes, &directory(at, &entries, 0)].concat()
    }

    #[test]
    fn planes_in_tiles_that_reach_beyond_the_image_are_read() {
        let expected = RgbImage::from_fn(20, 18, |x, y| Rgb(pixel(x, y)));
        assert_eq!(decode(&planar_tiled(), BitDepth::Fixed(16)), Ok(expected));
    }

    #[test]
    fn a_mask_and_a_level_for_no_data_are_named() {
        let page = |next: u32, fields: &[(u16, u16, u32, [u8; 4])]| {
            let field = |(tag, kind, count, value): &(u16, u16, u32, [u8; 4])| {
                [&tag.to_le_bytes()[..], &kind.to_le_bytes(), &count.to_le_bytes(), value].concat()
            };
            let fields: Vec<u8> = fields.iter().flat_map(field).collect();
            [&((fields.len() / 12) as u16).to_le_bytes()[..], &fields, &next.to_le_bytes()].concat()
        };
        let tiff = |pages: &[Vec<u8>]| [&b"II*\0\x08\0\0\0"[..], &pages.concat()].concat();
        let [whole, mask] = [0, 4].map(|kind: u8| (254, 4, 1, [kind, 0, 0, 0]));
        assert_eq!(super::unread_emptiness(&tiff(&[page(0, &[whole])])), None);
        let masked = tiff(&[page(26, &[whole]), page(0, &[mask])]);
        assert_eq!(super::unread_emptiness(&masked).as_deref(), Some("a mask"));
        let level = tiff(&[page(0, &[whole, (42_113, 2, 4, *b"255\0")])]);
        assert_eq!(super::unread_emptiness(&level).as_deref(), Some("the level 255 for no data"));
    }

    #[test]
    fn the_first_whole_page_counts_and_not_its_reduced_image() {
        let strip = |width: u32, place: u32, subfile: u32| {
            vec![
                (254, LONG, vec![subfile]),
                (256, SHORT, vec![width]),
                (257, SHORT, vec![1]),
                (258, SHORT, vec![8]),
                (259, SHORT, vec![1]),
                (262, SHORT, vec![1]),
                (273, LONG, vec![place]),
                (277, SHORT, vec![1]),
                (278, SHORT, vec![1]),
                (279, LONG, vec![width]),
            ]
        };
        let length = directory(0, &strip(2, 0, 1), 0).len() as u32;
        let (first, second) = (16, 16 + length);
        let file = |kinds: [u32; 2]| {
            let pages =
                [directory(first, &strip(2, 8, kinds[0]), second), directory(second, &strip(6, 10, kinds[1]), 0)];
            [&b"II*\0"[..], &first.to_le_bytes(), &[1, 2, 3, 4, 5, 6, 7, 8], &pages.concat()].concat()
        };
        let width = |kinds| decode(&file(kinds), BitDepth::Fixed(16)).unwrap().width();
        assert_eq!([width([1, 0]), width([0, 1]), width([4, 0]), width([1, 1])], [6, 2, 6, 2]);
    }
}
