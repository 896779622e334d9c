//! What bits that nobody else needs are spent on.

use super::Class;

/// Something that is worth bits only when they are left over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BackgroundStream {
    /// The cells between those of the coarse map, while there is too much to say: in its place among the streams instead
    /// of before all of them. Those of the labels that weigh most go first.
    Finer,
    /// Depths of the sea floor, if they have no share.
    Depth,
    /// Images of labels of which the surface has none, though nobody has asked.
    Exemplars,
    /// How sure the model is of the labels, if that has no share.
    Confidence,
    /// How badly the model explains what it sees, if that has no share.
    Curiosity,
}

impl BackgroundStream {
    /// Every background stream, in the order of their numbers on the wire, from 1.
    pub const ALL: [Self; 5] = [Self::Finer, Self::Depth, Self::Exemplars, Self::Confidence, Self::Curiosity];

    /// Name in files and in the API.
    pub fn name(self) -> &'static str {
        match self {
            Self::Finer => "finer",
            Self::Depth => "depth",
            Self::Exemplars => "exemplars",
            Self::Confidence => "confidence",
            Self::Curiosity => "curiosity",
        }
    }

    /// What its bits count as.
    pub fn class(self) -> Class {
        match self {
            Self::Finer => Class::Map,
            Self::Depth => Class::Depth,
            Self::Exemplars => Class::Exemplar,
            Self::Confidence => Class::Confidence,
            Self::Curiosity => Class::Curiosity,
        }
    }
}

/// Background streams in the order in which they get what is left over. One that is not named gets nothing, except that finer cells
/// then are cells like all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BackgroundOrder([Option<BackgroundStream>; BackgroundStream::ALL.len()]);

impl Default for BackgroundOrder {
    /// All but curiosity, which is for who asks for it.
    fn default() -> Self {
        Self(BackgroundStream::ALL.map(|stream| (stream != BackgroundStream::Curiosity).then_some(stream)))
    }
}

impl BackgroundOrder {
    /// These streams in this order; `None` if one is named twice.
    pub fn new(streams: &[BackgroundStream]) -> Option<Self> {
        let is_repeated =
            BackgroundStream::ALL.into_iter().any(|stream| streams.iter().filter(|&&e| e == stream).count() > 1);
        let mut places = streams.iter().copied();
        let order = Self(std::array::from_fn(|_| places.next()));
        (!is_repeated && places.next().is_none()).then_some(order)
    }

    /// The streams of these names. The error is one line that says what is allowed.
    pub fn from_names<T: AsRef<str>>(names: &[T]) -> Result<Self, String> {
        let all = || BackgroundStream::ALL.map(BackgroundStream::name).join(", ");
        let stream = |name: &str| BackgroundStream::ALL.into_iter().find(|e| e.name() == name);
        let unknown = |name: &str| format!("background {name:?}: it takes different ones of {}", all());
        let streams: Result<Vec<BackgroundStream>, String> =
            names.iter().map(|n| stream(n.as_ref()).ok_or_else(|| unknown(n.as_ref()))).collect();
        Self::new(&streams?).ok_or_else(|| format!("background names one twice: it takes different ones of {}", all()))
    }

    /// The streams in their order.
    pub fn iter(&self) -> impl Iterator<Item = BackgroundStream> + use<> {
        self.0.into_iter().flatten()
    }

    /// Names in their order.
    pub fn names(&self) -> Vec<String> {
        self.iter().map(|e| e.name().to_owned()).collect()
    }

    /// Whether a stream is in it.
    pub fn has(&self, stream: BackgroundStream) -> bool {
        self.iter().any(|e| e == stream)
    }

    /// As on the wire: three bits each below a 0, the first one highest; 0: no further one.
    pub fn code(self) -> u16 {
        self.0.into_iter().fold(0, |code, e| code << 3 | e.map_or(0, |e| e as u16 + 1))
    }

    /// The order of a code; `None` if it names what there is not, or one twice, or leaves a gap.
    pub fn from_code(code: u16) -> Option<Self> {
        if code >> 15 != 0 {
            return None;
        }
        let numbers = [12, 9, 6, 3, 0].map(|shift: u16| usize::from(code >> shift & 7));
        let named: Vec<usize> = numbers.into_iter().take_while(|&n| n > 0).collect();
        if numbers.into_iter().skip(named.len()).any(|n| n > 0) {
            return None;
        }
        let streams: Option<Vec<BackgroundStream>> =
            named.into_iter().map(|n| BackgroundStream::ALL.get(n - 1).copied()).collect();
        Self::new(&streams?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_codes_of_orders() {
        assert_eq!(BackgroundOrder::default().code(), 0x14E0);
        let two = BackgroundOrder::new(&[BackgroundStream::Exemplars, BackgroundStream::Confidence]).unwrap();
        assert_eq!((two.code(), BackgroundOrder::from_code(0x3800)), (0x3800, Some(two)));
        assert_eq!(BackgroundOrder::from_code(0), BackgroundOrder::new(&[]));
        let all = BackgroundOrder::new(&[
            BackgroundStream::Curiosity,
            BackgroundStream::Finer,
            BackgroundStream::Depth,
            BackgroundStream::Exemplars,
            BackgroundStream::Confidence,
        ]);
        assert_eq!((all.unwrap().code(), BackgroundOrder::from_code(0x529C)), (0x529C, all));
        for wrong in [0x3600, 0x6000, 0x0600, 0x1403, 0x94E0] {
            assert_eq!(BackgroundOrder::from_code(wrong), None, "{wrong:04x}");
        }
        let sound = (0..=u16::MAX).filter_map(BackgroundOrder::from_code).collect::<Vec<_>>();
        assert_eq!(sound.len(), 1 + 5 + 20 + 60 + 120 + 120);
        assert!(sound.iter().all(|order| BackgroundOrder::from_code(order.code()) == Some(*order)));
    }

    #[test]
    fn a_name_that_is_wrong_is_refused_with_what_is_allowed() {
        let said = BackgroundOrder::from_names(&["depth", "sonar"]).unwrap_err();
        assert_eq!(
            said,
            "background \"sonar\": it takes different ones of finer, depth, exemplars, confidence, curiosity"
        );
        assert!(BackgroundOrder::from_names(&["depth", "depth"]).unwrap_err().contains("twice"));
        let order = BackgroundOrder::from_names(&["exemplars", "finer"]).unwrap();
        assert_eq!(order.names(), ["exemplars", "finer"]);
    }
}
