//! Polygons in whole decimetres, on which every predicate is exact, their outlines on the wire, and the weighted areas that
//! matter to the operator whatever lies there.
//!
//! ```text
//! +-----------+-----+---------------------------------+
//! | n - 3: 5  | w: 5| dx, dy: w + w, for each vertex  |
//! +-----------+-----+---------------------------------+
//! ```
//! * n: vertices, 3 to 34. w: bits of a difference, 1 to 25, two's complement, decimetres.
//! * dx, dy: from the previous vertex, the first one from the anchor.

use crate::bytes::{BitReader, BitWriter, DecimetreStep, take_width, width_of};
use crate::coordinates::DecimetrePoint;

/// A polygon, the last vertex joined to the first; it may turn either way.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Polygon(pub Vec<DecimetrePoint>);

/// Why a polygon is not valid. Vertices and edges count from 1; edge n begins at vertex n.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PolygonFault {
    /// Fewer than 3 or more than [`Polygon::MAX_VERTICES`] vertices.
    #[error("{0} vertices: it takes 3 to {most}", most = Polygon::MAX_VERTICES)]
    Vertices(usize),
    /// A vertex is beyond the range of the wire.
    #[error("vertex {0} lies more than 838 km from the origin")]
    TooFar(usize),
    /// Two neighbouring vertices are equal.
    #[error("vertex {0} is at the same place as the one before it, to the decimetre")]
    Repeated(usize),
    /// All vertices lie on one line.
    #[error("it has no area")]
    NoArea,
    /// Two edges cross or touch.
    #[error("edge {0} crosses or touches edge {1}")]
    Crossing(usize, usize),
}

impl Polygon {
    /// The most vertices that the layout can count.
    pub const MAX_VERTICES: usize = 34;

    /// Checks whether this is a simple polygon within the range of the wire.
    pub fn check(&self) -> Result<(), PolygonFault> {
        let n = self.0.len();
        if !(3..=Self::MAX_VERTICES).contains(&n) {
            return Err(PolygonFault::Vertices(n));
        }
        if let Some(far) = self.0.iter().position(|p| !p.is_in_range()) {
            return Err(PolygonFault::TooFar(far + 1));
        }
        let edges: Vec<(DecimetrePoint, DecimetrePoint)> = self.edges().collect();
        if let Some(same) = edges.iter().position(|(a, b)| a == b) {
            return Err(PolygonFault::Repeated((same + 1) % n + 1));
        }
        let Some(&first) = self.0.first() else { return Err(PolygonFault::Vertices(0)) };
        if edges.iter().all(|&(a, b)| cross(first, a, b) == 0) {
            return Err(PolygonFault::NoArea);
        }
        for (i, &(a, b)) in edges.iter().enumerate() {
            for (j, &(c, d)) in edges.iter().enumerate().skip(i + 1) {
                let meets = match (j == i + 1, i == 0 && j == n - 1) {
                    (true, _) => folds_back(a, b, d),
                    (_, true) => folds_back(c, d, b),
                    _ => segments_meet((a, b), (c, d)),
                };
                if meets {
                    return Err(PolygonFault::Crossing(i + 1, j + 1));
                }
            }
        }
        Ok(())
    }

    /// All edges; the closing one comes last.
    pub fn edges(&self) -> impl Iterator<Item = (DecimetrePoint, DecimetrePoint)> + '_ {
        self.0.iter().copied().zip(self.0.iter().copied().cycle().skip(1))
    }

    /// Whether a point lies inside or on an edge.
    pub fn contains(&self, p: DecimetrePoint) -> bool {
        let mut inside = false;
        for (a, b) in self.edges() {
            if cross(a, b, p) == 0 && is_between(a, b, p) {
                return true;
            }
            if (a.north_dm > p.north_dm) != (b.north_dm > p.north_dm) {
                inside ^= (cross(a, b, p) > 0) == (b.north_dm > a.north_dm);
            }
        }
        inside
    }

    /// Whether an edge of this polygon crosses or touches one of the other.
    pub(super) fn meets(&self, other: &Self) -> bool {
        self.edges().any(|e| other.edges().any(|f| segments_meet(e, f)))
    }
}

/// Twice the area of the triangle, positive if it turns left.
fn cross(a: DecimetrePoint, b: DecimetrePoint, c: DecimetrePoint) -> i64 {
    let d = |p: i32, q: i32| i64::from(p) - i64::from(q);
    d(b.east_dm, a.east_dm) * d(c.north_dm, a.north_dm) - d(b.north_dm, a.north_dm) * d(c.east_dm, a.east_dm)
}

/// Whether `p` lies in the bounding box of `a` and `b`.
fn is_between(a: DecimetrePoint, b: DecimetrePoint, p: DecimetrePoint) -> bool {
    (a.east_dm.min(b.east_dm)..=a.east_dm.max(b.east_dm)).contains(&p.east_dm)
        && (a.north_dm.min(b.north_dm)..=a.north_dm.max(b.north_dm)).contains(&p.north_dm)
}

/// Whether the path from `a` over `b` to `c` reverses its direction at `b`.
fn folds_back(a: DecimetrePoint, b: DecimetrePoint, c: DecimetrePoint) -> bool {
    cross(a, b, c) == 0 && (is_between(a, b, c) || is_between(b, c, a))
}

fn segments_meet((a, b): (DecimetrePoint, DecimetrePoint), (c, d): (DecimetrePoint, DecimetrePoint)) -> bool {
    let (s, t) = (cross(a, b, c).signum() * cross(a, b, d).signum(), cross(c, d, a).signum() * cross(c, d, b).signum());
    let touches = |p: DecimetrePoint, q: DecimetrePoint, r: DecimetrePoint| cross(p, q, r) == 0 && is_between(p, q, r);
    (s < 0 && t < 0) || touches(a, b, c) || touches(a, b, d) || touches(c, d, a) || touches(c, d, b)
}

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

/// An outline in the world frame, and the weight that each cell inside has in addition to that of its label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WeightedArea {
    /// The outline; cells with their centre inside or on it have the weight.
    pub outline: Polygon,
    /// In hundredths, -100 (avoid) to 100 (seek).
    pub weight: i8,
}

/// Up to four weighted areas. The weights of areas that overlap add up.
///
/// Bits follow each other, the most significant first; the last byte is filled with zeros.
///
/// ```text
///  bits   3        48       8         10 + 2w (n-1)
///       +-------+--------+--------+-------------+--------+-------------+---------
///       | areas | anchor | weight | an outline  | weight | an outline  | zeros
///       +-------+--------+--------+-------------+--------+-------------+---------
/// ```
/// * areas: 0 to 4.
/// * anchor: x, y of the very first vertex, decimetres, two's complement, within 838 860.7 m; left out without areas.
/// * weight: hundredths, two's complement, -100 to 100.
/// * an outline: as in a [`Fence`](super::Fence); the first outline has no first vertex, which is the anchor.
///
/// Source: surface. Three areas of four corners with edges of up to 50 m take at most 43 bytes.
///
/// ```
/// use scenecast_protocol::coordinates::DecimetrePoint;
/// use scenecast_protocol::directive::{Areas, Polygon, WeightedArea};
///
/// let corners = [(0, 0), (400, 0), (400, 300)].map(|(x, y)| DecimetrePoint::new(x, y));
/// let areas = Areas(vec![WeightedArea { outline: Polygon(corners.into()), weight: 60 }]);
/// assert_eq!(areas.check(), Ok(()));
/// assert_eq!(Areas::from_bytes(&areas.to_bytes()), Some(areas));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Areas(pub Vec<WeightedArea>);

/// Why areas are not valid. Areas count from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AreasFault {
    /// There are more areas than the layout can count.
    #[error("{0} areas: it takes {most} or fewer", most = Areas::MAX)]
    TooMany(usize),
    /// An outline is not a valid polygon.
    #[error("area {0}: {1}")]
    Outline(usize, PolygonFault),
    /// A weight is out of range.
    #[error("area {0}: weight {1} hundredths: it takes -100 to 100")]
    Weight(usize, i8),
}

impl Areas {
    /// The most areas that one order has.
    pub const MAX: usize = 4;

    /// Checks whether a vehicle could obey these areas.
    pub fn check(&self) -> Result<(), AreasFault> {
        if self.0.len() > Self::MAX {
            return Err(AreasFault::TooMany(self.0.len()));
        }
        for (number, area) in (1..).zip(&self.0) {
            area.outline.check().map_err(|fault| AreasFault::Outline(number, fault))?;
            if !(-100..=100).contains(&area.weight) {
                return Err(AreasFault::Weight(number, area.weight));
            }
        }
        Ok(())
    }

    /// Encodes the payload. Areas that [`Self::check`] refuses are cut to the limits of the layout.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bits = BitWriter::default();
        let areas = self.0.get(..Self::MAX).unwrap_or(&self.0);
        let first = areas.first().and_then(|area| area.outline.0.first()).copied();
        bits.put(if first.is_some() { areas.len() as u64 } else { 0 }, 3);
        let Some(anchor) = first else { return bits.into_bytes() };
        step_to(anchor).put(&mut bits, 24);
        for (i, area) in areas.iter().enumerate() {
            bits.put(u64::from(area.weight as u8), 8);
            put_outline(&mut bits, &area.outline, anchor, i == 0);
        }
        bits.into_bytes()
    }

    /// Decodes a payload; `None` if it has another layout. [`Self::check`] must still be called.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let count = bits.take(3)? as usize;
        let mut areas = Vec::new();
        if count > 0 {
            let anchor = DecimetreStep::take(&mut bits, 24)?;
            for i in 0..count.min(Self::MAX + 1) {
                let weight = bits.take(8)? as u8 as i8;
                areas.push(WeightedArea { outline: take_outline(&mut bits, anchor, i == 0)?, weight });
            }
        }
        let is_whole = areas.len() == count && count <= Self::MAX;
        bits.rest_of_bytes().filter(|rest| rest.is_empty() && is_whole).map(|_| Self(areas))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::DecimetrePoint;
    use proptest::prelude::*;

    fn polygon(vertices: &[(i32, i32)]) -> Polygon {
        Polygon(vertices.iter().map(|&(x, y)| DecimetrePoint::new(x, y)).collect())
    }

    #[test]
    fn simple_polygons_of_either_sense_are_sound() {
        assert_eq!(polygon(&[(0, 0), (10, 0), (10, 10), (0, 10)]).check(), Ok(()));
        assert_eq!(polygon(&[(0, 10), (10, 10), (10, 0), (0, 0)]).check(), Ok(()));
        assert_eq!(polygon(&[(0, 0), (40, 0), (40, 40), (20, 10), (0, 40)]).check(), Ok(()), "not convex");
        assert_eq!(polygon(&[(0, 0), (5, 0), (10, 0), (10, 10)]).check(), Ok(()), "a vertex on a straight edge");
        let far = DecimetrePoint::MAX_DM;
        assert_eq!(polygon(&[(-far, -far), (far, -far), (far, far), (-far, far)]).check(), Ok(()));
    }

    #[test]
    fn invalid_polygons_are_refused_with_the_fault() {
        use PolygonFault::*;
        assert_eq!(polygon(&[(0, 0), (10, 0)]).check(), Err(Vertices(2)));
        assert_eq!(polygon(&[]).check(), Err(Vertices(0)));
        assert_eq!(polygon(&[(0, 0); 35]).check(), Err(Vertices(35)));
        assert_eq!(polygon(&[(0, 0), (10, 0), (20, 0)]).check(), Err(NoArea));
        assert_eq!(polygon(&[(0, 0), (10, 10), (10, 0), (0, 10)]).check(), Err(Crossing(1, 3)), "a bow tie");
        assert_eq!(polygon(&[(0, 0), (10, 0), (10, 0), (0, 10)]).check(), Err(Repeated(3)));
        assert_eq!(polygon(&[(0, 0), (10, 0), (0, 10), (0, 0)]).check(), Err(Repeated(1)));
        assert_eq!(polygon(&[(0, 0), (20, 0), (10, 0), (10, 10)]).check(), Err(Crossing(1, 2)), "a spike");
        assert_eq!(polygon(&[(0, 0), (20, 0), (20, 20), (10, 0), (0, 20)]).check(), Err(Crossing(1, 3)), "a pinch");
        assert_eq!(polygon(&[(0, 0), (i32::MAX, 0), (0, i32::MIN)]).check(), Err(TooFar(2)));
    }

    #[test]
    fn a_point_is_inside_on_the_edge_or_outside() {
        let u = polygon(&[(0, 0), (30, 0), (30, 30), (20, 30), (20, 10), (10, 10), (10, 30), (0, 30)]);
        assert_eq!(u.check(), Ok(()));
        for (x, y, inside) in [
            (5, 20, true),
            (15, 20, false),
            (25, 20, true),
            (15, 5, true),
            (15, 10, true),
            (30, 30, true),
            (31, 5, false),
            (-1, 30, false),
        ] {
            assert_eq!(u.contains(DecimetrePoint::new(x, y)), inside, "{x}, {y}");
        }
    }

    fn area(corners: &[(i32, i32)], weight: i8) -> WeightedArea {
        let outline = Polygon(corners.iter().map(|&(x, y)| DecimetrePoint::new(x, y)).collect());
        WeightedArea { outline, weight }
    }

    #[test]
    fn golden_bytes_of_weighted_areas() {
        let areas = Areas(vec![area(&[(100, 50), (300, 50), (300, 200)], 60), area(&[(0, 0), (40, 0), (0, 40)], -20)]);
        assert_eq!(areas.check(), Ok(()));
        let bytes = areas.to_bytes();
        let golden = [
            0x40, 0x00, 0x0C, 0x80, 0x00, 0x06, 0x47, 0x80, 0x4B, 0x20, 0x00, 0x00, 0x4B, 0x76, 0x01, 0x13, 0x99, 0xC5,
            0x00, 0x1B, 0x05, 0x00,
        ];
        assert_eq!(bytes, golden, "{bytes:02X?}");
        assert_eq!(Areas::from_bytes(&bytes), Some(areas));
        assert_eq!(Areas::default().to_bytes(), [0]);
        assert_eq!(Areas::from_bytes(&[0]), Some(Areas::default()));
    }

    #[test]
    fn three_areas_with_four_corners_fit_a_keyed_frame_of_64_bytes() {
        let square = |x: i32, y: i32| area(&[(x, y), (x + 500, y + 40), (x + 460, y + 500), (x - 40, y + 450)], 100);
        let areas =
            Areas(vec![square(8_000_000, -8_000_000), square(8_000_500, -8_000_500), square(8_000_300, -8_000_000)]);
        assert_eq!(areas.check(), Ok(()));
        // Three bytes of the slot's head, 13 of the frame's header, 4 of a tag and 1 of the chunk's head.
        assert!(areas.to_bytes().len() <= 43, "{} bytes", areas.to_bytes().len());
    }

    #[test]
    fn areas_that_no_vehicle_can_obey_are_refused() {
        let sound = area(&[(0, 0), (40, 0), (0, 40)], 100);
        assert_eq!(Areas(vec![sound.clone(); 5]).check(), Err(AreasFault::TooMany(5)));
        let flat = area(&[(0, 0), (1, 1), (2, 2)], 1);
        assert_eq!(Areas(vec![sound.clone(), flat]).check(), Err(AreasFault::Outline(2, PolygonFault::NoArea)));
        let heavy = WeightedArea { weight: 101, ..sound };
        assert_eq!(Areas(vec![heavy]).check(), Err(AreasFault::Weight(1, 101)));
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Some(areas) = Areas::from_bytes(&bytes) {
                let _ = areas.check();
            }
        }

        #[test]
        fn areas_round_trip(
            outlines in proptest::collection::vec(
                (proptest::collection::vec((-8_388_607i32..=8_388_607, -8_388_607i32..=8_388_607), 3..34), any::<i8>()), 0..5),
        ) {
            let areas = Areas(outlines.iter().map(|(outline, weight)| area(outline, *weight)).collect());
            prop_assert_eq!(Areas::from_bytes(&areas.to_bytes()), Some(areas));
        }
    }
}
