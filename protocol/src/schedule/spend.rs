//! What bits that nobody else needs are spent on.

use super::Class;

/// Something that is worth bits only when they are left over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extra {
    /// The cells between those of the coarse map, while there is too much to say: in its place among the extras instead
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

impl Extra {
    /// Every extra, in the order of their numbers on the wire, from 1.
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

/// Extras in the order in which they get what is left over. One that is not named gets nothing, except that finer cells
/// then are cells like all others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SpendOrder([Option<Extra>; Extra::ALL.len()]);

impl Default for SpendOrder {
    /// All but curiosity, which is for who asks for it.
    fn default() -> Self {
        Self(Extra::ALL.map(|extra| (extra != Extra::Curiosity).then_some(extra)))
    }
}

impl SpendOrder {
    /// These extras in this order; `None` if one is named twice.
    pub fn new(extras: &[Extra]) -> Option<Self> {
        let is_repeated = Extra::ALL.into_iter().any(|extra| extras.iter().filter(|&&e| e == extra).count() > 1);
        let mut places = extras.iter().copied();
        let order = Self(std::array::from_fn(|_| places.next()));
        (!is_repeated && places.next().is_none()).then_some(order)
    }

    /// The extras of these names. The error is one line that says what is allowed.
    pub fn from_names<T: AsRef<str>>(names: &[T]) -> Result<Self, String> {
        let all = || Extra::ALL.map(Extra::name).join(", ");
        let extra = |name: &str| Extra::ALL.into_iter().find(|e| e.name() == name);
        let unknown = |name: &str| format!("spend {name:?}: it takes different ones of {}", all());
        let extras: Result<Vec<Extra>, String> =
            names.iter().map(|n| extra(n.as_ref()).ok_or_else(|| unknown(n.as_ref()))).collect();
        Self::new(&extras?).ok_or_else(|| format!("spend names one twice: it takes different ones of {}", all()))
    }

    /// The extras in their order.
    pub fn iter(&self) -> impl Iterator<Item = Extra> + use<> {
        self.0.into_iter().flatten()
    }

    /// Names in their order.
    pub fn names(&self) -> Vec<String> {
        self.iter().map(|e| e.name().to_owned()).collect()
    }

    /// Whether an extra is in it.
    pub fn has(&self, extra: Extra) -> bool {
        self.iter().any(|e| e == extra)
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
        let extras: Option<Vec<Extra>> = named.into_iter().map(|n| Extra::ALL.get(n - 1).copied()).collect();
        Self::new(&extras?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_codes_of_orders() {
        assert_eq!(SpendOrder::default().code(), 0x14E0);
        let two = SpendOrder::new(&[Extra::Exemplars, Extra::Confidence]).unwrap();
        assert_eq!((two.code(), SpendOrder::from_code(0x3800)), (0x3800, Some(two)));
        assert_eq!(SpendOrder::from_code(0), SpendOrder::new(&[]));
        let all = SpendOrder::new(&[Extra::Curiosity, Extra::Finer, Extra::Depth, Extra::Exemplars, Extra::Confidence]);
        assert_eq!((all.unwrap().code(), SpendOrder::from_code(0x529C)), (0x529C, all));
        for wrong in [0x3600, 0x6000, 0x0600, 0x1403, 0x94E0] {
            assert_eq!(SpendOrder::from_code(wrong), None, "{wrong:04x}");
        }
        let sound = (0..=u16::MAX).filter_map(SpendOrder::from_code).collect::<Vec<_>>();
        assert_eq!(sound.len(), 1 + 5 + 20 + 60 + 120 + 120);
        assert!(sound.iter().all(|order| SpendOrder::from_code(order.code()) == Some(*order)));
    }

    #[test]
    fn a_name_that_is_wrong_is_refused_with_what_is_allowed() {
        let said = SpendOrder::from_names(&["depth", "sonar"]).unwrap_err();
        assert_eq!(said, "spend \"sonar\": it takes different ones of finer, depth, exemplars, confidence, curiosity");
        assert!(SpendOrder::from_names(&["depth", "depth"]).unwrap_err().contains("twice"));
        let order = SpendOrder::from_names(&["exemplars", "finer"]).unwrap();
        assert_eq!(order.names(), ["exemplars", "finer"]);
    }
}
