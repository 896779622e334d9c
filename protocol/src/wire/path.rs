//! The path that the vehicle plans after its waypoint.

use crate::bytes::{BitReader, BitWriter, DecimetreStep, decimetres, take_width, width_of};
use crate::coordinates::MapPoint;

/// The waypoints after the current one, as planned when the pose was written; in the map frame.
///
/// ```text
///  bits      1       3     5          2w             0 to 7
///       +-----------+---+------+------------------+-------
///       | continues | n | w    | dx, dy, for each | zeros
///       +-----------+---+------+------------------+-------
/// ```
/// * continues: the plan has more waypoints than these n, 0 to 7.
/// * w: bits of a difference, 1 to 25, two's complement, decimetres, the fewest that hold all; left out if n is 0.
/// * dx, dy: from the previous waypoint, never both 0.
///
/// An empty path that does not continue takes no byte. Source: vehicle, at the end of a pose with a waypoint. Seven
/// legs of up to 6.3 m take 14 bytes, of up to 819 m 26.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PlannedPath {
    /// The waypoints in their order, at most [`Self::MAX_POINTS`] on the wire.
    pub points: Vec<MapPoint>,
    /// Whether the plan has more waypoints than these.
    pub continues: bool,
}

impl PlannedPath {
    /// The most waypoints that a pose has after the current one.
    pub const MAX_POINTS: usize = 7;

    /// Encodes as many waypoints as fit into `room` bytes.
    pub(super) fn encode(&self, waypoint: MapPoint, room: usize) -> Vec<u8> {
        let mut before = step_to(waypoint);
        let mut steps = Vec::new();
        for next in self.points.iter().map(|&p| step_to(p)) {
            let step = next.since(before);
            if step != DecimetreStep::default() {
                steps.push(step);
            }
            before = next;
        }
        let sent = (0..=steps.len().min(Self::MAX_POINTS)).rev().find_map(|n| {
            let (sent, rest) = steps.split_at_checked(n)?;
            Some(write(sent, self.continues || !rest.is_empty())).filter(|bytes| bytes.len() <= room)
        });
        sent.unwrap_or_default()
    }

    /// Decodes the bytes after a waypoint; `None` if no vehicle writes them.
    pub(super) fn decode(bytes: &[u8], waypoint: MapPoint) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let continues = bits.bit()?;
        let n = bits.take(3)?;
        let width = if n > 0 { take_width(&mut bits)? } else { 1 };
        let mut read = Self { points: Vec::new(), continues };
        let mut at = step_to(waypoint);
        for _ in 0..n {
            at = at.plus(DecimetreStep::take(&mut bits, width)?);
            read.points.push(point_at(at));
        }
        // Each path has exactly one encoding.
        (read.encode(waypoint, usize::MAX) == bytes).then_some(read)
    }
}

fn step_to(point: MapPoint) -> DecimetreStep {
    DecimetreStep { x_dm: decimetres(point.x_m), y_dm: decimetres(point.y_m) }
}

fn point_at(step: DecimetreStep) -> MapPoint {
    MapPoint { x_m: f64::from(step.x_dm) / 10.0, y_m: f64::from(step.y_dm) / 10.0 }
}

fn write(steps: &[DecimetreStep], continues: bool) -> Vec<u8> {
    if steps.is_empty() && !continues {
        return Vec::new();
    }
    let mut bits = BitWriter::default();
    bits.bit(continues);
    bits.put(steps.len() as u64, 3);
    if !steps.is_empty() {
        let width = width_of(steps.iter().copied());
        bits.put(u64::from(width), 5);
        steps.iter().for_each(|&step| step.put(&mut bits, width));
    }
    bits.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FROM: MapPoint = MapPoint::new(1.0, -2.0);

    fn path(points: &[(f64, f64)], continues: bool) -> PlannedPath {
        PlannedPath { points: points.iter().map(|&(x, y)| MapPoint::new(x, y)).collect(), continues }
    }

    #[test]
    fn golden_bytes_of_a_path() {
        let golden = [
            (path(&[], false), vec![]),
            (path(&[], true), vec![0x80]),
            // 0 010 00110, then 14, -14, -30, 0 in 6 bits each.
            (path(&[(2.4, -3.4), (-0.6, -3.4)], false), vec![0x23, 0x1D, 0x94, 0x40, 0x00]),
            (path(&[(2.4, -3.4), (-0.6, -3.4)], true), vec![0xA3, 0x1D, 0x94, 0x40, 0x00]),
        ];
        for (path, bytes) in golden {
            assert_eq!(path.encode(FROM, 99), bytes);
            if !bytes.is_empty() {
                assert_eq!(PlannedPath::decode(&bytes, FROM), Some(path));
            }
        }
    }

    #[test]
    fn unusual_encodings_of_a_path_are_refused() {
        let wider_than_need_be = [0x23, 0x8E, 0xE5, 0x88, 0x00];
        let (nothing, standing_still, padded) = ([0x00], [0x10, 0x80], [0x23, 0x1D, 0x94, 0x40, 0x01]);
        let (zero_wide, cut, too_long) = ([0x10, 0x00], [0x23, 0x1D], [0x80, 0x00]);
        for bytes in [&wider_than_need_be[..], &nothing, &standing_still, &padded, &zero_wide, &cut, &too_long, &[]] {
            assert_eq!(PlannedPath::decode(bytes, FROM), None, "{bytes:02X?}");
        }
        let far = MapPoint::new(838_860.7, 0.0);
        let east = path(&[(838_860.7, 5.0)], false).encode(MapPoint::new(838_860.0, 5.0), 99);
        assert!(PlannedPath::decode(&east, MapPoint::default()).is_some());
        assert_eq!(PlannedPath::decode(&east, far), None, "beyond the reach of the wire");
    }

    proptest! {
        #[test]
        fn a_path_is_cut_to_the_room_and_marked(
            steps in proptest::collection::vec((-30_000i32..30_000, -300i32..300), 0..12),
            continues: bool,
            room in 0usize..60,
        ) {
            let mut at = step_to(FROM);
            let mut whole = path(&[], continues);
            for (x_dm, y_dm) in steps.into_iter().filter(|&s| s != (0, 0)) {
                at = at.plus(DecimetreStep { x_dm, y_dm });
                whole.points.push(point_at(at));
            }
            let bytes = whole.encode(FROM, room);
            prop_assert!(bytes.len() <= room);
            let Some(read) = PlannedPath::decode(&bytes, FROM) else {
                prop_assert!(bytes.is_empty());
                prop_assert!(room == 0 || whole == PlannedPath::default());
                return Ok(());
            };
            let sent = read.points.len();
            prop_assert!(sent <= PlannedPath::MAX_POINTS);
            prop_assert_eq!(&read.points[..], &whole.points[..sent]);
            prop_assert_eq!(read.continues, continues || sent < whole.points.len());
            prop_assert!(room < 46 || sent == whole.points.len().min(PlannedPath::MAX_POINTS));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..50)) {
            if let Some(path) = PlannedPath::decode(&bytes, FROM) {
                prop_assert_eq!(path.encode(FROM, 99), bytes);
            }
        }
    }
}
