//! Conversion between patches and scanlines.

use std::collections::BTreeMap;

use crate::bytes::{BitReader, BitWriter};
use crate::grid::{MAX_LABEL, Rect, UNEXPLORED};
use crate::map_codec::DecodeError;
use crate::map_codec::window::Patch;

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
