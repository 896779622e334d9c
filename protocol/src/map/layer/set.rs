//! The layers of one map, by index and by name, and those that every vehicle and surface know.

use super::{Decimal, LayerDescriptor, Palette, Quantity, Spread, Steps, UpperEnd};
use crate::map::MAX_LABEL;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Index of a layer among those of a vehicle's map, 0 to 15.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LayerId(u8);

impl LayerId {
    /// Most layers of a map.
    pub const COUNT: usize = 16;

    /// The layer of an index; `None` above 15.
    pub const fn new(index: usize) -> Option<Self> {
        if index < Self::COUNT { Some(Self(index as u8)) } else { None }
    }

    pub(super) const fn of_built_in(index: u8) -> Self {
        Self(index)
    }

    /// Every layer that a map can have.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..Self::COUNT).filter_map(Self::new)
    }

    /// The index of the layer, 0 to 15.
    pub const fn index(self) -> usize {
        self.0 as usize
    }
}

/// Some of a map's layers, as a set of bits: bit 0 is layer 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LayerMask(pub u16);

impl LayerMask {
    /// Whether a layer is among them.
    pub fn has(self, id: LayerId) -> bool {
        self.0 >> id.index() & 1 == 1
    }

    /// The layers among them, by their indexes.
    pub fn iter(self) -> impl Iterator<Item = LayerId> {
        LayerId::all().filter(move |&id| self.has(id))
    }
}

impl FromIterator<LayerId> for LayerMask {
    fn from_iter<I: IntoIterator<Item = LayerId>>(layers: I) -> Self {
        Self(layers.into_iter().fold(0, |bits, id| bits | 1 << id.index()))
    }
}

/// The descriptions of a map's layers. A vehicle has those that it may send; a surface the built-in ones and above them
/// those that the vehicle has announced.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayerSet(BTreeMap<LayerId, LayerDescriptor>);

impl Default for LayerSet {
    /// The built-in layers: depth, confidence, curiosity.
    fn default() -> Self {
        Self(BUILT_IN_LAYERS.iter().map(|layer| (layer.id, layer.descriptor.clone())).collect())
    }
}

impl LayerSet {
    /// The description of a layer.
    pub fn get(&self, id: LayerId) -> Option<&LayerDescriptor> {
        self.0.get(&id)
    }

    /// The layer of that name.
    pub fn id(&self, name: &str) -> Option<LayerId> {
        self.iter().find(|(_, layer)| layer.name == name).map(|(id, _)| id)
    }

    /// The name of a layer; "layer 7" if the set has no layer 7.
    pub fn name(&self, id: LayerId) -> String {
        self.get(id).map_or_else(|| format!("layer {}", id.index()), |layer| layer.name.clone().into_owned())
    }

    /// Every layer by its index.
    pub fn iter(&self) -> impl Iterator<Item = (LayerId, &LayerDescriptor)> {
        self.0.iter().map(|(&id, layer)| (id, layer))
    }

    /// Describes a layer, in place of an earlier description.
    pub fn insert(&mut self, id: LayerId, layer: LayerDescriptor) {
        self.0.insert(id, layer);
    }

    /// Adds a layer under the next free index; `None` if there are 16 already, if the description is not sound, or if
    /// another layer of the set has the same name.
    pub fn add(&mut self, layer: LayerDescriptor) -> Option<LayerId> {
        let free = LayerId::all().find(|&id| self.get(id).is_none())?;
        let is_new = layer.is_sound() && self.id(&layer.name).is_none();
        is_new.then(|| {
            self.insert(free, layer);
            free
        })
    }

    /// The layers of these names; the first name that no layer has is the error.
    pub fn mask<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<LayerMask, &'a str> {
        names.into_iter().map(|name| self.id(name).ok_or(name)).collect()
    }
}

/// A layer that an operator can name before a vehicle has announced it.
#[derive(Debug)]
pub struct BuiltInLayer {
    /// Its index on every vehicle.
    pub id: LayerId,
    /// Its description; a vehicle may announce another one, for example with other depths.
    pub descriptor: LayerDescriptor,
    /// One sentence about the layer for people.
    pub summary: &'static str,
}

/// Depth of the sea floor; the vehicle chooses the scale by [`LayerDescriptor::depth_around`].
pub(super) const DEPTH: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("depth"),
    unit: Cow::Borrowed("m"),
    quantity: Quantity::Depth,
    scale: Decimal::new(5, -1),
    offset: Decimal::ZERO,
    steps: Steps::Equal,
    levels: 254,
    upper_end: UpperEnd::Exclusive,
    share: 0,
    palette: Palette::Cividis,
    spread: Spread::Present,
};

impl LayerDescriptor {
    /// Depths in steps of about `step_m` metres, to a tenth, with `middle_m` in the middle of the scale, or as near to it
    /// as a scale that begins at the surface or below has it.
    pub fn depth_around(middle_m: f64, step_m: f64) -> Self {
        let step_dm = (step_m * 10.0).round().clamp(1.0, 255.0);
        let first = (middle_m * 10.0 / step_dm - f64::from(MAX_LABEL) / 2.0).round().max(0.0);
        Self { scale: Decimal::new(step_dm as i32, -1), offset: Decimal::new((first * step_dm) as i32, -1), ..DEPTH }
    }
}

/// How sure the model is of the label, from 0 to 1.
pub(super) const CONFIDENCE: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("confidence"),
    unit: Cow::Borrowed(""),
    quantity: Quantity::Plain,
    scale: Decimal::new(25, -2),
    levels: 4,
    upper_end: UpperEnd::Inclusive,
    spread: Spread::Scale,
    ..DEPTH
};

/// How badly the model explains a cell: the binary logarithm of the perplexity.
pub(super) const CURIOSITY: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("curiosity"),
    unit: Cow::Borrowed("bit"),
    quantity: Quantity::Plain,
    scale: Decimal::new(1, 0),
    levels: 16,
    upper_end: UpperEnd::Unbounded,
    palette: Palette::Inferno,
    spread: Spread::Common,
    ..DEPTH
};

/// How long ago the vehicle last saw a cell.
pub(super) const LAST_SEEN: LayerDescriptor = LayerDescriptor {
    name: Cow::Borrowed("last_seen"),
    unit: Cow::Borrowed("min"),
    quantity: Quantity::Plain,
    scale: Decimal::new(2, 0),
    steps: Steps::Doubling,
    levels: 10,
    upper_end: UpperEnd::Unbounded,
    ..DEPTH
};

/// The built-in layers by their indexes. Of two that may be sent the one with the lower index goes first: depths change
/// seldom, so they go before confidences. An index is never given to another layer, because settings in a journal name it.
pub static BUILT_IN_LAYERS: [BuiltInLayer; 4] = [
    BuiltInLayer { id: LayerId::DEPTH, descriptor: DEPTH, summary: "Depth of the sea floor below the surface" },
    BuiltInLayer {
        id: LayerId::CONFIDENCE,
        descriptor: CONFIDENCE,
        summary: "How sure the scene model is of the label",
    },
    BuiltInLayer {
        id: LayerId::CURIOSITY,
        descriptor: CURIOSITY,
        summary: "How badly the scene model explains a cell: mean surprise of a word, the binary logarithm of the perplexity",
    },
    BuiltInLayer {
        id: LayerId::LAST_SEEN,
        descriptor: LAST_SEEN,
        summary: "How long before its last camera frame the vehicle last saw a cell",
    },
];

impl LayerId {
    /// Depth of the sea floor, metres.
    pub const DEPTH: Self = Self::of_built_in(0);
    /// Confidence of the model in the label, 0 to 1.
    pub const CONFIDENCE: Self = Self::of_built_in(1);
    /// Binary logarithm of the perplexity, bits a word.
    pub const CURIOSITY: Self = Self::of_built_in(2);
    /// Time from the last sight of the cell to the last camera frame, minutes.
    pub const LAST_SEEN: Self = Self::of_built_in(3);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn layers_are_found_by_name_and_index() {
        let mut set = LayerSet::default();
        let turbidity =
            LayerDescriptor { name: "turbidity".into(), unit: "NTU".into(), ..BUILT_IN_LAYERS[2].descriptor.clone() };
        let id = set.add(turbidity.clone()).unwrap();
        assert_eq!((id.index(), set.id("turbidity"), set.get(id)), (BUILT_IN_LAYERS.len(), Some(id), Some(&turbidity)));
        assert_eq!((set.add(turbidity), set.name(LayerId(15))), (None, "layer 15".to_owned()));
        let mask = set.mask(["turbidity", "depth"]).unwrap();
        assert_eq!(mask.iter().collect::<Vec<_>>(), [LayerId::DEPTH, id]);
        assert_eq!((mask.has(LayerId::CONFIDENCE), set.mask(["depth", "sonar"])), (false, Err("sonar")));
    }

    #[test]
    fn a_map_has_sixteen_layers_at_most() {
        let mut set = LayerSet::default();
        let named = |name: String| LayerDescriptor { name: name.into(), ..BUILT_IN_LAYERS[0].descriptor.clone() };
        let added = (0..20).filter_map(|i| set.add(named(format!("raster_{i}")))).count();
        assert_eq!((added + BUILT_IN_LAYERS.len(), set.iter().count()), (16, 16));
    }

    #[test]
    fn the_table_of_built_in_layers_is_sound() {
        for (index, layer) in BUILT_IN_LAYERS.iter().enumerate() {
            assert_eq!(layer.id.index(), index);
            assert!(layer.descriptor.is_sound(), "{layer:?}");
            assert_eq!(LayerDescriptor::from_bytes(&layer.descriptor.to_bytes()).as_ref(), Some(&layer.descriptor));
            let names = BUILT_IN_LAYERS.iter().filter(|other| other.descriptor.name == layer.descriptor.name);
            assert_eq!((names.count(), layer.summary.is_empty()), (1, false));
        }
    }
}
