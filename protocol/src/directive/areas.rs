//! Weighted areas: places that matter to the operator whatever lies there.

use super::polygon::{Polygon, PolygonFault, put_outline, step_to, take_outline};
use crate::bytes::{BitReader, BitWriter, DecimetreStep};

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
