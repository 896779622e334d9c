//! The corners of the track that the vehicle travelled before a pose.

use super::status::StatusError;
use crate::bytes::{BitReader, BitWriter, DecimetreStep, Reader, decimetres, width_of};
use crate::coordinates::MapPoint;

/// A corner of the track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrailCorner {
    /// Whole seconds before the pose.
    pub ago_s: u8,
    /// The place, in the map frame.
    pub place: MapPoint,
}

/// The corners between the last poses, so that the surface knows the track and not only single positions of it.
///
/// ```text
///   4     4     for each corner, the latest first      0 to 7
/// +----+-----+-----------------------------------------+-------
/// | n  | w-1 |  8 bits: age   2w bits: dx, dy          | zeros
/// +----+-----+-----------------------------------------+-------
/// ```
/// * n: 1 to 15 corners.
/// * w: bits of a difference, 1 to 16, two's complement, decimetres, the fewest that hold all.
/// * age: seconds before the pose, 0 to 255, not less than that of the later corner.
/// * dx, dy: from the later corner, the first from the position of the pose; never both 0.
///
/// Source: vehicle, among the [`super::PoseDetails`]. Between two corners the vehicle went straight, within
/// some decimetres.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Trail(Vec<(u8, DecimetreStep)>);

impl Trail {
    /// The most corners in a trail.
    pub const MAX_CORNERS: usize = 15;
    /// The widest difference, bits: 3.2 km.
    const MAX_WIDTH: u32 = 16;

    /// The trail to `position` over corners, the latest first. It ends before a corner that has no room, is one too many or too far
    /// away; `None` if no corner is left.
    pub fn new(position: MapPoint, corners: &[TrailCorner], room: usize) -> Option<Self> {
        let mut later = step_to(position);
        let mut steps = Vec::new();
        for corner in corners {
            let step = step_to(corner.place).since(later);
            if width_of([step]) > Self::MAX_WIDTH {
                break;
            }
            if step != DecimetreStep::default() {
                steps.push((corner.ago_s, step));
                later = later.plus(step);
            }
        }
        steps.truncate(Self::MAX_CORNERS);
        let mut trail = Self(steps);
        while trail.encode().len() > room {
            trail.0.pop();
        }
        (!trail.0.is_empty()).then_some(trail)
    }

    /// The bytes on the wire.
    pub fn encode(&self) -> Vec<u8> {
        let mut bits = BitWriter::default();
        if self.0.is_empty() {
            return bits.into_bytes();
        }
        let width = width_of(self.0.iter().map(|&(_, step)| step));
        bits.put(self.0.len() as u64, 4);
        bits.put(u64::from(width - 1), 4);
        for &(ago_s, step) in &self.0 {
            bits.put(u64::from(ago_s), 8);
            step.put(&mut bits, width);
        }
        bits.into_bytes()
    }

    /// Reads a trail, of which each has exactly one encoding; the rest stays in `r`.
    pub(super) fn read(r: &mut Reader<'_>) -> Result<Self, StatusError> {
        let &head = r.rest().first().ok_or(StatusError::Length)?;
        let (n, width) = (usize::from(head >> 4), u32::from(head & 15) + 1);
        let bytes = r.take((8 + n * (8 + 2 * width as usize)).div_ceil(8))?;
        let mut bits = BitReader::new(bytes.get(1..).unwrap_or_default());
        let mut corner = || Some((bits.take(8)? as u8, DecimetreStep::take(&mut bits, width)?));
        let corners = (0..n).map(|_| corner()).collect::<Option<Vec<_>>>().ok_or(StatusError::Length)?;
        let is_ordered = corners.is_sorted_by_key(|&(ago_s, _)| ago_s);
        let moves = corners.iter().all(|&(_, step)| step != DecimetreStep::default());
        let read = Self(corners);
        let is_sound = n > 0 && is_ordered && moves && read.encode() == bytes;
        is_sound.then_some(read).ok_or(StatusError::BadField)
    }

    /// The corners of the trail to `position`, the latest first.
    pub fn corners(&self, position: MapPoint) -> Vec<TrailCorner> {
        let mut at = step_to(position);
        let mut corner = |&(ago_s, step): &(u8, DecimetreStep)| {
            at = at.plus(step);
            TrailCorner { ago_s, place: MapPoint { x_m: f64::from(at.x_dm) / 10.0, y_m: f64::from(at.y_dm) / 10.0 } }
        };
        self.0.iter().map(&mut corner).collect()
    }
}

fn step_to(point: MapPoint) -> DecimetreStep {
    DecimetreStep { x_dm: decimetres(point.x_m), y_dm: decimetres(point.y_m) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const HERE: MapPoint = MapPoint::new(1.0, -2.0);

    fn decode(bytes: &[u8]) -> Result<Trail, StatusError> {
        let mut r = Reader::new(bytes);
        Trail::read(&mut r).and_then(|trail| r.rest().is_empty().then_some(trail).ok_or(StatusError::Length))
    }

    fn corner(ago_s: u8, x_m: f64, y_m: f64) -> TrailCorner {
        TrailCorner { ago_s, place: MapPoint::new(x_m, y_m) }
    }

    #[test]
    fn golden_bytes_of_a_trail() {
        // 0010 0101, then 9, 14, -14 and 12, -30, 0.
        let corners = [corner(9, 2.4, -3.4), corner(12, -0.6, -3.4)];
        let trail = Trail::new(HERE, &corners, 99).unwrap();
        let bytes = [0x25, 0x09, 0x3B, 0x20, 0xC8, 0x80];
        assert_eq!(trail.encode()[..], bytes[..], "{:02X?}", trail.encode());
        assert_eq!(decode(&bytes).unwrap().corners(HERE), corners);
        assert_eq!(Trail::new(HERE, &corners, 5).unwrap().corners(HERE), corners[..1], "room for one");
        assert_eq!(Trail::new(HERE, &corners, 2), None);
        assert_eq!(Trail::new(HERE, &[corner(3, 1.0, -2.0)], 99), None, "the vehicle has not moved");
    }

    #[test]
    fn unusual_encodings_of_a_trail_are_refused() {
        for bytes in [&[][..], &[0x05], &[0x25, 0x09], &[0x25, 0x0C, 0x3B, 0x20, 0x98, 0x80], &[0x12, 0x09, 0x00]] {
            assert!(decode(bytes).is_err(), "{bytes:02X?}");
        }
    }

    proptest! {
        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Ok(trail) = decode(&bytes) {
                prop_assert_eq!(trail.encode(), bytes);
                prop_assert!(trail.corners(HERE).len() <= Trail::MAX_CORNERS);
            }
        }

        #[test]
        fn the_latest_corners_that_fit_are_sent(
            steps in proptest::collection::vec((0u8..30, -3000i32..3000, -300i32..300), 0..12), room in 0usize..60,
        ) {
            let (mut at, mut ago_s, mut corners) = (HERE, 0u8, Vec::new());
            for (later, x, y) in steps.into_iter().filter(|&(_, x, y)| (x, y) != (0, 0)) {
                ago_s = ago_s.saturating_add(later);
                at = MapPoint::new(at.x_m + f64::from(x) / 10.0, at.y_m + f64::from(y) / 10.0);
                corners.push(TrailCorner { ago_s, place: at });
            }
            let Some(trail) = Trail::new(HERE, &corners, room) else {
                prop_assert!(corners.is_empty() || room < 8);
                return Ok(());
            };
            let bytes = trail.encode();
            prop_assert!(bytes.len() <= room);
            let read = decode(&bytes).unwrap().corners(HERE);
            for (read, sent) in read.iter().zip(&corners) {
                prop_assert_eq!(read.ago_s, sent.ago_s);
                prop_assert!((read.place.x_m - sent.place.x_m).hypot(read.place.y_m - sent.place.y_m) < 0.01);
            }
        }
    }
}
