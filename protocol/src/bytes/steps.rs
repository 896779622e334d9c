//! Differences of points in as few bits as hold them, as in fences and paths.

use super::{BitReader, BitWriter};
use crate::coordinates::DecimetrePoint;

/// Reads the width that precedes differences of this width.
pub(crate) fn take_width(bits: &mut BitReader<'_>) -> Option<u32> {
    let width = bits.take(5)? as u32;
    (1..=25).contains(&width).then_some(width)
}

pub(crate) fn put_pair(bits: &mut BitWriter, place: DecimetrePoint, width: u32) {
    for v in [place.x_dm, place.y_dm] {
        bits.put(v as u32 as u64, width);
    }
}

pub(crate) fn take_pair(bits: &mut BitReader<'_>, width: u32) -> Option<DecimetrePoint> {
    let mut signed = || bits.take(width).map(|v| ((v as u32) << (32 - width)) as i32 >> (32 - width));
    Some(DecimetrePoint { x_dm: signed()?, y_dm: signed()? })
}

pub(crate) fn minus(a: DecimetrePoint, b: DecimetrePoint) -> DecimetrePoint {
    DecimetrePoint { x_dm: a.x_dm.wrapping_sub(b.x_dm), y_dm: a.y_dm.wrapping_sub(b.y_dm) }
}

pub(crate) fn plus(a: DecimetrePoint, b: DecimetrePoint) -> DecimetrePoint {
    DecimetrePoint { x_dm: a.x_dm.wrapping_add(b.x_dm), y_dm: a.y_dm.wrapping_add(b.y_dm) }
}

/// The bits of the largest number in two's complement, 1 to 25.
pub(crate) fn width_of(steps: impl IntoIterator<Item = DecimetrePoint>) -> u32 {
    let bits = |v: i32| 33 - (v ^ (v >> 31)).leading_zeros();
    steps.into_iter().map(|s| bits(s.x_dm).max(bits(s.y_dm))).max().unwrap_or(1).min(25)
}
