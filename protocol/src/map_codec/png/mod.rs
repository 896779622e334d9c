//! The `png` coder: an indexed PNG of the changed part, without the bytes that both ends know.
//!
//! Pixel 0 is an untouched cell; any other pixel stands for a new label. On the wire are a flag whether pixels are
//! labels or indices of a list, two bits of depth, that list, and the raw deflate stream of the scanlines.

mod container;
mod deflate;
mod fit;
mod pixels;

use super::DecodeError;
use super::header::ChunkHeader;
use super::window::Patch;
use crate::bytes::{BitReader, BitWriter};
use crate::grid::Rect;
use crate::map_codec::lattice::Lattice;
use deflate::Deflater;
pub(super) use fit::{best_chunk, smaller};
use pixels::{Depth, Palette};

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
        let scanlines = pixels::pack(patch, palette, depth);
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
    let scanlines = deflate::inflate(stream, pixels::packed_len(rect, depth)).ok_or(DecodeError::Corrupt)?;
    Ok(PngBody { palette, depth, scanlines })
}

/// Reads the body of a chunk for `rect`.
pub(super) fn read(bits: BitReader<'_>, base: Lattice<'_>, rect: Rect) -> Result<Patch, DecodeError> {
    let body = read_body(bits, rect)?;
    let held = base.copy_area(i64::from(rect.x), i64::from(rect.y), rect.width as usize, rect.height as usize);
    let outcome = pixels::unpack(rect, &held, &body.palette, body.depth, &body.scanlines)?;
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
    Ok(container::restore(header.patch, body.depth, &body.palette, stream, &body.scanlines))
}

/// The header of a `png` chunk for `rect`.
fn head(base: Lattice<'_>, rect: Rect) -> ChunkHeader {
    super::chunk::header_for(base, super::header::Body::Png, rect)
}
