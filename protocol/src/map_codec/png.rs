//! The `png` coder: an indexed PNG of the changed part, without the bytes that both ends know.
//!
//! Pixel 0 is an untouched cell; any other pixel stands for a new label. On the wire are a flag whether pixels are
//! labels or indices of a list, two bits of depth, that list, and the raw deflate stream of the scanlines.

use super::grow::Growth;
use super::header::ChunkHeader;
use super::patch::{DecodeError, Lattice, MapChunk, Patch};
use crate::bytes::{BitReader, BitWriter};
use crate::grid::{MAX_LABEL, Rect, UNEXPLORED};
use crc::{CRC_32_ISO_HDLC, Crc};
use miniz_oxide::deflate::core::{
    CompressorOxide, TDEFLFlush, TDEFLStatus, compress, create_comp_flags_from_zip_params,
};
use miniz_oxide::inflate::TINFLStatus;
use miniz_oxide::inflate::core::inflate_flags::TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF;
use miniz_oxide::inflate::core::{DecompressorOxide, decompress};
use std::collections::BTreeMap;

/// The effort to find a short body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum DeflateEffort {
    Quick,
    Full,
}

/// The whole chunk for `patch`: `head`, then the smallest body that was found.
fn write(deflater: &mut Deflater, head: &ChunkHeader, patch: &Patch, effort: DeflateEffort) -> Vec<u8> {
    let palettes = Palette::choices(patch);
    let one = |palette: &Palette, depth, deflater: &mut Deflater| {
        let scanlines = pack(patch, palette, depth);
        let mut bits = BitWriter::default();
        head.write(&mut bits);
        palette.write(&mut bits, depth);
        let mut bytes = bits.into_bytes();
        bytes.extend(deflater.shortest(&scanlines, effort));
        head.seal(&mut bytes);
        bytes
    };
    let tried = if effort == DeflateEffort::Full { &palettes } else { palettes.split_at(palettes.len() - 1).1 };
    let all = tried.iter().flat_map(|palette| palette.depths().map(move |depth| (palette, depth)));
    all.map(|(palette, depth)| one(palette, depth, deflater)).min_by_key(Vec::len).unwrap_or_default()
}

/// A body that was read up to its scanlines.
struct PngBody {
    palette: Palette,
    depth: Depth,
    scanlines: Vec<u8>,
}

fn read_body(mut bits: BitReader<'_>, rect: Rect) -> Result<PngBody, DecodeError> {
    let (palette, depth) = Palette::read(&mut bits)?;
    let stream = bits.rest_of_bytes().ok_or(DecodeError::Corrupt)?;
    let scanlines = inflate(stream, packed_len(rect, depth)).ok_or(DecodeError::Corrupt)?;
    Ok(PngBody { palette, depth, scanlines })
}

/// Reads the body of a chunk for `rect`.
pub(super) fn read(bits: BitReader<'_>, base: Lattice<'_>, rect: Rect) -> Result<Patch, DecodeError> {
    let body = read_body(bits, rect)?;
    let held = base.copy_area(i64::from(rect.x), i64::from(rect.y), rect.width as usize, rect.height as usize);
    let outcome = unpack(rect, &held, &body.palette, body.depth, &body.scanlines)?;
    Ok(Patch { rect, base: held, outcome })
}

/// The valid PNG file of a `png` chunk, with its constant bytes restored.
///
/// Pixel values index a grey palette whose level is the label (255 makes a cell unexplored); pixel 0 is untouched. Rows
/// run from south to north. Fails for a chunk of the other coder.
pub fn restored_png(bytes: &[u8]) -> Result<Vec<u8>, DecodeError> {
    let mut bits = BitReader::new(bytes);
    let header = ChunkHeader::read(&mut bits).ok_or(DecodeError::Truncated)?;
    if !header.geometry_is_sound() {
        return Err(DecodeError::BadGeometry);
    }
    if header.body != super::header::Body::Png {
        return Err(DecodeError::UnknownCodec);
    }
    let stream = {
        let mut bits = bits.clone();
        Palette::read(&mut bits)?;
        bits.rest_of_bytes().ok_or(DecodeError::Corrupt)?
    };
    let body = read_body(bits, header.patch)?;
    Ok(restore(header.patch, body.depth, &body.palette, stream, &body.scanlines))
}

/// The header of a `png` chunk for `rect`.
fn head(base: Lattice<'_>, rect: Rect) -> ChunkHeader {
    ChunkHeader::new(base, super::header::Body::Png, rect)
}

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
const INDEXED: u8 = 3;

/// A PNG file around a raw deflate stream, with a grey palette whose level is the label.
pub(super) fn restore(rect: Rect, depth: Depth, palette: &Palette, stream: &[u8], scanlines: &[u8]) -> Vec<u8> {
    let mut head = Vec::from(rect.width.to_be_bytes());
    head.extend(rect.height.to_be_bytes());
    head.extend([depth.bits(), INDEXED, 0, 0, 0]);
    let pixels = (0..=255u8).take(1 << depth.bits());
    let colours: Vec<u8> = pixels.map_while(|pixel| palette.entry(pixel)).flat_map(|level| [level; 3]).collect();
    // Deflate with a 32 kB window at the highest level.
    let mut zlib = vec![0x78, 0xDA];
    zlib.extend(stream);
    zlib.extend(adler32(scanlines).to_be_bytes());

    let mut file = Vec::from(SIGNATURE);
    for (kind, data) in [(b"IHDR", head.as_slice()), (b"PLTE", &colours), (b"IDAT", &zlib), (b"IEND", &[])] {
        section(&mut file, *kind, data);
    }
    file
}

fn section(file: &mut Vec<u8>, kind: [u8; 4], data: &[u8]) {
    const CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    file.extend((data.len() as u32).to_be_bytes());
    let mut digest = CRC.digest();
    digest.update(&kind);
    digest.update(data);
    file.extend(kind);
    file.extend(data);
    file.extend(digest.finalize().to_be_bytes());
}

fn adler32(data: &[u8]) -> u32 {
    let (a, b) = data.iter().fold((1u32, 0u32), |(a, b), &byte| {
        let a = (a + u32::from(byte)) % 65_521;
        (a, (b + a) % 65_521)
    });
    b << 16 | a
}

/// Level, and strategy in the numbering of zlib: 0 default, 1 filtered, 3 run lengths, 4 fixed codes.
const TRIALS: [(i32, i32); 5] = [(6, 3), (7, 0), (10, 0), (10, 3), (10, 4)];
/// The number of quick trials, which come first.
const QUICK: usize = 2;

pub(super) struct Deflater {
    compressors: Vec<CompressorOxide>,
}

impl Deflater {
    pub(super) fn new() -> Self {
        let with = |(level, strategy)| CompressorOxide::new(create_comp_flags_from_zip_params(level, 0, strategy));
        Self { compressors: TRIALS.into_iter().map(with).collect() }
    }

    /// The shortest raw deflate stream of `input` among the quick trials, or among all.
    pub(super) fn shortest(&mut self, input: &[u8], effort: DeflateEffort) -> Vec<u8> {
        let trials = if effort == DeflateEffort::Quick { QUICK } else { TRIALS.len() };
        let streams = self.compressors.iter_mut().take(trials).map(|compressor| run(compressor, input));
        streams.min_by_key(Vec::len).unwrap_or_default()
    }
}

fn run(compressor: &mut CompressorOxide, input: &[u8]) -> Vec<u8> {
    compressor.reset();
    // A stored block costs 5 bytes in 64 kB, so this always suffices.
    let mut out = vec![0; input.len() + input.len() / 1000 + 64];
    let (status, _, length) = compress(compressor, input, &mut out, TDEFLFlush::Finish);
    debug_assert_eq!(status, TDEFLStatus::Done);
    out.truncate(length);
    out
}

/// The `length` bytes that `stream` stands for; `None` if it does not end exactly with them.
pub(super) fn inflate(stream: &[u8], length: usize) -> Option<Vec<u8>> {
    let mut out = vec![0; length];
    let mut state = DecompressorOxide::new();
    let (status, read, written) = decompress(&mut state, stream, &mut out, 0, TINFL_FLAG_USING_NON_WRAPPING_OUTPUT_BUF);
    (status == TINFLStatus::Done && read == stream.len() && written == length).then_some(out)
}

/// The chunk of at most `room` bytes with the most changes along `growth`; `None` if not even its seed fits.
pub(in crate::map_codec) fn best_chunk(base: Lattice<'_>, growth: &Growth, room: usize) -> Option<MapChunk> {
    let mut fitter = Fitter { base, room, deflater: Deflater::new() };
    let patch_of = |i: usize| growth.window.patch(*growth.areas.get(i)?).trimmed();
    let mut best = patch_of(0)?;
    let (mut fitting, mut too_large, mut step) = (0, growth.areas.len(), 1);
    // Doubling steps, then bisection, because most rooms hold few changes.
    while fitting + 1 < too_large {
        let i = (fitting + step).min((fitting + too_large) / 2).max(fitting + 1);
        let patch = patch_of(i)?;
        if fitter.fits(&patch) {
            (best, fitting, step) = (patch, i, step * 2);
        } else {
            too_large = i;
        }
    }
    if too_large < growth.areas.len() {
        best = fitter.fill(best, &patch_of(too_large)?)?;
    }
    let bytes = write(&mut fitter.deflater, &head(base, best.rect), &best, DeflateEffort::Full);
    (bytes.len() <= room).then(|| MapChunk::of(&best, bytes))
}

/// The `png` chunk with the content of `chunk`, if it is shorter.
pub(in crate::map_codec) fn smaller(base: Lattice<'_>, other: &MapChunk) -> Option<MapChunk> {
    let patch = Patch::of(base, &other.changes)?;
    let bytes = write(&mut Deflater::new(), &head(base, patch.rect), &patch, DeflateEffort::Quick);
    (bytes.len() < other.bytes.len()).then(|| MapChunk::of(&patch, bytes))
}

struct Fitter<'a> {
    base: Lattice<'a>,
    room: usize,
    deflater: Deflater,
}

impl Fitter<'_> {
    fn fits(&mut self, patch: &Patch) -> bool {
        write(&mut self.deflater, &head(self.base, patch.rect), patch, DeflateEffort::Quick).len() <= self.room
    }

    /// `inner` with as many further changes of `outer` as fit.
    fn fill(&mut self, inner: Patch, outer: &Patch) -> Option<Patch> {
        let (mut fitting, mut too_many) = (0, outer.changes().len().saturating_sub(inner.changes().len()));
        let mut best = inner.clone();
        while fitting + 1 < too_many {
            let count = (fitting + too_many) / 2;
            let patch = outer.first_changes_beyond(&inner.rect, count).trimmed()?;
            if self.fits(&patch) {
                (best, fitting) = (patch, count);
            } else {
                too_many = count;
            }
        }
        Some(best)
    }
}

/// The pixel value, or palette entry, of a cell that becomes unexplored.
const CLEARED: u8 = 255;

/// Bits a pixel: 1, 2, 4 or 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Depth(u8);

impl Depth {
    const ALL: [Self; 4] = [Self(1), Self(2), Self(4), Self(8)];

    pub(super) fn bits(self) -> u8 {
        self.0
    }

    fn holds(self, pixel: u8) -> bool {
        u32::from(pixel) < 1 << self.0
    }
}

/// The meaning of the pixels above 0.
///
/// ```text
///  bits  1       2        8 if listed   8 x count
///      +--------+--------+-------------+---------+
///      | listed | depth  | count - 1   | entries |
///      +--------+--------+-------------+---------+
/// ```
/// * listed: 0 = a pixel is the label itself (255 makes a cell unexplored), 1 = pixel i is entry i - 1.
/// * depth: 1, 2, 4, 8 bits a pixel. Zero bits fill the last byte.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Palette {
    Labels {
        /// The largest pixel in use.
        highest: u8,
    },
    /// A pixel is an index of the list plus 1.
    List(Vec<u8>),
}

impl Palette {
    /// The palettes to try: the labels themselves, and a list if that makes pixels narrower.
    pub(super) fn choices(patch: &Patch) -> Vec<Self> {
        let mut counts: BTreeMap<u8, usize> = BTreeMap::new();
        for (_, label) in patch.changes() {
            *counts.entry(stored(label)).or_default() += 1;
        }
        let direct = Self::Labels { highest: counts.keys().last().copied().unwrap_or(0) };
        let mut list: Vec<u8> = counts.keys().copied().collect();
        list.sort_by_key(|entry| std::cmp::Reverse(counts.get(entry)));
        let list = Self::List(list);
        if list.narrowest() < direct.narrowest() { vec![direct, list] } else { vec![direct] }
    }

    /// The least depth that holds every pixel.
    pub(super) fn narrowest(&self) -> Depth {
        let highest = match self {
            Self::Labels { highest } => *highest,
            Self::List(list) => list.len() as u8,
        };
        Depth::ALL.into_iter().find(|d| d.holds(highest)).unwrap_or(Depth(8))
    }

    /// The depths to try: the narrowest that holds every pixel, and a byte a pixel.
    pub(super) fn depths(&self) -> impl Iterator<Item = Depth> + use<> {
        let narrowest = self.narrowest();
        std::iter::once(narrowest)
            .chain((narrowest < Depth(4)).then_some(Depth(4)))
            .chain((narrowest < Depth(8)).then_some(Depth(8)))
    }

    pub(super) fn write(&self, out: &mut BitWriter, depth: Depth) {
        out.bit(matches!(self, Self::List(_)));
        out.put(u64::from(depth.0.trailing_zeros()), 2);
        if let Self::List(list) = self {
            out.put(list.len() as u64 - 1, 8);
            list.iter().for_each(|&entry| out.put(u64::from(entry), 8));
        }
    }

    pub(super) fn read(bits: &mut BitReader<'_>) -> Result<(Self, Depth), DecodeError> {
        let mut read = || {
            let listed = bits.bit()?;
            let depth = Depth(1 << bits.take(2)?);
            if !listed {
                return Some((Self::Labels { highest: CLEARED }, depth));
            }
            let count = bits.take(8)? + 1;
            let list = (0..count).map(|_| Some(bits.take(8)? as u8)).collect::<Option<Vec<u8>>>()?;
            Some((Self::List(list), depth))
        };
        read().ok_or(DecodeError::Truncated)
    }

    /// The entry of a restored file's palette for `pixel`: the label, 255 for unexplored, 0 for untouched.
    pub(super) fn entry(&self, pixel: u8) -> Option<u8> {
        match (self, pixel) {
            (_, 0) => Some(0),
            (Self::Labels { .. }, pixel) => Some(pixel),
            (Self::List(list), pixel) => list.get(usize::from(pixel) - 1).copied(),
        }
    }

    fn pixel(&self, entry: u8) -> u8 {
        match self {
            Self::Labels { .. } => entry,
            Self::List(list) => list.iter().position(|&e| e == entry).map_or(0, |i| i as u8 + 1),
        }
    }
}

fn stored(label: u8) -> u8 {
    if label == UNEXPLORED { CLEARED } else { label }
}

/// Length of a scanline with its filter byte.
fn stride(rect: Rect, depth: Depth) -> usize {
    1 + (rect.width as usize * usize::from(depth.0)).div_ceil(8)
}
pub(super) fn packed_len(rect: Rect, depth: Depth) -> usize {
    stride(rect, depth) * rect.height as usize
}

/// Scanlines of the patch, each with filter 0, which is best on label maps.
pub(super) fn pack(patch: &Patch, palette: &Palette, depth: Depth) -> Vec<u8> {
    let width = patch.rect.width as usize;
    let mut out = Vec::with_capacity(packed_len(patch.rect, depth));
    for (old, new) in patch.base.chunks(width).zip(patch.outcome.chunks(width)) {
        let mut line = BitWriter::default();
        line.put(0, 8);
        for (old, new) in old.iter().zip(new) {
            let pixel = if old == new { 0 } else { palette.pixel(stored(*new)) };
            line.put(u64::from(pixel), u32::from(depth.0));
        }
        out.extend(line.into_bytes());
    }
    out
}

/// Applies the scanlines to the cells in `held`.
pub(super) fn unpack(
    rect: Rect,
    held: &[u8],
    palette: &Palette,
    depth: Depth,
    scanlines: &[u8],
) -> Result<Vec<u8>, DecodeError> {
    let (width, bits) = (rect.width as usize, usize::from(depth.0));
    let mut outcome = Vec::with_capacity(held.len());
    for (row, held) in scanlines.chunks(stride(rect, depth)).zip(held.chunks(width)) {
        if row.first() != Some(&0) {
            return Err(DecodeError::Corrupt);
        }
        for (column, &old) in held.iter().enumerate() {
            let byte = *row.get(1 + column * bits / 8).ok_or(DecodeError::Corrupt)?;
            let pixel = byte << (column * bits % 8) >> (8 - bits);
            let label = match palette.entry(pixel).ok_or(DecodeError::Corrupt)? {
                0 if pixel == 0 => {
                    outcome.push(old);
                    continue;
                }
                CLEARED => UNEXPLORED,
                label @ 1..=MAX_LABEL => label,
                _ => return Err(DecodeError::Corrupt),
            };
            if label == old {
                return Err(DecodeError::Corrupt);
            }
            outcome.push(label);
        }
    }
    Ok(outcome)
}
