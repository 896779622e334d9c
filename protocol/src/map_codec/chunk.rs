//! The choice of the coder, encoding of the best chunk for a given room, and decoding of any chunk.

use super::context::Decision;
use super::grow::Growth;
use super::header::{Body, ChunkHeader, base_check};
use super::patch::{DecodeError, Lattice, MapChunk, Stride};
use super::{context, png};
use crate::bytes::BitReader;
use crate::grid::{Cell, LabelGrid, Rect};
use std::fmt;
use std::str::FromStr;

/// The best chunk of at most `room` bytes around `seed`.
///
/// Grows a compact patch around `seed` as long as it fits. `wanted` selects the cells that may be sent now among those
/// that differ between `base` and `target`; the others stay untouched. `None` if `seed` does not differ or is not
/// wanted, or if not even one cell fits.
///
/// ```
/// use scenecast_protocol::map::{Cell, LabelGrid};
/// use scenecast_protocol::map_codec::{Codec, decode, encode};
///
/// let base = LabelGrid::default();
/// let target: LabelGrid = (0..30).map(|x| (Cell::new(x, 4), 2)).collect();
/// let chunk = encode(Codec::Auto, &base, &target, Cell::new(12, 4), 24, &|_| true).unwrap();
/// assert!(chunk.bytes.len() <= 24);
/// assert_eq!(decode(&base, &chunk.bytes), Ok(chunk.changes));
/// assert!(decode(&target, &chunk.bytes).is_err(), "it was coded against another base");
/// ```
pub fn encode(
    codec: Codec,
    base: &LabelGrid,
    target: &LabelGrid,
    seed: Cell,
    room: usize,
    wanted: &dyn Fn(Cell) -> bool,
) -> Option<MapChunk> {
    encode_every(Stride::One, codec, base, target, seed, room, wanted)
}

/// As [`encode`], for cells on the lattice of `stride` alone; `None` if `seed` is not on it.
pub fn encode_every(
    stride: Stride,
    codec: Codec,
    base: &LabelGrid,
    target: &LabelGrid,
    seed: Cell,
    room: usize,
    wanted: &dyn Fn(Cell) -> bool,
) -> Option<MapChunk> {
    let (base, target) = (Lattice::new(base, stride), Lattice::new(target, stride));
    let wanted = |cell| wanted(stride.on_map(cell));
    let growth = Growth::around(base, target, stride.on_lattice(seed)?, room, &wanted)?;
    let mut chunk = best_chunk(codec, base, &growth, room)?;
    chunk.changes.iter_mut().for_each(|(cell, _)| *cell = stride.on_map(*cell));
    Some(chunk)
}

/// As [`encode_every`] with the context coder, in about a quarter of the time and with slightly fewer changes: the size of the
/// patch follows from the bytes that each change of recent chunks has taken. For fast channels, where computing takes
/// longer than sending.
pub(crate) fn encode_quickly(
    stride: Stride,
    base: &LabelGrid,
    target: &LabelGrid,
    seed: Cell,
    room: usize,
    wanted: &dyn Fn(Cell) -> bool,
    bytes_per_change: f64,
) -> Option<MapChunk> {
    let (base, target) = (Lattice::new(base, stride), Lattice::new(target, stride));
    let wanted = |cell| wanted(stride.on_map(cell));
    let growth = Growth::around(base, target, stride.on_lattice(seed)?, room, &wanted)?;
    let mut chunk = context::quick_chunk(base, &growth, room, bytes_per_change)?;
    chunk.changes.iter_mut().for_each(|(cell, _)| *cell = stride.on_map(*cell));
    Some(chunk)
}

fn best_chunk(codec: Codec, base: Lattice<'_>, growth: &Growth, room: usize) -> Option<MapChunk> {
    match codec {
        Codec::Png => png::best_chunk(base, growth, room),
        Codec::Context => context::best_chunk(base, growth, room),
        Codec::Auto => {
            let by_context = context::best_chunk(base, growth, room);
            by_context.map(|chunk| png::smaller(base, &chunk).unwrap_or(chunk))
        }
    }
}

/// The changes in a chunk: cells with their new labels (0 makes a cell unexplored), row by row.
///
/// Never panics, whatever the bytes; allocates for at most [`MAX_PATCH_CELLS`](super::MAX_PATCH_CELLS) cells.
pub fn decode(base: &LabelGrid, bytes: &[u8]) -> Result<Vec<(Cell, u8)>, DecodeError> {
    let (header, bits, base) = open(base, bytes)?;
    let patch = header.patch;
    match header.body {
        Body::Png => png::read(bits, base, patch),
        Body::Context => context::read(bits, base, patch),
    }
    .map(|patch| patch.changes().into_iter().map(|(cell, label)| (header.stride.on_map(cell), label)).collect())
}

/// Where a chunk changes the map, and how it is coded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ChunkPatch {
    /// The coder of its body: `png` or `context`.
    pub codec: Codec,
    /// The distance of its cells.
    pub stride: Stride,
    /// The patch, in steps of the stride.
    pub rect: Rect,
}

/// The patch of a chunk, without the base; `None` if the bytes have no sound head.
pub fn patch(bytes: &[u8]) -> Option<ChunkPatch> {
    let header = ChunkHeader::read(&mut BitReader::new(bytes)).filter(ChunkHeader::geometry_is_sound)?;
    let codec = match header.body {
        Body::Png => Codec::Png,
        Body::Context => Codec::Context,
    };
    Some(ChunkPatch { codec, stride: header.stride, rect: header.patch })
}

/// The decisions of a chunk with the body `context`, in order; none of one with the body `png`. They take a kilobyte a cell, and a
/// wrong end of the body is no error: for chunks that [`decode`] accepts.
pub fn trace(base: &LabelGrid, bytes: &[u8]) -> Result<Vec<Decision>, DecodeError> {
    let (header, bits, base) = open(base, bytes)?;
    match header.body {
        Body::Png => Ok(Vec::new()),
        Body::Context => context::trace(bits, base, header.patch),
    }
}

/// The header of a sound chunk, the bits of its body, and the base that it changes.
fn open<'a>(base: &'a LabelGrid, bytes: &'a [u8]) -> Result<(ChunkHeader, BitReader<'a>, Lattice<'a>), DecodeError> {
    let mut bits = BitReader::new(bytes);
    let header = ChunkHeader::read(&mut bits).ok_or(DecodeError::Truncated)?;
    if !header.geometry_is_sound() {
        return Err(DecodeError::BadGeometry);
    }
    let base = Lattice::new(base, header.stride);
    if header.check != base_check(base, header.patch) ^ bytes.len() as u8 {
        return Err(DecodeError::BaseMismatch);
    }
    Ok((header, bits, base))
}

/// How chunks are encoded; every decoder reads all of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Codec {
    /// For each chunk, the smaller result of the two.
    #[default]
    Auto,
    /// An indexed PNG of the changed part without its constant bytes.
    Png,
    /// Binary decisions with mixed contexts and a shipped prior.
    Context,
}

/// A codec name that is not one of `auto`, `png`, `context`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("unknown map codec; expected auto, png or context")]
pub struct UnknownCodecName;

impl FromStr for Codec {
    type Err = UnknownCodecName;

    fn from_str(name: &str) -> Result<Self, UnknownCodecName> {
        match name {
            "auto" => Ok(Self::Auto),
            "png" => Ok(Self::Png),
            "context" => Ok(Self::Context),
            _ => Err(UnknownCodecName),
        }
    }
}

impl fmt::Display for Codec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Png => "png",
            Self::Context => "context",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_as_the_codec_they_name() {
        for codec in [Codec::Auto, Codec::Png, Codec::Context] {
            assert_eq!(codec.to_string().parse(), Ok(codec));
        }
        assert!("zip".parse::<Codec>().is_err());
    }
}
