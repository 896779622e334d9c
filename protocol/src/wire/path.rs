//! The path that the vehicle plans after its waypoint.

use crate::bytes::{BitReader, BitWriter, decimetres, minus, plus, put_pair, take_pair, take_width, width_of};
use crate::coordinates::DecimetrePoint;

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
    pub places: Vec<(f64, f64)>,
    /// Whether the plan has more waypoints than these.
    pub goes_on: bool,
}

impl PlannedPath {
    /// The most waypoints that a pose has after the current one.
    pub const MAX_POINTS: usize = 7;

    /// Encodes as many waypoints as fit into `room` bytes.
    pub(super) fn encode(&self, waypoint: (f64, f64), room: usize) -> Vec<u8> {
        let mut before = place(waypoint);
        let mut steps = Vec::new();
        for next in self.places.iter().map(|&p| place(p)) {
            let step = minus(next, before);
            if step != DecimetrePoint::default() {
                steps.push(step);
            }
            before = next;
        }
        let told = (0..=steps.len().min(Self::MAX_POINTS)).rev().find_map(|n| {
            let (told, rest) = steps.split_at_checked(n)?;
            Some(write(told, self.goes_on || !rest.is_empty())).filter(|bytes| bytes.len() <= room)
        });
        told.unwrap_or_default()
    }

    /// Decodes the bytes after a waypoint; `None` if no vehicle writes them.
    pub(super) fn decode(bytes: &[u8], waypoint: (f64, f64)) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let goes_on = bits.bit()?;
        let n = bits.take(3)?;
        let width = if n > 0 { take_width(&mut bits)? } else { 1 };
        let mut read = Self { places: Vec::new(), goes_on };
        let mut at = place(waypoint);
        for _ in 0..n {
            at = plus(at, take_pair(&mut bits, width)?);
            read.places.push(at.metres());
        }
        // Each path has exactly one encoding.
        (read.encode(waypoint, usize::MAX) == bytes).then_some(read)
    }
}

fn place((x_m, y_m): (f64, f64)) -> DecimetrePoint {
    DecimetrePoint { x_dm: decimetres(x_m), y_dm: decimetres(y_m) }
}

fn write(steps: &[DecimetrePoint], goes_on: bool) -> Vec<u8> {
    if steps.is_empty() && !goes_on {
        return Vec::new();
    }
    let mut bits = BitWriter::default();
    bits.bit(goes_on);
    bits.put(steps.len() as u64, 3);
    if !steps.is_empty() {
        let width = width_of(steps.iter().copied());
        bits.put(u64::from(width), 5);
        steps.iter().for_each(|&step| put_pair(&mut bits, step, width));
    }
    bits.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const FROM: (f64, f64) = (1.0, -2.0);

    fn path(places: &[(f64, f64)], goes_on: bool) -> PlannedPath {
        PlannedPath { places: places.to_vec(), goes_on }
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
    fn what_no_vehicle_writes_is_refused() {
        let wider_than_need_be = [0x23, 0x8E, 0xE5, 0x88, 0x00];
        let (nothing, standing_still, padded) = ([0x00], [0x10, 0x80], [0x23, 0x1D, 0x94, 0x40, 0x01]);
        let (zero_wide, cut, too_long) = ([0x10, 0x00], [0x23, 0x1D], [0x80, 0x00]);
        for bytes in [&wider_than_need_be[..], &nothing, &standing_still, &padded, &zero_wide, &cut, &too_long, &[]] {
            assert_eq!(PlannedPath::decode(bytes, FROM), None, "{bytes:02X?}");
        }
        let far = (838_860.7, 0.0);
        let east = path(&[(838_860.7, 5.0)], false).encode((838_860.0, 5.0), 99);
        assert!(PlannedPath::decode(&east, (0.0, 0.0)).is_some());
        assert_eq!(PlannedPath::decode(&east, far), None, "beyond the reach of the wire");
    }

    proptest! {
        #[test]
        fn as_much_as_fits_the_room_comes_back_and_the_rest_is_said_to_follow(
            steps in proptest::collection::vec((-30_000i32..30_000, -300i32..300), 0..12),
            goes_on: bool,
            room in 0usize..60,
        ) {
            let mut at = place(FROM);
            let mut whole = path(&[], goes_on);
            for (x_dm, y_dm) in steps.into_iter().filter(|&s| s != (0, 0)) {
                at = plus(at, DecimetrePoint { x_dm, y_dm });
                whole.places.push(at.metres());
            }
            let bytes = whole.encode(FROM, room);
            prop_assert!(bytes.len() <= room);
            let Some(read) = PlannedPath::decode(&bytes, FROM) else {
                prop_assert!(bytes.is_empty());
                prop_assert!(room == 0 || whole == PlannedPath::default());
                return Ok(());
            };
            let told = read.places.len();
            prop_assert!(told <= PlannedPath::MAX_POINTS);
            prop_assert_eq!(&read.places[..], &whole.places[..told]);
            prop_assert_eq!(read.goes_on, goes_on || told < whole.places.len());
            prop_assert!(room < 46 || told == whole.places.len().min(PlannedPath::MAX_POINTS));
        }

        #[test]
        fn any_bytes_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..50)) {
            if let Some(path) = PlannedPath::decode(&bytes, FROM) {
                prop_assert_eq!(path.encode(FROM, 99), bytes);
            }
        }
    }
}
