//! Where the vehicle's map lies in the world.

use crate::bytes::{Reader, Truncated};

/// The map's frame seen from the world's: by how much the map must be moved to lie where it belongs.
///
/// ```text
/// byte  bits  field    unit, range
///  0    8     version  1..255, then 1 again; counts the moves
///  1-3  24    east     decimetres, signed, +-838 km
///  4-6  24    north    decimetres, signed
/// ```
///
/// Both frames have x east and y north. The map's is the vehicle's own reckoning, in which cells are never binned anew;
/// the world's is the plane that touches the Earth at the mission's origin. Source: vehicle, at the end of a report.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Counts the moves.
    pub version: u8,
    /// Add to x of the map's frame, metres.
    pub east_m: f64,
    /// Add to y of the map's frame, metres.
    pub north_m: f64,
}

impl Placement {
    /// Bytes on the wire.
    pub const BYTES: usize = 7;

    /// A place of the map's frame in the world's.
    pub fn to_world(&self, (x_m, y_m): (f64, f64)) -> (f64, f64) {
        (x_m + self.east_m, y_m + self.north_m)
    }

    /// A place of the world's frame in the map's.
    pub fn to_map(&self, (x_m, y_m): (f64, f64)) -> (f64, f64) {
        (x_m - self.east_m, y_m - self.north_m)
    }

    /// What the next move makes of it, in whole decimetres: both ends place the map at the same spot.
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

    /// `None` is a version that no vehicle writes.
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
