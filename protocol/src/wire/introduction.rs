//! The content of a hello: the facts about its sender that the other end cannot measure.

use crate::bytes::{Reader, Truncated};
use crate::directive::Series;

/// The edge of a map cell in tenths of a millimetre, up to 1677 m; 0 if the sender has no map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct CellEdge(u32);

impl CellEdge {
    const MAX: u32 = 0xFF_FFFF;

    /// The edge of `metres`, rounded to a tenth of a millimetre. A value out of range becomes the nearest one.
    pub fn from_metres(metres: f64) -> Self {
        Self((metres * 1e4).round().clamp(0.0, f64::from(Self::MAX)) as u32)
    }

    /// The edge in metres; `None` if the sender has no map.
    pub fn metres(self) -> Option<f64> {
        (self.0 > 0).then(|| f64::from(self.0) / 1e4)
    }
}

/// The payload of an introduction, a chunk of every hello between two ends.
///
/// ```text
/// byte  bits  field          unit, range
///  0-2  24    edge of a cell tenths of a millimetre; 0: the sender has no map
///  3-8  48    series         of the sender's orders; only from the surface
///  9..        reserved for later versions; skipped
/// ```
///
/// ```
/// use scenecast_protocol::directive::Series;
/// use scenecast_protocol::wire::{CellEdge, Introduction};
///
/// let surface = Introduction { cell_edge: CellEdge::from_metres(0.25), series: Some(Series::from_random(0xABCD)) };
/// assert_eq!(surface.encode(), [0x00, 0x09, 0xC4, 0, 0, 0, 0, 0xAB, 0xCD]);
/// assert_eq!(Introduction::decode(&surface.encode()), Ok(surface));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Introduction {
    /// The edge of a cell on the sender's map.
    pub cell_edge: CellEdge,
    /// The series of the sender's orders; `None` from a vehicle.
    pub series: Option<Series>,
}

impl Introduction {
    /// Bytes of the longest introduction.
    pub const MAX_BYTES: usize = 9;

    /// The bytes of the payload.
    #[must_use]
    pub fn encode(&self) -> Vec<u8> {
        let mut out = self.cell_edge.0.to_be_bytes().get(1..).unwrap_or_default().to_vec();
        if let Some(series) = self.series {
            out.extend_from_slice(series.get().to_be_bytes().get(2..).unwrap_or_default());
        }
        out
    }

    /// Reads a payload; bytes after the known fields are skipped.
    pub fn decode(bytes: &[u8]) -> Result<Self, Truncated> {
        let mut r = Reader::new(bytes);
        let cell_edge = CellEdge(u32::from(r.u8()?) << 16 | u32::from(r.u16()?));
        let series = match r.rest().is_empty() {
            true => None,
            false => {
                Some(Series::from_random(u64::from(r.u16()?) << 32 | u64::from(r.u16()?) << 16 | u64::from(r.u16()?)))
            }
        };
        Ok(Self { cell_edge, series })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_introduction_reads_back(edge in 0u32..=CellEdge::MAX, bits: u64, has_series: bool, tail: Vec<u8>) {
            let series = has_series.then(|| Series::from_random(bits));
            let sent = Introduction { cell_edge: CellEdge(edge), series };
            let mut bytes = sent.encode();
            prop_assert!(bytes.len() <= Introduction::MAX_BYTES);
            prop_assert_eq!(Introduction::decode(&bytes), Ok(sent));
            if has_series {
                bytes.extend(tail);
                prop_assert_eq!(Introduction::decode(&bytes), Ok(sent), "of a later version");
            }
        }

        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..20)) {
            let _ = Introduction::decode(&bytes);
        }
    }

    #[test]
    fn edges_keep_a_tenth_of_a_millimetre() {
        for metres in [0.0001, 0.08, 0.25, 1.0, 1000.0] {
            assert_eq!(CellEdge::from_metres(metres).metres(), Some(metres));
        }
        assert_eq!(CellEdge::from_metres(0.0).metres(), None);
        assert_eq!(CellEdge::from_metres(f64::NAN).metres(), None);
    }
}
