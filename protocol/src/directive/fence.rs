//! The fence: where the vehicle may be.

use super::polygon::{Polygon, PolygonFault, point_at, put_outline, step_to, take_outline};
use crate::bytes::{BitReader, BitWriter, DecimetreStep, take_width, width_of};
use crate::coordinates::DecimetrePoint;

/// The outline that the vehicle stays in, the keep-outs that it stays out of, and the return point; all in the world
/// frame.
///
/// Bits follow each other, the most significant first; the last byte is filled with zeros.
///
/// ```text
///  bits   1       4          1        48        10 + 2w (n-1)             2w
///       +-------+----------+--------+--------+-------------------------+--------------+---------
///       | fence | keep-outs| return | anchor | an outline, for each    | return point | zeros
///       +-------+----------+--------+--------+-------------------------+--------------+---------
///  an outline:
///       +-----------+-----+---------------------------------+
///       | n - 3: 5  | w: 5| dx, dy: w + w, for each vertex  |
///       +-----------+-----+---------------------------------+
/// ```
/// * fence, return: whether there is one; keep-outs: 0 to 15. The fence comes first.
/// * anchor: x, y of the first vertex, or of the return point if there is no outline: decimetres, two's complement,
///   within 838 860.7 m; left out if there is neither.
/// * n: vertices, 3 to 34. w: bits of a difference, 1 to 25, two's complement, decimetres.
/// * dx, dy: from the previous vertex; a later outline's first vertex from the anchor. The very first vertex is the
///   anchor and is left out.
/// * return point: from the anchor, in a width of its own, written before it in 5 bits; left out if it is the anchor.
///
/// Source: surface. Eight vertices with edges of up to 800 m and a return point take at most 37 bytes, which fit a
/// frame of 64 bytes under a key; without one, edges may have 6 km.
///
/// ```
/// use scenecast_protocol::coordinates::DecimetrePoint;
/// use scenecast_protocol::directive::{Fence, FenceFault, Polygon};
///
/// let square = |low, high| {
///     Polygon([(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| DecimetrePoint::new(x, y)).into())
/// };
/// let fence = Fence { fence: Some(square(0, 400)), keep_outs: vec![square(10, 50)], return_point: None };
/// assert_eq!(fence.check(), Ok(()));
/// assert!(fence.allows(DecimetrePoint::new(100, 100)) && !fence.allows(DecimetrePoint::new(20, 20)));
/// let closed = Fence { keep_outs: vec![square(-10, 500)], ..fence };
/// assert_eq!(closed.check(), Err(FenceFault::NothingLeft(1)));
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Fence {
    /// The outline that the vehicle stays inside.
    pub fence: Option<Polygon>,
    /// Outlines that the vehicle stays outside of, at most [`Self::MAX_KEEP_OUTS`].
    pub keep_outs: Vec<Polygon>,
    /// The goal of a return; `None` is the point where the vehicle's run began.
    pub return_point: Option<DecimetrePoint>,
}

/// Why a fence is refused. Keep-outs are counted from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FenceFault {
    /// The fence is not a valid polygon.
    #[error("fence: {0}")]
    Fence(PolygonFault),
    /// A keep-out is not a valid polygon.
    #[error("keep_outs: outline {0}: {1}")]
    KeepOut(usize, PolygonFault),
    /// There are more keep-outs than the layout can count.
    #[error("keep_outs: {0} outlines: it takes 15 or fewer")]
    TooMany(usize),
    /// A keep-out covers the whole fence.
    #[error("keep_outs: outline {0} covers the whole fence: nothing is left")]
    NothingLeft(usize),
    /// The return point is outside the fence.
    #[error("return_point lies outside the fence")]
    ReturnOutside,
    /// The return point is inside a keep-out.
    #[error("return_point lies in keep-out {0}")]
    ReturnKeptOut(usize),
    /// The return point is too far from the origin.
    #[error("return_point lies more than 838 km from the origin")]
    ReturnTooFar,
}

impl Fence {
    /// The most keep-outs that the layout can count.
    pub const MAX_KEEP_OUTS: usize = 15;

    /// Checks whether a vehicle could obey the fence.
    pub fn check(&self) -> Result<(), FenceFault> {
        if let Some(fence) = &self.fence {
            fence.check().map_err(FenceFault::Fence)?;
        }
        if self.keep_outs.len() > Self::MAX_KEEP_OUTS {
            return Err(FenceFault::TooMany(self.keep_outs.len()));
        }
        for (i, keep_out) in (1..).zip(&self.keep_outs) {
            keep_out.check().map_err(|fault| FenceFault::KeepOut(i, fault))?;
            let covers = |f: &Polygon| f.0.iter().all(|&v| keep_out.contains(v)) && !f.meets(keep_out);
            if self.fence.as_ref().is_some_and(covers) {
                return Err(FenceFault::NothingLeft(i));
            }
        }
        let Some(home) = self.return_point else { return Ok(()) };
        if DecimetrePoint::nearest(home.to_world()).is_none() {
            return Err(FenceFault::ReturnTooFar);
        }
        if self.fence.as_ref().is_some_and(|f| !f.contains(home)) {
            return Err(FenceFault::ReturnOutside);
        }
        match self.keep_outs.iter().position(|k| k.contains(home)) {
            Some(i) => Err(FenceFault::ReturnKeptOut(i + 1)),
            None => Ok(()),
        }
    }

    /// Whether the vehicle may be at a point.
    pub fn allows(&self, place: DecimetrePoint) -> bool {
        self.fence.as_ref().is_none_or(|f| f.contains(place)) && !self.keep_outs.iter().any(|k| k.contains(place))
    }

    /// Every outline; the fence comes first.
    pub fn outlines(&self) -> impl Iterator<Item = &Polygon> {
        self.fence.iter().chain(&self.keep_outs)
    }

    /// Encodes the payload. A fence that [`Self::check`] refuses is cut to the limits of the layout.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bits = BitWriter::default();
        let keep_outs = self.keep_outs.len().min(Self::MAX_KEEP_OUTS);
        bits.bit(self.fence.is_some());
        bits.put(keep_outs as u64, 4);
        bits.bit(self.return_point.is_some());
        let outlines = || self.fence.iter().chain(self.keep_outs.iter().take(keep_outs));
        let first = outlines().next().and_then(|o| o.0.first()).copied();
        let Some(anchor) = first.or(self.return_point) else { return bits.into_bytes() };
        step_to(anchor).put(&mut bits, 24);
        for (i, outline) in outlines().enumerate() {
            put_outline(&mut bits, outline, anchor, i == 0);
        }
        if let Some(home) = self.return_point.filter(|_| first.is_some()) {
            let step = step_to(home).since(step_to(anchor));
            let width = width_of([step]);
            bits.put(u64::from(width), 5);
            step.put(&mut bits, width);
        }
        bits.into_bytes()
    }

    /// Decodes a payload; `None` if it has another layout. [`Self::check`] must still be called.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let has_fence = bits.bit()?;
        let keep_outs = bits.take(4)?;
        let has_return = bits.bit()?;
        let mut read = Self::default();
        let outlines = u64::from(has_fence) + keep_outs;
        if outlines > 0 || has_return {
            let anchor = DecimetreStep::take(&mut bits, 24)?;
            for i in 0..outlines {
                let outline = take_outline(&mut bits, anchor, i == 0)?;
                if has_fence && i == 0 { read.fence = Some(outline) } else { read.keep_outs.push(outline) }
            }
            read.return_point = match (has_return, outlines) {
                (false, _) => None,
                (true, 0) => Some(point_at(anchor)),
                (true, _) => {
                    let width = take_width(&mut bits)?;
                    Some(point_at(anchor.plus(DecimetreStep::take(&mut bits, width)?)))
                }
            };
        }
        bits.rest_of_bytes().filter(|rest| rest.is_empty()).map(|_| read)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn polygon(vertices: &[(i32, i32)]) -> Polygon {
        Polygon(vertices.iter().map(|&(x, y)| DecimetrePoint::new(x, y)).collect())
    }

    fn square(x: i32, y: i32, side: i32) -> Polygon {
        polygon(&[(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
    }

    #[test]
    fn golden_bytes_of_a_fence() {
        let fence = Fence {
            fence: Some(square(-100, 50, 400)),
            keep_outs: vec![polygon(&[(0, 100), (50, 100), (0, 180)])],
            return_point: Some(DecimetrePoint::new(-90, 60)),
        };
        assert_eq!(fence.check(), Ok(()));
        let bytes = fence.to_bytes();
        let golden = [
            0x8F, 0xFF, 0xFE, 0x70, 0x00, 0x00, 0xC8, 0x2A, 0x64, 0x00, 0x00, 0x01, 0x90, 0x9C, 0x00, 0x00, 0x21, 0x90,
            0xC8, 0xC8, 0x03, 0x39, 0x40, 0xAA, 0x50,
        ];
        assert_eq!(bytes, golden, "{bytes:02X?}");
        assert_eq!(Fence::from_bytes(&bytes), Some(fence));
        assert_eq!(Fence::default().to_bytes(), [0]);
        let home = Fence { return_point: Some(DecimetrePoint::new(1, -1)), ..Fence::default() };
        assert_eq!(home.to_bytes(), [0x04, 0, 0, 0x07, 0xFF, 0xFF, 0xFC]);
        assert_eq!(Fence::from_bytes(&home.to_bytes()), Some(home));
    }

    #[test]
    fn eight_vertices_and_a_return_point_fit_a_keyed_frame() {
        let r = 8_000.0f64;
        let octagon = (0..8).map(|i| f64::from(i) * std::f64::consts::FRAC_PI_4);
        let vertices =
            octagon.map(|a| DecimetrePoint::new((r * a.cos()) as i32 - 8_000_000, (r * a.sin()) as i32 + 7_000_000));
        let fence = Polygon(vertices.collect());
        let return_point = Some(DecimetrePoint::new(-8_000_000, 7_000_000));
        let fence = Fence { fence: Some(fence), keep_outs: Vec::new(), return_point };
        assert_eq!(fence.check(), Ok(()));
        // Five bytes of the slot's head, 13 of the frame's header, 8 of a tag.
        assert!(fence.to_bytes().len() <= 64 - 13 - 8 - 5, "{} bytes", fence.to_bytes().len());
    }

    #[test]
    fn a_fence_that_no_vehicle_can_obey_is_refused() {
        let fence = |f: Polygon, k: &[Polygon], home: Option<(i32, i32)>| {
            let return_point = home.map(|(x, y)| DecimetrePoint::new(x, y));
            Fence { fence: Some(f), keep_outs: k.to_vec(), return_point }.check()
        };
        let field = square(0, 0, 100);
        assert_eq!(fence(field.clone(), &[square(50, 50, 100)], Some((10, 10))), Ok(()));
        assert_eq!(fence(field.clone(), &[], Some((200, 10))), Err(FenceFault::ReturnOutside));
        assert_eq!(fence(field.clone(), &[square(5, 5, 10)], Some((10, 10))), Err(FenceFault::ReturnKeptOut(1)));
        assert_eq!(fence(field.clone(), &[square(-5, -5, 200)], None), Err(FenceFault::NothingLeft(1)));
        let flat = polygon(&[(0, 0), (1, 1), (2, 2)]);
        assert_eq!(fence(field.clone(), &[flat], None), Err(FenceFault::KeepOut(1, PolygonFault::NoArea)));
        assert_eq!(fence(field.clone(), &vec![square(1, 1, 2); 16], None), Err(FenceFault::TooMany(16)));
        let bow = polygon(&[(0, 0), (10, 10), (10, 0), (0, 10)]);
        let fault = fence(bow, &[], None).unwrap_err();
        assert_eq!(fault.to_string(), "fence: edge 1 crosses or touches edge 3");
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Some(fence) = Fence::from_bytes(&bytes) {
                let _ = fence.check();
            }
        }

        #[test]
        fn outlines_round_trip(
            outlines in proptest::collection::vec(
                proptest::collection::vec((-8_388_607i32..=8_388_607, -8_388_607i32..=8_388_607), 3..34), 0..5),
            has_fence: bool,
            home in proptest::option::of((-8_388_607i32..=8_388_607, -8_388_607i32..=8_388_607)),
        ) {
            let mut outlines: Vec<Polygon> = outlines.iter().map(|o| polygon(o)).collect();
            let fence = if has_fence { outlines.pop() } else { None };
            let return_point = home.map(|(x, y)| DecimetrePoint::new(x, y));
            let fence = Fence { fence, keep_outs: outlines, return_point };
            prop_assert_eq!(Fence::from_bytes(&fence.to_bytes()), Some(fence));
        }
    }
}
