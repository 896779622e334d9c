//! Shares of the classes in the bytes that an end sends.

use crate::map::{LayerId, LayerSet};

/// The use of transmitted bits, for shares and counters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Class {
    /// Slots of the directive but for the fix.
    Directive,
    /// The vehicle's status: pose and report.
    Status,
    /// Position fixes, which only the surface sends.
    Fix,
    /// Labels of the map's cells.
    Map,
    /// Exemplars: images that show a label.
    Exemplar,
    /// A layer of the map, such as depth.
    Layer(LayerId),
    /// Headers, acknowledgement statements, integrity checks and padding.
    Overhead,
}

impl Class {
    /// The classes that have a share of the traffic. The first goes first where no share decides.
    pub const SHARED: [Self; 5] = [Self::Directive, Self::Status, Self::Fix, Self::Map, Self::Exemplar];

    /// Every class, layers as far as they are in `layers`; the first goes first where no share decides.
    pub fn all(layers: &LayerSet) -> impl Iterator<Item = Self> {
        let layers = layers.iter().map(|(id, _)| Self::Layer(id));
        Self::SHARED.into_iter().chain(layers).chain([Self::Overhead])
    }

    /// Name for people and reports; of any layer it is "layer".
    pub fn name(self) -> &'static str {
        match self {
            Self::Directive => "directive",
            Self::Status => "status",
            Self::Fix => "fix",
            Self::Map => "map",
            Self::Exemplar => "exemplar",
            Self::Layer(_) => "layer",
            Self::Overhead => "overhead",
        }
    }

    /// The same, with the layer's own name.
    pub fn name_in(self, layers: &LayerSet) -> String {
        match self {
            Self::Layer(id) => layers.name(id),
            _ => self.name().to_owned(),
        }
    }
}

/// Least share of each of [`Class::SHARED`] in percent of the bytes that an end sends, while the class has something to
/// send. They add up to 100 at most; the rest goes to the class that comes first.
///
/// ```
/// use scenecast_protocol::schedule::{Class, Shares};
///
/// let shares = Shares([20, 5, 5, 50, 20]);
/// assert!(shares.is_sound());
/// assert_eq!((shares.of(Class::Map), shares.of(Class::Overhead)), (0.5, 0.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shares(pub [u8; 5]);

impl Default for Shares {
    fn default() -> Self {
        Self([10, 5, 5, 50, 20])
    }
}

impl Shares {
    /// Whether they leave room for each other.
    pub fn is_sound(&self) -> bool {
        self.0.iter().map(|&s| u32::from(s)).sum::<u32>() <= 100
    }

    /// The share of a class in 0..=1.
    pub fn of(&self, class: Class) -> f64 {
        let at = Class::SHARED.iter().position(|&c| c == class);
        at.and_then(|i| self.0.get(i)).map_or(0.0, |&percent| f64::from(percent) / 100.0)
    }
}

/// Keeps the shares. An idle class lends its share, and does not get it back later.
#[derive(Debug, Clone, Default)]
pub struct ClassShares {
    shares: Shares,
    /// Percent of the map's share, by layer.
    layers: [u8; LayerId::COUNT],
    /// Bytes that a class was owed and did not get while it waited.
    owed: [f64; Class::SHARED.len() + LayerId::COUNT],
}

impl ClassShares {
    /// Most bytes that are owed or ahead.
    const MEMORY: f64 = 4096.0;

    /// Shares without any debt between the classes.
    pub fn new(shares: Shares) -> Self {
        Self { shares, ..Self::default() }
    }

    /// Gives a layer of the map a part of its share, percent; all layers together have 100 at most. A layer without a part is
    /// sent with spare capacity only.
    pub fn set_layer(&mut self, id: LayerId, percent: u8) {
        if let Some(share) = self.layers.get_mut(id.index()) {
            *share = percent;
        }
    }

    /// The share of a class in 0..=1, layers taken from the map.
    fn of(&self, class: Class) -> f64 {
        let map = self.shares.of(Class::Map);
        let part = |percent: &u8| map * f64::from(*percent) / 100.0;
        match class {
            Class::Layer(id) => self.layers.get(id.index()).map_or(0.0, part),
            Class::Map => map - self.layers.iter().map(part).sum::<f64>(),
            _ => self.shares.of(class),
        }
    }

    /// The shares in force, in percent.
    pub fn shares(&self) -> Shares {
        self.shares
    }

    /// Changes the shares; debts stay.
    pub fn set(&mut self, shares: Shares) {
        self.shares = shares;
    }

    /// The waiting class that comes next: the one that is owed most, or else the first.
    pub fn next(&self, waiting: &[Class]) -> Option<Class> {
        let owed = |c: Class| self.slot(c).and_then(|i| self.owed.get(i)).copied().unwrap_or_default();
        let most = waiting.iter().copied().filter(|&c| owed(c) > 0.0).max_by(|&a, &b| owed(a).total_cmp(&owed(b)));
        most.or_else(|| waiting.iter().copied().min())
    }

    /// Counts bytes sent for a class while `waiting` (that class too) had something to send.
    pub fn spend(&mut self, class: Class, bytes: usize, waiting: &[Class]) {
        if waiting.len() < 2 {
            return;
        }
        let bytes = bytes as f64;
        for &c in waiting {
            let earned = self.of(c) * bytes - if c == class { bytes } else { 0.0 };
            if let Some(owed) = self.slot(c).and_then(|i| self.owed.get_mut(i)) {
                *owed = (*owed + earned).clamp(-Self::MEMORY, Self::MEMORY);
            }
        }
    }

    fn slot(&self, class: Class) -> Option<usize> {
        match class {
            Class::Layer(id) => Some(Class::SHARED.len() + id.index()),
            _ => Class::SHARED.iter().position(|&c| c == class),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #[test]
        fn every_class_gets_at_least_its_share_while_it_waits(
            shares in proptest::array::uniform5(0u8..=20), sizes in proptest::array::uniform5(1usize..200),
        ) {
            let mut keeper = ClassShares::new(Shares(shares));
            let mut sent = [0usize; 5];
            for _ in 0..4000 {
                let class = keeper.next(&Class::SHARED).unwrap();
                let i = Class::SHARED.iter().position(|&c| c == class).unwrap();
                keeper.spend(class, sizes[i], &Class::SHARED);
                sent[i] += sizes[i];
            }
            let total = sent.iter().sum::<usize>() as f64;
            for (i, &bytes) in sent.iter().enumerate() {
                let least = total * f64::from(shares[i]) / 100.0 - 5.0 * 200.0;
                prop_assert!(bytes as f64 >= least, "class {}: {:?} of {:?}", i, sent, shares);
            }
        }
    }

    #[test]
    fn a_layer_without_a_part_of_the_map_gets_spare_capacity_only() {
        let [confidence, depth] = [LayerId::CONFIDENCE, LayerId::DEPTH].map(Class::Layer);
        let waiting = [Class::Map, confidence, depth];
        let mut keeper = ClassShares::new(Shares::default());
        keeper.set_layer(LayerId::DEPTH, 10);
        let mut sent = BTreeMap::<Class, usize>::new();
        for _ in 0..1000 {
            let class = keeper.next(&waiting).unwrap();
            keeper.spend(class, 50, &waiting);
            *sent.entry(class).or_default() += 1;
        }
        assert_eq!(sent.get(&confidence), None);
        assert!((45..=55).contains(&sent[&depth]), "{sent:?}");
        assert_eq!(keeper.next(&[confidence]), Some(confidence));
        assert_eq!(ClassShares::default().next(&[confidence, depth]), Some(depth));
    }

    #[test]
    fn exemplars_get_their_share_and_no_more_while_the_map_waits() {
        let waiting = [Class::Map, Class::Exemplar];
        let mut keeper = ClassShares::new(Shares([10, 5, 5, 50, 20]));
        let mut exemplar = 0;
        for _ in 0..1000 {
            let class = keeper.next(&waiting).unwrap();
            keeper.spend(class, 50, &waiting);
            exemplar += usize::from(class == Class::Exemplar);
        }
        assert!((190..=210).contains(&exemplar), "{exemplar} of 1000");
    }
}
