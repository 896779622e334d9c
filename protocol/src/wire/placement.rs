//! The placement of the vehicle's map in the world.

use crate::bytes::{Reader, Truncated, decimetres, put24};
use crate::coordinates::{MapPoint, WorldPoint};

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
