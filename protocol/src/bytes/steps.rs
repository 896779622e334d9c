//! Differences of points in as few bits as hold them, as in fences and paths.

use super::{BitReader, BitWriter};

/// A point or a difference of points, in decimetres.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct DecimetreStep {
    pub(crate) x_dm: i32,
    pub(crate) y_dm: i32,
}

impl DecimetreStep {
    /// The difference from `from` to `self`.
    pub(crate) fn since(self, from: Self) -> Self {
        Self { x_dm: self.x_dm.wrapping_sub(from.x_dm), y_dm: self.y_dm.wrapping_sub(from.y_dm) }
    }

    pub(crate) fn plus(self, step: Self) -> Self {
        Self { x_dm: self.x_dm.wrapping_add(step.x_dm), y_dm: self.y_dm.wrapping_add(step.y_dm) }
    }

    /// Appends both coordinates in two's complement, `width` bits each.
    pub(crate) fn put(self, bits: &mut BitWriter, width: u32) {
        for v in [self.x_dm, self.y_dm] {
            bits.put(v as u32 as u64, width);
        }
    }

    pub(crate) fn take(bits: &mut BitReader<'_>, width: u32) -> Option<Self> {
        let mut signed = || bits.take(width).map(|v| ((v as u32) << (32 - width)) as i32 >> (32 - width));
        Some(Self { x_dm: signed()?, y_dm: signed()? })
    }
}

/// Reads the width that precedes differences of this width.
pub(crate) fn take_width(bits: &mut BitReader<'_>) -> Option<u32> {
    let width = bits.take(5)? as u32;
    (1..=25).contains(&width).then_some(width)
}

/// The bits of the largest number in two's complement, 1 to 25.
pub(crate) fn width_of(steps: impl IntoIterator<Item = DecimetreStep>) -> u32 {
    let bits = |v: i32| 33 - (v ^ (v >> 31)).leading_zeros();
    steps.into_iter().map(|s| bits(s.x_dm).max(bits(s.y_dm))).max().unwrap_or(1).min(25)
}
