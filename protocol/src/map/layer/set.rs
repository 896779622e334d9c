//! The layers of one map, by index and by name.

use super::{BUILT_IN_LAYERS, LayerDescriptor};
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
}
