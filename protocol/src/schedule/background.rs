//! Background streams: content that is sent with spare capacity only.

use super::Class;
use crate::bytes::{BitReader, BitWriter};
use crate::map::{LayerId, LayerSet};

/// Content that is sent with spare capacity only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BackgroundStream {
    /// The cells between those of the coarse map, while the backlog is long: in its place among the background streams
    /// instead of before all of them. Those of the labels with the highest weights go first.
    Finer,
    /// Images of labels of which the surface has none, though nobody has requested them.
    Exemplars,
    /// Images of the sea floor, tile by tile.
    Floor,
    /// A layer of the map, if it has no share.
    Layer(LayerId),
}

impl BackgroundStream {
    const FINER: &str = "finer";
    const EXEMPLARS: &str = "exemplars";
    const FLOOR: &str = "floor";

    /// The streams of a map with these layers, in the order in which people are shown them.
    pub fn all(layers: &LayerSet) -> impl Iterator<Item = Self> {
        [Self::Finer, Self::Exemplars, Self::Floor].into_iter().chain(layers.iter().map(|(id, _)| Self::Layer(id)))
    }

    /// The name of the stream in files and in the API.
    pub fn name_in(self, layers: &LayerSet) -> String {
        match self {
            Self::Finer => Self::FINER.to_owned(),
            Self::Exemplars => Self::EXEMPLARS.to_owned(),
            Self::Floor => Self::FLOOR.to_owned(),
            Self::Layer(id) => layers.name(id),
        }
    }

    fn from_name(name: &str, layers: &LayerSet) -> Option<Self> {
        match name {
            Self::FINER => Some(Self::Finer),
            Self::EXEMPLARS => Some(Self::Exemplars),
            Self::FLOOR => Some(Self::Floor),
            _ => layers.id(name).map(Self::Layer),
        }
    }

    /// The class that its bits count as.
    pub fn class(self) -> Class {
        match self {
            Self::Finer => Class::Map,
            Self::Exemplars | Self::Floor => Class::Exemplar,
            Self::Layer(id) => Class::Layer(id),
        }
    }

    fn number(self) -> u64 {
        match self {
            Self::Layer(id) => id.index() as u64,
            Self::Finer => 16,
            Self::Exemplars => 17,
            Self::Floor => 18,
        }
    }

    fn from_number(number: u64) -> Option<Self> {
        match number {
            16 => Some(Self::Finer),
            17 => Some(Self::Exemplars),
            18 => Some(Self::Floor),
            _ => LayerId::new(number as usize).map(Self::Layer),
        }
    }
}

/// Why names are no order of background streams.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BackgroundError {
    /// No stream has this name.
    #[error("background {name:?}: it takes different ones of {allowed}")]
    Unknown {
        /// The name as it was given.
        name: String,
        /// The names of all streams, as people read them.
        allowed: String,
    },
    /// Two names are the same.
    #[error("background names one twice: it takes different ones of {allowed}")]
    Repeated {
        /// The names of all streams, as people read them.
        allowed: String,
    },
}

/// Background streams in the order in which they get spare capacity. One that is not in it gets none, except that finer cells
/// then are cells like all others.
///
/// ```text
///   5 bits              5 bits for each, the first one first                        0 to 7
/// +-------------------+-----------------------------------------------------------+-------
/// | number of streams | 0 to 15: that layer, 16 finer cells, 17 exemplars, 18 floor | zeros
/// +-------------------+-----------------------------------------------------------+-------
/// ```
///
/// ```
/// use scenecast_protocol::map::LayerSet;
/// use scenecast_protocol::schedule::BackgroundOrder;
///
/// let layers = LayerSet::default();
/// let order = BackgroundOrder::from_names(&["exemplars", "depth"], &layers)?;
/// assert_eq!(order.names(&layers), ["exemplars", "depth"]);
/// assert!(BackgroundOrder::from_names(&["depth", "depth"], &layers).is_err());
/// # Ok::<(), scenecast_protocol::schedule::BackgroundError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BackgroundOrder([Option<BackgroundStream>; BackgroundOrder::MAX_STREAMS]);

impl Default for BackgroundOrder {
    /// Finer cells, depths, exemplars, confidences, the floor.
    fn default() -> Self {
        let [depth, confidence] = [LayerId::DEPTH, LayerId::CONFIDENCE].map(BackgroundStream::Layer);
        let streams =
            [BackgroundStream::Finer, depth, BackgroundStream::Exemplars, confidence, BackgroundStream::Floor];
        let mut streams = streams.into_iter();
        Self(std::array::from_fn(|_| streams.next()))
    }
}

impl BackgroundOrder {
    /// Each layer once, finer cells, exemplars, and the floor.
    const MAX_STREAMS: usize = LayerId::COUNT + 3;

    /// These streams in this order; `None` if one is named twice.
    pub fn new(streams: &[BackgroundStream]) -> Option<Self> {
        let is_repeated = streams.iter().any(|stream| streams.iter().filter(|&other| other == stream).count() > 1);
        let mut places = streams.iter().copied();
        let order = Self(std::array::from_fn(|_| places.next()));
        (!is_repeated && places.next().is_none()).then_some(order)
    }

    /// The streams of these names, none of them twice.
    pub fn from_names<T: AsRef<str>>(names: &[T], layers: &LayerSet) -> Result<Self, BackgroundError> {
        let allowed = || BackgroundStream::all(layers).map(|s| s.name_in(layers)).collect::<Vec<_>>().join(", ");
        let unknown = |name: &str| BackgroundError::Unknown { name: name.to_owned(), allowed: allowed() };
        let stream = |name: &str| BackgroundStream::from_name(name, layers).ok_or_else(|| unknown(name));
        let streams = names.iter().map(|name| stream(name.as_ref())).collect::<Result<Vec<_>, _>>()?;
        Self::new(&streams).ok_or_else(|| BackgroundError::Repeated { allowed: allowed() })
    }

    /// The streams in their order.
    pub fn iter(&self) -> impl Iterator<Item = BackgroundStream> + use<> {
        self.0.into_iter().flatten()
    }

    /// The names of the streams in their order.
    pub fn names(&self, layers: &LayerSet) -> Vec<String> {
        self.iter().map(|stream| stream.name_in(layers)).collect()
    }

    /// Whether a stream is in it.
    pub fn has(&self, stream: BackgroundStream) -> bool {
        self.iter().any(|s| s == stream)
    }

    /// The bytes on the wire.
    pub fn to_bytes(self) -> Vec<u8> {
        let mut bits = BitWriter::default();
        bits.put(self.iter().count() as u64, 5);
        self.iter().for_each(|stream| bits.put(stream.number(), 5));
        bits.into_bytes()
    }

    /// Reads [`Self::to_bytes`]; `None` if they have an unknown stream, or one twice, or another length or filling.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let mut bits = BitReader::new(bytes);
        let count = bits.take(5)?;
        let streams: Option<Vec<_>> = (0..count).map(|_| BackgroundStream::from_number(bits.take(5)?)).collect();
        Self::new(&streams?).filter(|order| order.to_bytes() == bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::BUILT_IN_LAYERS;
    use proptest::prelude::*;

    const DEPTH: BackgroundStream = BackgroundStream::Layer(LayerId::DEPTH);
    const CONFIDENCE: BackgroundStream = BackgroundStream::Layer(LayerId::CONFIDENCE);
    const CURIOSITY: BackgroundStream = BackgroundStream::Layer(LayerId::CURIOSITY);
    const FINER: BackgroundStream = BackgroundStream::Finer;
    const EXEMPLARS: BackgroundStream = BackgroundStream::Exemplars;

    #[test]
    fn golden_bytes_of_orders() {
        let golden = |streams: &[BackgroundStream], bytes: &[u8]| {
            let order = BackgroundOrder::new(streams).unwrap();
            assert_eq!((order.to_bytes(), BackgroundOrder::from_bytes(bytes)), (bytes.to_vec(), Some(order)));
        };
        golden(&[], &[0]);
        golden(&[FINER, DEPTH, EXEMPLARS, CONFIDENCE], &[0x24, 0x01, 0x10, 0x80]);
        golden(&[BackgroundStream::Layer(LayerId::new(15).unwrap()), CURIOSITY], &[0x13, 0xC4]);
        // Another filling, too few or too many bytes, a stream without a number, the same one twice.
        for wrong in [&[][..], &[1], &[0x13], &[0x13, 0xC5], &[0, 0], &[0x0C, 0xC0], &[0x10, 0x00], &[0x9A, 0]] {
            assert_eq!(BackgroundOrder::from_bytes(wrong), None, "{wrong:02X?}");
        }
        let everything: Vec<_> = (0..19).rev().filter_map(BackgroundStream::from_number).collect();
        let order = BackgroundOrder::new(&everything).unwrap();
        assert_eq!((order.to_bytes().len(), BackgroundOrder::from_bytes(&order.to_bytes())), (13, Some(order)));
    }

    #[test]
    fn an_unknown_name_is_refused_with_the_allowed_ones() {
        let layers = LayerSet::default();
        let message = BackgroundOrder::from_names(&["depth", "sonar"], &layers).unwrap_err();
        let names = BUILT_IN_LAYERS.each_ref().map(|layer| &*layer.descriptor.name).join(", ");
        assert_eq!(
            message.to_string(),
            format!("background \"sonar\": it takes different ones of finer, exemplars, floor, {names}")
        );
        let repeated = BackgroundOrder::from_names(&["depth", "depth"], &layers);
        assert!(matches!(repeated, Err(BackgroundError::Repeated { .. })));
        let order = BackgroundOrder::from_names(&["exemplars", "finer"], &layers).unwrap();
        assert_eq!(order.names(&layers), ["exemplars", "finer"]);
    }

    proptest! {
        #[test]
        fn any_bytes_are_an_order_or_are_refused(mut bytes in proptest::collection::vec(any::<u8>(), 0..14)) {
            if let Some(order) = BackgroundOrder::from_bytes(&bytes) {
                prop_assert_eq!(&order.to_bytes(), &bytes);
            }
            bytes.truncate(2);
            if let Some(order) = BackgroundOrder::from_bytes(&bytes) {
                prop_assert_eq!(order.to_bytes(), bytes);
            }
        }

        #[test]
        fn orders_round_trip(numbers in proptest::sample::subsequence((0u64..19).collect::<Vec<_>>(), 0..=19).prop_shuffle()) {
            let streams: Vec<_> = numbers.into_iter().filter_map(BackgroundStream::from_number).collect();
            let order = BackgroundOrder::new(&streams).unwrap();
            prop_assert_eq!(BackgroundOrder::from_bytes(&order.to_bytes()), Some(order));
        }
    }
}
