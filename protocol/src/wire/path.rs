//! The path that the vehicle plans after its waypoint, and the placement of its map in the world.

use crate::bytes::{BitReader, BitWriter, DecimetreStep, Reader, Truncated, decimetres, put24, take_width, width_of};
use crate::coordinates::{MapPoint, WorldPoint};

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

/// The shift from the map frame to the world frame.
///
/// ```text
/// byte  bits  field    unit, range
///  0    8     version  1..255, then 1 again; counts the moves
///  1-3  24    east     decimetres, signed, +-838 km
///  4-6  24    north    decimetres, signed
/// ```
///
/// In both frames x points east and y north. The map frame is the vehicle's dead reckoning, in which no cell ever
/// moves. The world frame is the tangent plane at the mission's origin. Source: vehicle, at the end of a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Counts the moves, 1 to 255 and then from 1 again.
    pub version: u8,
    /// The map frame's origin in the world frame.
    pub origin: WorldPoint,
}

impl Placement {
    /// Length on the wire in bytes.
    pub const BYTES: usize = 7;

    /// Converts a point of the map frame into the world frame.
    pub fn to_world(&self, at: MapPoint) -> WorldPoint {
        WorldPoint { east_m: at.x_m + self.origin.east_m, north_m: at.y_m + self.origin.north_m }
    }

    /// Converts a point of the world frame into the map frame.
    pub fn to_map(&self, at: WorldPoint) -> MapPoint {
        MapPoint { x_m: at.east_m - self.origin.east_m, y_m: at.north_m - self.origin.north_m }
    }

    /// As [`Self::to_world`]. A map without a placement has not moved: the origins of both frames coincide.
    pub fn map_to_world(placement: Option<Self>, at: MapPoint) -> WorldPoint {
        placement.map_or(WorldPoint { east_m: at.x_m, north_m: at.y_m }, |p| p.to_world(at))
    }

    /// As [`Self::to_map`]. A map without a placement has not moved: the origins of both frames coincide.
    pub fn world_to_map(placement: Option<Self>, at: WorldPoint) -> MapPoint {
        placement.map_or(MapPoint { x_m: at.east_m, y_m: at.north_m }, |p| p.to_map(at))
    }

    /// The placement after the next move, rounded to whole decimetres, so that both ends use the same numbers.
    pub fn moved_to(before: Option<Self>, origin: WorldPoint) -> Self {
        let version = before.map_or(0, |p| p.version).wrapping_add(1).max(1);
        let whole = |metres: f64| (metres * 10.0).round() / 10.0;
        Self { version, origin: WorldPoint { east_m: whole(origin.east_m), north_m: whole(origin.north_m) } }
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.version.max(1));
        put24(out, decimetres(self.origin.east_m) as u32);
        put24(out, decimetres(self.origin.north_m) as u32);
    }

    /// `None` stands for version 0, which no vehicle writes.
    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let version = r.u8()?;
        let origin = WorldPoint { east_m: f64::from(r.i24()?) / 10.0, north_m: f64::from(r.i24()?) / 10.0 };
        let read = Self { version, origin };
        Ok((version != 0).then_some(read))
    }
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

    #[test]
    fn golden_bytes_of_a_placement() {
        let placement = Placement { version: 3, origin: WorldPoint::new(12.5, -0.1) };
        let mut bytes = Vec::new();
        placement.encode(&mut bytes);
        assert_eq!(bytes, [3, 0, 0, 125, 0xFF, 0xFF, 0xFF]);
        assert_eq!(Placement::decode(&mut Reader::new(&bytes)), Ok(Some(placement)));
        assert_eq!(placement.to_map(placement.to_world(MapPoint::new(4.0, 5.0))), MapPoint::new(4.0, 5.0));
    }

    #[test]
    fn versions_count_the_moves_and_skip_zero() {
        let first = Placement::moved_to(None, WorldPoint::new(1.0, 2.0));
        assert_eq!(first.version, 1);
        assert_eq!(Placement::moved_to(Some(Placement { version: 255, ..first }), WorldPoint::default()).version, 1);
    }
}
