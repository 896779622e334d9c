//! The header of a chunk: coder, position and size of the patch, check of the base.

use super::{MAX_PATCH_CELLS, MAX_PATCH_SIDE};
use crate::bytes::{BitReader, BitWriter};
use crate::grid::Rect;
use crate::map_codec::patch::{Lattice, Stride};
use crc::{CRC_8_AUTOSAR, Crc};

/// The coder of the body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Body {
    Png,
    Context,
}

/// The header of every chunk, most significant bit first, followed directly by the body.
///
/// ```text
///  bits  1      1        3            n + n         2           m + m              8
///      +------+--------+------------+-------------+-----------+------------------+-------+
///      | body | stride | place size | x, y        | side size | width-1 height-1 | check |
///      +------+--------+------------+-------------+-----------+------------------+-------+
/// ```
/// * body: 0 = png, 1 = context.
/// * stride: 0 = every cell, 1 = every fourth in both directions: all that follows, the margin too, is in such steps.
/// * place size: n = 7, 8, 9, 10, 11, 12, 16, 32 bits; x, y = south-west cell of the patch, two's complement.
/// * side size: m = 4, 6, 7, 10 bits; width x height at most [`MAX_PATCH_CELLS`].
/// * check: CRC-8 over the base in the patch and [`CHECK_MARGIN`] cells around it, xor the low byte of the length
///   of the chunk; so a byte too many or too few is refused too.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct ChunkHeader {
    pub(super) body: Body,
    pub(super) stride: Stride,
    pub(super) patch: Rect,
    pub(super) check: u8,
}

const PLACE_BITS: [u32; 8] = [7, 8, 9, 10, 11, 12, 16, 32];
const SIDE_BITS: [u32; 4] = [4, 6, 7, 10];
/// Cells around the patch that the check covers too.
pub(super) const CHECK_MARGIN: usize = 16;

impl ChunkHeader {
    #[cfg(test)]
    const MAX_BYTES: usize = 13;

    /// The header of a chunk for `patch`.
    pub(super) fn new(base: Lattice<'_>, body: Body, patch: Rect) -> Self {
        Self { body, stride: base.stride(), patch, check: base_check(base, patch) }
    }

    pub(super) fn write(&self, out: &mut BitWriter) {
        let ((place, n), (side, m)) = (self.place_size(), self.side_size());
        out.bit(self.body == Body::Context);
        out.bit(self.stride == Stride::Four);
        out.put(place, 3);
        out.put(self.patch.x as u64, n);
        out.put(self.patch.y as u64, n);
        out.put(side, 2);
        out.put(u64::from(self.patch.width - 1), m);
        out.put(u64::from(self.patch.height - 1), m);
        out.put(u64::from(self.check), 8);
    }

    /// Mixes the length of the finished chunk into its check.
    pub(super) fn seal(&self, chunk: &mut [u8]) {
        let at = (1 + 1 + 3 + 2 * self.place_size().1 + 2 + 2 * self.side_size().1) as usize;
        let length = (u16::from(chunk.len() as u8) << (8 - at % 8)).to_be_bytes();
        chunk.iter_mut().skip(at / 8).zip(length).for_each(|(byte, length)| *byte ^= length);
    }

    fn place_size(&self) -> (u64, u32) {
        smallest(&PLACE_BITS, |n| fits(self.patch.x, n) && fits(self.patch.y, n))
    }

    fn side_size(&self) -> (u64, u32) {
        smallest(&SIDE_BITS, |m| ((self.patch.width - 1) | (self.patch.height - 1)) >> m == 0)
    }

    /// Reads the header; `None` if the bits end early.
    pub(super) fn read(bits: &mut BitReader<'_>) -> Option<Self> {
        let body = if bits.bit()? { Body::Context } else { Body::Png };
        let stride = if bits.bit()? { Stride::Four } else { Stride::One };
        let n = *PLACE_BITS.get(bits.take(3)? as usize)?;
        let (x, y) = (signed(bits.take(n)?, n), signed(bits.take(n)?, n));
        let m = *SIDE_BITS.get(bits.take(2)? as usize)?;
        let (width, height) = (bits.take(m)? as u32 + 1, bits.take(m)? as u32 + 1);
        let check = bits.take(8)? as u8;
        Some(Self { body, stride, patch: Rect { x, y, width, height }, check })
    }

    /// Whether the patch keeps to the limits and lies on the 32-bit grid.
    pub(super) fn geometry_is_sound(&self) -> bool {
        let Rect { x, y, width, height } = self.patch;
        let on_grid = |from: i32, cells: u32| {
            let last = from.checked_add_unsigned(cells - 1);
            [Some(from), last].iter().all(|at| at.is_some_and(|at| at.checked_mul(self.stride.cells()).is_some()))
        };
        self.patch.area() <= MAX_PATCH_CELLS as u64
            && width.max(height) as usize <= MAX_PATCH_SIDE
            && on_grid(x, width)
            && on_grid(y, height)
    }
}

/// The check over the base against which a chunk for `patch` is coded.
pub(super) fn base_check(base: Lattice<'_>, patch: Rect) -> u8 {
    const CRC: Crc<u8> = Crc::<u8>::new(&CRC_8_AUTOSAR);
    let margin = CHECK_MARGIN as i64;
    let (width, height) = (patch.width as usize + 2 * CHECK_MARGIN, patch.height as usize + 2 * CHECK_MARGIN);
    CRC.checksum(&base.copy_area(i64::from(patch.x) - margin, i64::from(patch.y) - margin, width, height))
}

/// The index and value of the first size that suffices, or of the last one.
fn smallest(sizes: &[u32], holds: impl Fn(u32) -> bool) -> (u64, u32) {
    let mut classes = (0..).zip(sizes.iter().copied());
    let last = classes.clone().last().unwrap_or_default();
    classes.find(|&(_, n)| holds(n)).unwrap_or(last)
}

fn fits(value: i32, bits: u32) -> bool {
    bits >= 32 || (-(1i32 << (bits - 1))..1i32 << (bits - 1)).contains(&value)
}

fn signed(value: u64, bits: u32) -> i32 {
    ((value << (64 - bits)) as i64 >> (64 - bits)) as i32
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, clippy::unwrap_used)]
mod tests {
    use super::*;

    fn bytes_of(header: ChunkHeader) -> Vec<u8> {
        let mut out = BitWriter::default();
        header.write(&mut out);
        out.into_bytes()
    }

    #[test]
    fn a_typical_header_keeps_its_golden_bytes() {
        let patch = Rect { x: 200, y: -3, width: 40, height: 24 };
        let header = ChunkHeader { body: Body::Context, stride: Stride::One, patch, check: 0xA5 };
        // 1 | 0 | 010 | 011001000 | 111111101 | 01 | 100111 | 010111 | 10100101 | 000
        assert_eq!(bytes_of(header), [0x93, 0x23, 0xFA, 0xCE, 0xBD, 0x28]);
        // Six bytes: xor 00000110 into the check.
        let mut bytes = bytes_of(header);
        header.seal(&mut bytes);
        assert_eq!(bytes, [0x93, 0x23, 0xFA, 0xCE, 0xBD, 0x18]);
    }

    #[test]
    fn headers_of_any_size_read_back() {
        for (x, y) in [(0, 0), (127, -128), (128, 0), (-1024, 1023), (-1025, 9), (40_000, -1), (i32::MAX, i32::MIN)] {
            for (width, height) in [(1, 1), (16, 16), (17, 3), (64, 65), (1024, 64)] {
                for stride in [Stride::One, Stride::Four] {
                    let header = ChunkHeader { body: Body::Png, stride, patch: Rect { x, y, width, height }, check: 7 };
                    let bytes = bytes_of(header);
                    assert!(bytes.len() <= ChunkHeader::MAX_BYTES);
                    assert_eq!(ChunkHeader::read(&mut BitReader::new(&bytes)), Some(header));
                }
            }
        }
    }
}
