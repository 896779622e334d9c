//! Background streams: content that is sent with spare capacity only.

use super::Class;
use crate::map::{LayerId, LayerSet};

/// Content that is only worth bits that nothing else needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BackgroundStream {
    /// The cells between those of the coarse map, while the backlog is long: in its place among the background streams
    /// instead of before all of them. Those of the labels with the highest weights go first.
    Finer,
    /// Images of labels of which the surface has none, though nobody has requested them.
    Exemplars,
    /// A layer of the map, if it has no share.
    Layer(LayerId),
}

impl BackgroundStream {
    const FINER: &str = "finer";
    const EXEMPLARS: &str = "exemplars";

    /// The streams of a map with these layers, in the order in which people are shown them.
    pub fn all(layers: &LayerSet) -> impl Iterator<Item = Self> {
        [Self::Finer, Self::Exemplars].into_iter().chain(layers.iter().map(|(id, _)| Self::Layer(id)))
    }

    /// Name in files and in the API.
    pub fn name_in(self, layers: &LayerSet) -> String {
        match self {
            Self::Finer => Self::FINER.to_owned(),
            Self::Exemplars => Self::EXEMPLARS.to_owned(),
            Self::Layer(id) => layers.name(id),
        }
    }

    fn from_name(name: &str, layers: &LayerSet) -> Option<Self> {
        match name {
            Self::FINER => Some(Self::Finer),
            Self::EXEMPLARS => Some(Self::Exemplars),
            _ => layers.id(name).map(Self::Layer),
        }
    }

    /// The class that its bits count as.
    pub fn class(self) -> Class {
        match self {
            Self::Finer => Class::Map,
            Self::Exemplars => Class::Exemplar,
            Self::Layer(id) => Class::Layer(id),
        }
    }

    fn number(self) -> u128 {
        match self {
            Self::Layer(id) => id.index() as u128,
            Self::Finer => 16,
            Self::Exemplars => 17,
        }
    }

    fn from_number(number: u128) -> Option<Self> {
        match number {
            16 => Some(Self::Finer),
            17 => Some(Self::Exemplars),
            _ => LayerId::new(number as usize).map(Self::Layer),
        }
    }
}

/// Background streams in the order in which they get spare capacity. One that is not in it gets none, except that finer cells
/// then are cells like all others.
///
/// ```text
/// short form, two bytes: a bit 0, then five times three bits, the first stream highest:
///     1 finer cells, 2 layer 0, 3 exemplars, 4 layer 1, 5 layer 2, 0 no further one
/// long form, if there is any other stream, as many bytes as it takes:
///     a bit 1, five bits: number of streams, five bits for each: 0 to 15 that layer, 16 finer cells, 17 exemplars, zeros
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BackgroundOrder([Option<BackgroundStream>; BackgroundOrder::MAX_STREAMS]);

impl Default for BackgroundOrder {
    /// Finer cells, depths, exemplars, confidences.
    fn default() -> Self {
        let mut streams = Self::SHORT.into_iter().take(4);
        Self(std::array::from_fn(|_| streams.next()))
    }
}

impl BackgroundOrder {
    /// Most streams, and most bytes of the long form.
    const MAX_STREAMS: usize = LayerId::COUNT + 2;
    const MAX_BYTES: usize = (6 + 5 * Self::MAX_STREAMS).div_ceil(8);
    /// The streams that the short form can name, from 1 on.
    const SHORT: [BackgroundStream; 5] = [
        BackgroundStream::Finer,
        BackgroundStream::Layer(LayerId::DEPTH),
        BackgroundStream::Exemplars,
        BackgroundStream::Layer(LayerId::CONFIDENCE),
        BackgroundStream::Layer(LayerId::CURIOSITY),
    ];

    /// These streams in this order; `None` if one is named twice.
    pub fn new(streams: &[BackgroundStream]) -> Option<Self> {
        let is_repeated = streams.iter().any(|stream| streams.iter().filter(|&other| other == stream).count() > 1);
        let mut places = streams.iter().copied();
        let order = Self(std::array::from_fn(|_| places.next()));
        (!is_repeated && places.next().is_none()).then_some(order)
    }

    /// The streams of these names. The error is one line that lists the names that are allowed.
    pub fn from_names<T: AsRef<str>>(names: &[T], layers: &LayerSet) -> Result<Self, String> {
        let all = || BackgroundStream::all(layers).map(|s| s.name_in(layers)).collect::<Vec<_>>().join(", ");
        let unknown = |name: &str| format!("background {name:?}: it takes different ones of {}", all());
        let stream = |name: &str| BackgroundStream::from_name(name, layers).ok_or_else(|| unknown(name));
        let streams: Result<Vec<BackgroundStream>, String> = names.iter().map(|name| stream(name.as_ref())).collect();
        Self::new(&streams?).ok_or_else(|| format!("background names one twice: it takes different ones of {}", all()))
    }

    /// The streams in their order.
    pub fn iter(&self) -> impl Iterator<Item = BackgroundStream> + use<> {
        self.0.into_iter().flatten()
    }

    /// Names in their order.
    pub fn names(&self, layers: &LayerSet) -> Vec<String> {
        self.iter().map(|stream| stream.name_in(layers)).collect()
    }

    /// Whether a stream is in it.
    pub fn has(&self, stream: BackgroundStream) -> bool {
        self.iter().any(|s| s == stream)
    }

    /// The bytes of either form as one number, which a journal keeps.
    pub fn code(self) -> u128 {
        let short = self.iter().map(|stream| Self::SHORT.iter().position(|&s| s == stream).map(|i| i as u128 + 1));
        if let Some(numbers) = short.collect::<Option<Vec<u128>>>() {
            return (0..5).fold(0, |code, place| code << 3 | numbers.get(place).copied().unwrap_or(0));
        }
        let count = self.iter().count();
        let code = self.iter().fold(32 | count as u128, |code, stream| code << 5 | stream.number());
        let bits = 6 + 5 * count;
        code << (bits.next_multiple_of(8) - bits)
    }

    /// The order of a code; `None` if it has an unknown stream, or one twice, or is not as [`Self::code`] writes it.
    pub fn from_code(code: u128) -> Option<Self> {
        let numbers = |first: u32, bits: u32, count: u32| {
            (0..count).map(move |place| code >> (first - bits * place).min(127) & ((1 << bits) - 1))
        };
        let streams: Option<Vec<BackgroundStream>> = if code >> 15 == 0 {
            let named = numbers(12, 3, 5).take_while(|&n| n > 0);
            named.map(|n| Self::SHORT.get(n as usize - 1).copied()).collect()
        } else {
            let length = (u128::BITS - code.leading_zeros()).next_multiple_of(8);
            let count = (code >> (length - 6) & 31) as u32;
            let fits = 6 + 5 * count <= length;
            let named = fits.then(|| numbers(length - 11, 5, count)).into_iter().flatten();
            named.map(BackgroundStream::from_number).collect()
        };
        Self::new(&streams?).filter(|order| order.code() == code)
    }

    /// The bytes of either form.
    pub fn to_bytes(self) -> Vec<u8> {
        let bytes = self.code().to_be_bytes();
        let zeros = bytes.iter().take_while(|&&b| b == 0).count().min(bytes.len() - 2);
        bytes.into_iter().skip(zeros).collect()
    }

    /// Reads [`Self::to_bytes`].
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes.len() > Self::MAX_BYTES {
            return None;
        }
        let order = Self::from_code(bytes.iter().fold(0, |code, &b| code << 8 | u128::from(b)));
        order.filter(|order| order.to_bytes() == bytes)
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
    fn golden_codes_of_orders() {
        assert_eq!(BackgroundOrder::default().code(), 0x14E0);
        let two = BackgroundOrder::new(&[EXEMPLARS, CONFIDENCE]).unwrap();
        assert_eq!((two.code(), BackgroundOrder::from_code(0x3800)), (0x3800, Some(two)));
        assert_eq!(BackgroundOrder::from_code(0), BackgroundOrder::new(&[]));
        let all = BackgroundOrder::new(&[CURIOSITY, FINER, DEPTH, EXEMPLARS, CONFIDENCE]);
        assert_eq!((all.unwrap().code(), BackgroundOrder::from_code(0x529C)), (0x529C, all));
        for wrong in [0x3600, 0x6000, 0x0600, 0x1403, 0x94E0] {
            assert_eq!(BackgroundOrder::from_code(wrong), None, "{wrong:04x}");
        }
        let sound = (0..0x8000).filter_map(BackgroundOrder::from_code).collect::<Vec<_>>();
        assert_eq!(sound.len(), 1 + 5 + 20 + 60 + 120 + 120);
        assert!(sound.iter().all(|order| BackgroundOrder::from_code(order.code()) == Some(*order)));
    }

    #[test]
    fn golden_bytes_of_orders_with_other_layers() {
        let last = BackgroundStream::Layer(LayerId::new(15).unwrap());
        let golden = |streams: &[BackgroundStream], bytes: &[u8]| {
            let order = BackgroundOrder::new(streams).unwrap();
            assert_eq!((order.to_bytes(), BackgroundOrder::from_bytes(bytes)), (bytes.to_vec(), Some(order)));
        };
        golden(&[FINER, DEPTH], &[0x14, 0]);
        golden(&[], &[0, 0]);
        golden(&[last], &[0x85, 0xE0]);
        golden(&[FINER, DEPTH, last], &[0x8E, 0, 0x78]);
        // Another filling, too many streams, layer 18, the same stream twice, or an order that has a short form.
        for wrong in [&[0x85, 0xE1][..], &[0x8D, 0xE0], &[0x86, 0x40], &[0x89, 0xEF], &[0x86, 0], &[0, 0x14, 0], &[0]] {
            assert_eq!(BackgroundOrder::from_bytes(wrong), None, "{wrong:02X?}");
        }
        let everything: Vec<_> = (0..18).rev().filter_map(BackgroundStream::from_number).collect();
        let order = BackgroundOrder::new(&everything).unwrap();
        assert_eq!(order.to_bytes().len(), BackgroundOrder::MAX_BYTES);
        assert_eq!(BackgroundOrder::from_bytes(&order.to_bytes()), Some(order));
    }

    #[test]
    fn a_name_that_is_wrong_is_refused_with_what_is_allowed() {
        let layers = LayerSet::default();
        let said = BackgroundOrder::from_names(&["depth", "sonar"], &layers).unwrap_err();
        let names = BUILT_IN_LAYERS.each_ref().map(|layer| &*layer.descriptor.name).join(", ");
        assert_eq!(said, format!("background \"sonar\": it takes different ones of finer, exemplars, {names}"));
        assert!(BackgroundOrder::from_names(&["depth", "depth"], &layers).unwrap_err().contains("twice"));
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
        fn orders_round_trip(numbers in proptest::sample::subsequence((0u128..18).collect::<Vec<_>>(), 0..=18).prop_shuffle()) {
            let streams: Vec<_> = numbers.into_iter().filter_map(BackgroundStream::from_number).collect();
            let order = BackgroundOrder::new(&streams).unwrap();
            prop_assert_eq!(BackgroundOrder::from_code(order.code()), Some(order));
            prop_assert_eq!(BackgroundOrder::from_bytes(&order.to_bytes()), Some(order));
        }
    }
}
