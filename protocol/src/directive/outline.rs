//! Outlines on the wire: polygons as steps from vertex to vertex, the first from an anchor that a payload has once.
//!
//! ```text
//! +-----------+-----+---------------------------------+
//! | n - 3: 5  | w: 5| dx, dy: w + w, for each vertex  |
//! +-----------+-----+---------------------------------+
//! ```
//! * n: vertices, 3 to 34. w: bits of a difference, 1 to 25, two's complement, decimetres.
//! * dx, dy: from the previous vertex, the first one from the anchor.

use super::polygon::Polygon;
use crate::bytes::{BitReader, BitWriter, DecimetreStep, take_width, width_of};
use crate::coordinates::DecimetrePoint;

/// Writes an outline; the first of a payload without its first vertex, which is the anchor.
pub(super) fn put_outline(bits: &mut BitWriter, outline: &Polygon, anchor: DecimetrePoint, is_first: bool) {
    let vertices = outline.0.get(..Polygon::MAX_VERTICES).unwrap_or(&outline.0);
    let before = std::iter::once(anchor).chain(vertices.iter().copied());
    let steps = vertices.iter().zip(before).map(|(&v, b)| step_to(v).since(step_to(b)));
    let steps: Vec<DecimetreStep> = steps.skip(usize::from(is_first)).collect();
    let width = width_of(steps.iter().copied());
    bits.put((vertices.len() as u64).saturating_sub(3), 5);
    bits.put(u64::from(width), 5);
    steps.into_iter().for_each(|step| step.put(bits, width));
}

/// Reads what [`put_outline`] writes. [`Polygon::check`] must still be called.
pub(super) fn take_outline(bits: &mut BitReader<'_>, anchor: DecimetreStep, is_first: bool) -> Option<Polygon> {
    let n = bits.take(5)? + 3;
    let width = take_width(bits)?;
    let mut vertices = Vec::with_capacity(n as usize);
    if is_first {
        vertices.push(anchor);
    }
    while (vertices.len() as u64) < n {
        let before = vertices.last().copied().unwrap_or(anchor);
        vertices.push(before.plus(DecimetreStep::take(bits, width)?));
    }
    Some(Polygon(vertices.into_iter().map(point_at).collect()))
}

/// The step from the origin to a point.
pub(super) fn step_to(point: DecimetrePoint) -> DecimetreStep {
    DecimetreStep { x_dm: point.east_dm, y_dm: point.north_dm }
}

/// The point at a step from the origin.
pub(super) fn point_at(step: DecimetreStep) -> DecimetrePoint {
    DecimetrePoint { east_dm: step.x_dm, north_dm: step.y_dm }
}
