//! A TIFF with its directory before its tiles, as readers by network want it (cloud-optimised).
//!
//! Source: TIFF 6.0.

use super::ExportError;
use std::collections::BTreeMap;

/// The directory of a file under way.
#[derive(Default)]
pub(super) struct Directory {
    /// Type, count and bytes of each field, by tag.
    fields: BTreeMap<u16, (u16, u32, Vec<u8>)>,
}

/// The numbers by which TIFF names the types of a directory's fields.
const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const DOUBLE: u16 = 12;

const IMAGE_WIDTH: u16 = 256;
const IMAGE_LENGTH: u16 = 257;
const BITS_PER_SAMPLE: u16 = 258;
const COMPRESSION: u16 = 259;
const ADOBE_DEFLATE: u16 = 8;
const PHOTOMETRIC: u16 = 262;
const RGB: u16 = 2;
const PALETTE: u16 = 3;
const SAMPLES_PER_PIXEL: u16 = 277;
const PLANAR_CONFIGURATION: u16 = 284;
const COLOUR_MAP: u16 = 320;
const EXTRA_SAMPLES: u16 = 338;
const UNASSOCIATED_ALPHA: u16 = 2;
const TILE_WIDTH: u16 = 322;
const TILE_LENGTH: u16 = 323;
const TILE_OFFSETS: u16 = 324;
const TILE_BYTE_COUNTS: u16 = 325;

const HEADER_BYTES: usize = 8;

impl Directory {
    /// One of pixels of so many bytes, in deflated tiles.
    fn new([width, height]: [u32; 2], samples: u16, photometric: u16) -> Self {
        let mut directory = Self::default();
        directory.longs(IMAGE_WIDTH, &[width]);
        directory.longs(IMAGE_LENGTH, &[height]);
        directory.shorts(BITS_PER_SAMPLE, &vec![8; samples.into()]);
        directory.shorts(COMPRESSION, &[ADOBE_DEFLATE]);
        directory.shorts(PHOTOMETRIC, &[photometric]);
        directory.shorts(SAMPLES_PER_PIXEL, &[samples]);
        directory.shorts(PLANAR_CONFIGURATION, &[1]);
        directory
    }

    /// One of red, green, blue and opacity.
    pub(super) fn of_colours(size: [u32; 2]) -> Self {
        let mut directory = Self::new(size, 4, RGB);
        directory.shorts(EXTRA_SAMPLES, &[UNASSOCIATED_ALPHA]);
        directory
    }

    /// One of labels on a palette.
    pub(super) fn of_labels(size: [u32; 2], colour: impl Fn(u8) -> [u8; 3]) -> Self {
        let mut directory = Self::new(size, 1, PALETTE);
        // All reds, then all greens, then all blues, in 16 bits each.
        let colours: Vec<[u8; 3]> = (0..=u8::MAX).map(colour).collect();
        let channel = |channel: usize| colours.iter().map(move |colour| u16::from(colour[channel]) * 257);
        directory.shorts(COLOUR_MAP, &(0..3).flat_map(channel).collect::<Vec<u16>>());
        directory
    }

    /// Adds the last fields, the tiles of this edge: the place of each in the data behind the directory, and its length.
    pub(super) fn tiles(&mut self, edge: u32, places: &[(usize, usize)]) -> Result<(), ExportError> {
        self.longs(TILE_WIDTH, &[edge]);
        self.longs(TILE_LENGTH, &[edge]);
        self.longs(TILE_BYTE_COUNTS, &places.iter().map(|&(_, length)| length as u32).collect::<Vec<u32>>());
        // The length of the directory does not depend on what these are.
        self.longs(TILE_OFFSETS, &vec![0; places.len()]);
        let from = self.length();
        let offset = |&(at, _): &(usize, usize)| u32::try_from(from + at);
        let offsets = places.iter().map(offset).collect::<Result<Vec<u32>, _>>();
        self.longs(TILE_OFFSETS, &offsets.map_err(|_| ExportError::ManyBytes)?);
        Ok(())
    }

    pub(super) fn shorts(&mut self, tag: u16, values: &[u16]) {
        self.add(tag, SHORT, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }

    fn longs(&mut self, tag: u16, values: &[u32]) {
        self.add(tag, LONG, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }

    pub(super) fn doubles(&mut self, tag: u16, values: &[f64]) {
        self.add(tag, DOUBLE, values.len(), values.iter().flat_map(|value| value.to_le_bytes()).collect());
    }

    pub(super) fn text(&mut self, tag: u16, text: &str) {
        let bytes = [text.as_bytes(), &[0]].concat();
        self.add(tag, ASCII, bytes.len(), bytes);
    }

    fn add(&mut self, tag: u16, kind: u16, count: usize, bytes: Vec<u8>) {
        self.fields.insert(tag, (kind, count as u32, bytes));
    }

    /// The end of the directory, behind which values of more than four bytes lie.
    fn end(&self) -> usize {
        HEADER_BYTES + 2 + 12 * self.fields.len() + 4
    }

    /// Bytes of header, directory and the values beyond it.
    fn length(&self) -> usize {
        let beyond = self.fields.values().map(|(.., bytes)| bytes.len()).filter(|length| *length > 4);
        self.end() + beyond.map(|length| length.next_multiple_of(2)).sum::<usize>()
    }

    pub(super) fn bytes(&self) -> Vec<u8> {
        let mut file = b"II*\0".to_vec();
        file.extend((HEADER_BYTES as u32).to_le_bytes());
        file.extend((self.fields.len() as u16).to_le_bytes());
        let mut beyond: Vec<u8> = Vec::new();
        for (tag, (kind, count, bytes)) in &self.fields {
            file.extend(tag.to_le_bytes());
            file.extend(kind.to_le_bytes());
            file.extend(count.to_le_bytes());
            if bytes.len() > 4 {
                file.extend(((self.end() + beyond.len()) as u32).to_le_bytes());
                beyond.extend(bytes);
                beyond.resize(beyond.len().next_multiple_of(2), 0);
            } else {
                file.extend(bytes.iter().copied().chain(std::iter::repeat(0)).take(4));
            }
        }
        file.extend([0; 4]);
        file.extend(beyond);
        file
    }
}
