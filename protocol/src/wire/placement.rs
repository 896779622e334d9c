//! The placement of the vehicle's map in the world.

use crate::bytes::{Reader, Truncated};

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
    /// East coordinate of the map frame's origin in the world frame, in metres.
    pub east_m: f64,
    /// North coordinate of the map frame's origin in the world frame, in metres.
    pub north_m: f64,
}

impl Placement {
    /// Length on the wire in bytes.
    pub const BYTES: usize = 7;

    /// A place of the map's frame in the world's.
    pub fn to_world(&self, (x_m, y_m): (f64, f64)) -> (f64, f64) {
        (x_m + self.east_m, y_m + self.north_m)
    }

    /// A place of the world's frame in the map's.
    pub fn to_map(&self, (x_m, y_m): (f64, f64)) -> (f64, f64) {
        (x_m - self.east_m, y_m - self.north_m)
    }

    /// The placement after the next move, rounded to whole decimetres, so that both ends use the same numbers.
    pub fn moved_to(before: Option<Self>, east_m: f64, north_m: f64) -> Self {
        let version = before.map_or(0, |p| p.version).wrapping_add(1).max(1);
        let whole = |metres: f64| (metres * 10.0).round() / 10.0;
        Self { version, east_m: whole(east_m), north_m: whole(north_m) }
    }

    pub(super) fn encode(&self, out: &mut Vec<u8>) {
        out.push(self.version.max(1));
        crate::bytes::put24(out, crate::bytes::decimetres(self.east_m) as u32);
        crate::bytes::put24(out, crate::bytes::decimetres(self.north_m) as u32);
    }

    /// `None` stands for version 0, which no vehicle writes.
    pub(super) fn decode(r: &mut Reader<'_>) -> Result<Option<Self>, Truncated> {
        let version = r.u8()?;
        let read = Self { version, east_m: f64::from(r.i24()?) / 10.0, north_m: f64::from(r.i24()?) / 10.0 };
        Ok((version != 0).then_some(read))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes_of_a_placement() {
        let placement = Placement { version: 3, east_m: 12.5, north_m: -0.1 };
        let mut bytes = Vec::new();
        placement.encode(&mut bytes);
        assert_eq!(bytes, [3, 0, 0, 125, 0xFF, 0xFF, 0xFF]);
        assert_eq!(Placement::decode(&mut Reader::new(&bytes)), Ok(Some(placement)));
        assert_eq!(placement.to_map(placement.to_world((4.0, 5.0))), (4.0, 5.0));
    }

    #[test]
    fn versions_count_the_moves_and_leave_zero_out() {
        let first = Placement::moved_to(None, 1.0, 2.0);
        assert_eq!(first.version, 1);
        assert_eq!(Placement::moved_to(Some(Placement { version: 255, ..first }), 0.0, 0.0).version, 1);
    }
}
