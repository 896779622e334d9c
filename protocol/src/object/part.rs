//! The chunks of an object, and how many symbols to send so that enough of them arrive.

use super::Layout;
use crate::bytes::Reader;

/// The name of an object within the sender's session, 0..=2047; wraps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub(super) u16);

impl ObjectId {
    /// The number of different names.
    pub(super) const COUNT: u64 = 2048;

    pub(super) fn of(serial: u64) -> Self {
        Self((serial % Self::COUNT) as u16)
    }

    /// The number on the wire.
    pub fn number(self) -> u16 {
        self.0
    }

    /// The serial number nearest to `near` that has this name.
    pub(super) fn serial(self, near: u64) -> u64 {
        let half = Self::COUNT / 2;
        let ahead = (u64::from(self.0) + Self::COUNT - near % Self::COUNT) % Self::COUNT;
        if ahead < half { near + ahead } else { (near + ahead).saturating_sub(Self::COUNT) }
    }
}

/// A run of consecutive symbols of an object.
///
/// ```text
///  0                   1                   2                   3
///  0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1 2 3 4 5 6 7 8 9 0 1
/// +---------------------+---------------------+-----------+-------
/// | object              | source symbols - 1  | bytes - 1 | first
/// +---------------+-----+---------------------+-----------+-------
///   symbol        | symbols ...
/// ----------------+---------------
/// object          11 bits, counts up in the sender's session, wraps
/// source symbols  1..=2048, 11 bits
/// bytes           of a symbol, 1..=64, 6 bits
/// first symbol    12 bits; source symbols are counted first, then repair symbols
/// symbols         at least one, each whole; the last one exists
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part<'a> {
    /// The name of the object.
    pub id: ObjectId,
    /// The division of the object.
    pub layout: Layout,
    /// The number of the first symbol.
    pub first: u16,
    /// Whole symbols, one after the other.
    pub data: &'a [u8],
}

/// Why received bytes are not a part of an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PartError {
    /// They are shorter than a header.
    #[error("the part is too short")]
    Truncated,
    /// No object has this layout.
    #[error("no object has such symbols")]
    Layout,
    /// There is no symbol, a part of a symbol, or a symbol that does not exist.
    #[error("the part holds no run of symbols")]
    Run,
}

impl<'a> Part<'a> {
    /// The length of the header in bytes.
    pub const HEADER: usize = 5;

    /// The bytes of a header, with capacity for `room` bytes in all.
    pub(super) fn header(id: ObjectId, layout: Layout, first: usize, room: usize) -> Vec<u8> {
        let bits = u64::from(id.0) << 29
            | (layout.sources() as u64 - 1) << 18
            | (layout.symbol() as u64 - 1) << 12
            | first as u64;
        let mut out = Vec::with_capacity(room);
        out.extend(bits.to_be_bytes().into_iter().skip(8 - Self::HEADER));
        out
    }

    /// Encodes the part as the payload of a chunk.
    pub fn encode(&self) -> Vec<u8> {
        let mut out = Self::header(self.id, self.layout, usize::from(self.first), Self::HEADER + self.data.len());
        out.extend_from_slice(self.data);
        out
    }

    /// Decodes a part; its symbols exist in an object of 1..=[`MAX_OBJECT`](super::MAX_OBJECT) bytes.
    pub fn decode(bytes: &'a [u8]) -> Result<Self, PartError> {
        let mut r = Reader::new(bytes);
        let header = r.take(Self::HEADER).map_err(|_| PartError::Truncated)?;
        let bits = header.iter().fold(0u64, |bits, &b| bits << 8 | u64::from(b));
        let field = |shift: u32, width: u32| (bits >> shift) as usize & ((1 << width) - 1);
        let layout = Layout::new(field(18, 11) + 1, field(12, 6) + 1).ok_or(PartError::Layout)?;
        let part = Self { id: ObjectId(field(29, 11) as u16), layout, first: field(0, 12) as u16, data: r.rest() };
        let whole = part.data.len().is_multiple_of(layout.symbol()) && !part.data.is_empty();
        let exist = usize::from(part.first) + part.data.len() / layout.symbol() <= layout.symbols();
        if whole && exist { Ok(part) } else { Err(PartError::Run) }
    }

    /// The symbols with their numbers.
    pub(super) fn symbols(&self) -> impl Iterator<Item = (usize, &'a [u8])> + use<'a> {
        (usize::from(self.first)..).zip(self.data.chunks_exact(self.layout.symbol()))
    }
}

/// Standard deviations that are covered ahead, for one group of blocks that share their losses.
const MARGIN: f64 = 0.5;

/// The rule by which symbols are sent ahead of their losses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Supply {
    /// The share of symbols that arrive.
    arrive: f64,
    /// Symbols of a block that are lost together.
    run: f64,
    /// Margin of the plan in standard deviations.
    margin: f64,
}

impl Supply {
    /// For a link that loses `loss` of its frames (0..=0.95), each with `run` symbols dealt to `blocks` blocks.
    pub(super) fn new(loss: f64, run: usize, blocks: usize) -> Self {
        // Blocks that no frame covers together fail independently: the more of them, the larger the margin.
        let groups = blocks.div_ceil(run.max(1)).max(1);
        let margin = MARGIN * f64::from(usize::BITS - groups.leading_zeros());
        Self { arrive: 1.0 - loss, run: (run as f64 / blocks as f64).max(1.0), margin }
    }

    /// The number of symbols of a block to have in flight when `missing` must arrive.
    ///
    /// The mean number of arrivals less the margin equals the missing symbols. Beyond `missing`, only whole runs are
    /// added, because less than a frame changes little. On a link without losses the result is `missing`.
    pub(super) fn in_flight(&self, missing: usize) -> usize {
        let lost = 1.0 - self.arrive;
        if lost <= 0.0 || missing == 0 {
            return missing;
        }
        let missing = missing as f64;
        let deviation = self.margin * (self.run * self.arrive * lost).sqrt();
        let root = (deviation + (deviation * deviation + 4.0 * self.arrive * missing).sqrt()) / (2.0 * self.arrive);
        let extra = (root * root - missing).max(0.0);
        (missing + (extra / self.run).floor() * self.run).ceil() as usize
    }
}

#[cfg(test)]
#[allow(clippy::indexing_slicing, clippy::unwrap_used)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn golden_bytes_of_two_symbols() {
        let layout = Layout::new(235, 3).unwrap();
        let part = Part { id: ObjectId(5), layout, first: 300, data: &[1, 2, 3, 4, 5, 6] };
        let bytes = [0x00, 0xA3, 0xA8, 0x21, 0x2C, 1, 2, 3, 4, 5, 6];
        assert_eq!(part.encode(), bytes);
        assert_eq!(Part::decode(&bytes), Ok(part));
        assert_eq!(Part::decode(&bytes[..4]), Err(PartError::Truncated));
        assert_eq!(Part::decode(&bytes[..5]), Err(PartError::Run));
        assert_eq!(Part::decode(&bytes[..10]), Err(PartError::Run));
        assert_eq!(Part::decode(&[0, 0xA0, 0, 0x40, 0, 1, 2]), Err(PartError::Layout));
    }

    #[test]
    fn names_are_read_near_the_newest() {
        assert_eq!(ObjectId(3).serial(2047), 2051);
        assert_eq!(ObjectId(2047).serial(2049), 2047);
        assert_eq!(ObjectId::of(5000).serial(4500), 5000);
        assert_eq!(ObjectId::of(5000).serial(5500), 5000);
    }

    proptest! {
        #[test]
        fn any_bytes_decode_or_are_refused(bytes in proptest::collection::vec(any::<u8>(), 0..100)) {
            if let Ok(part) = Part::decode(&bytes) {
                prop_assert_eq!(&part.encode(), &bytes);
                prop_assert!(part.layout.bytes() <= 17_000);
            }
        }
    }

    #[test]
    fn a_lossless_link_sends_exactly_the_missing_symbols() {
        let supply = Supply::new(0.0, 11, 2);
        assert!((0..200).all(|n| supply.in_flight(n) == n));
    }

    #[test]
    fn more_is_sent_ahead_where_more_is_lost() {
        let ahead = |loss: f64| Supply::new(loss, 4, 1).in_flight(64);
        assert_eq!([0.0, 0.1, 0.3, 0.5, 0.9].map(ahead), [64, 72, 96, 136, 720]);
    }

    #[test]
    fn a_single_frame_is_not_doubled_by_small_losses() {
        let supply = Supply::new(0.3, 12, 1);
        assert_eq!([1, 6, 12].map(|n| supply.in_flight(n)), [1, 6, 12]);
    }
}
