//! The `context` coder: binary decisions with mixed contexts (Mahoney, PAQ), in integers, from a
//! shipped prior for each chunk.

mod arith;
mod canvas;
mod decisions;
mod model;
mod prior;
mod stage;
pub mod training;

use super::header::ChunkHeader;
use super::patch::{DecodeError, Lattice, Patch};
use crate::bytes::{BitReader, BitWriter};
use crate::grid::Rect;
use arith::{BitCoder, Decoder, Encoder};
use canvas::Canvas;
use model::Model;
pub(super) use model::{best_chunk, prefix_chunk, quick_chunk};
use prior::Prior;
pub use training::Decision;
pub(super) use training::trace;

/// The length of the last row.
///
/// ```text
///  bits  1     as many as width - 1 has, if short
///      +-------+----------------------------------+
///      | short | cells of the last row, at least 1 |
///      +-------+----------------------------------+
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct LastRow(usize);

impl LastRow {
    fn bits(width: usize) -> u32 {
        (width - 1).checked_ilog2().map_or(0, |top| top + 1)
    }

    fn write(self, width: usize, out: &mut BitWriter) {
        out.bit(self.0 < width);
        if self.0 < width {
            out.put(self.0 as u64 - 1, Self::bits(width));
        }
    }

    fn read(width: usize, bits: &mut BitReader<'_>) -> Result<Self, DecodeError> {
        match bits.bit().ok_or(DecodeError::Truncated)? {
            false => Ok(Self(width)),
            true => {
                let cells = bits.take(Self::bits(width)).ok_or(DecodeError::Truncated)? as usize + 1;
                if cells < width { Ok(Self(cells)) } else { Err(DecodeError::Corrupt) }
            }
        }
    }
}

/// The cells of a patch in coding order, as (column, row).
fn order(width: usize, height: usize, last: LastRow) -> impl Iterator<Item = (usize, usize)> {
    let cells = (height - 1) * width + last.0;
    (0..cells).map(move |i| (i % width, i / width))
}

/// How much of a patch fits the room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Reach {
    cells: usize,
    /// Whether that is the whole patch.
    all: bool,
}

/// The chunk for the first `cells` of `patch`, and how many of them fit `room_bits`; the encoder stops there.
fn write(base: Lattice<'_>, head: &ChunkHeader, patch: &Patch, last: LastRow, room_bits: usize) -> (Vec<u8>, Reach) {
    let (width, height) = (patch.rect.width as usize, patch.rect.height as usize);
    let mut bits = BitWriter::default();
    head.write(&mut bits);
    last.write(width, &mut bits);
    let mut encoder = Encoder::new(bits);
    let mut canvas = Canvas::new(base, patch.rect);
    let mut model = Model::new(Prior::shipped());
    let mut cells = 0;
    for (place, &label) in order(width, height, last).zip(&patch.outcome) {
        let coded = model.code_cell(&mut encoder, &mut canvas, place, label);
        debug_assert!(coded.is_some());
        if encoder.bits() > room_bits {
            return (Vec::new(), Reach { cells, all: false });
        }
        cells += 1;
    }
    let mut bytes = encoder.finish();
    head.seal(&mut bytes);
    (bytes, Reach { cells, all: true })
}

/// Reads the body of a chunk for `rect`.
pub(super) fn read(mut bits: BitReader<'_>, base: Lattice<'_>, rect: Rect) -> Result<Patch, DecodeError> {
    let last = LastRow::read(rect.width as usize, &mut bits)?;
    let mut decoder = Decoder::new(bits);
    let canvas = read_cells(&mut decoder, base, rect, last)?;
    if decoder.ended_well() { Ok(canvas.into_patch(rect)) } else { Err(DecodeError::Corrupt) }
}

fn read_cells(coder: &mut impl BitCoder, base: Lattice<'_>, rect: Rect, last: LastRow) -> Result<Canvas, DecodeError> {
    let mut canvas = Canvas::new(base, rect);
    let mut model = Model::new(Prior::shipped());
    for place in order(rect.width as usize, rect.height as usize, last) {
        model.code_cell(coder, &mut canvas, place, 0).ok_or(DecodeError::Corrupt)?;
    }
    Ok(canvas)
}

/// The header of a `context` chunk for `rect`.
fn head(base: Lattice<'_>, rect: Rect) -> ChunkHeader {
    ChunkHeader::new(base, super::header::Body::Context, rect)
}
