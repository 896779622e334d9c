//! The bands of another program, and the layers that they have.

use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{
    BUILT_IN_LAYERS, Cell, LabelGrid, LayerDescriptor, LayerId, LayerMask, LayerSet, LayerSource,
};
use scenecast_protocol::map_codec::Codec;
use std::collections::BTreeMap;
use std::time::Duration;

/// The bands, those of built-in layers included; others have the indexes above the built-in ones.
#[derive(Debug, Default)]
pub(super) struct Bands {
    /// The codec of the layers that are added.
    codec: Codec,
    set: LayerSet,
    bands: BTreeMap<LayerId, Band>,
}

/// The levels of a band. Those of the layer of the same name may be others, if it is a built-in one.
#[derive(Debug)]
struct Band {
    descriptor: LayerDescriptor,
    levels: LabelGrid,
}

impl Band {
    /// The middle of a level; not a number where the quantity is not known.
    fn quantity(&self, level: u8) -> f64 {
        self.descriptor.middle(level).unwrap_or(f64::NAN)
    }
}

impl Bands {
    /// Sets the codec of the layers that are added from now on.
    pub(super) fn set_codec(&mut self, codec: Codec) {
        self.codec = codec;
    }

    /// Whether a layer is that of a band.
    pub(super) fn has(&self, id: LayerId) -> bool {
        self.bands.contains_key(&id)
    }

    /// The layer of a band, which the link has from then on, and whether it is new; `None` if the map has no further one.
    pub(super) fn add(&mut self, descriptor: &LayerDescriptor, link: &mut VehicleLink) -> (Option<LayerId>, bool) {
        let id = match self.set.id(&descriptor.name) {
            Some(id) => id,
            None => {
                let Some(id) = self.set.add(descriptor.clone()) else { return (None, false) };
                link.add_layer(LayerSource::new(id, descriptor.clone(), self.codec, Duration::ZERO));
                id
            }
        };
        let is_new = !self.has(id);
        let band = || Band { descriptor: descriptor.clone(), levels: LabelGrid::default() };
        self.bands.entry(id).or_insert_with(band);
        (Some(id), is_new)
    }

    /// Takes changed levels; returns the quantities of these cells.
    pub(super) fn take(&mut self, id: LayerId, levels: &[(Cell, u8)]) -> Vec<(Cell, f64)> {
        let Some(band) = self.bands.get_mut(&id) else { return Vec::new() };
        band.levels.extend(levels.iter().copied());
        levels.iter().map(|&(cell, level)| (cell, band.quantity(level))).collect()
    }

    /// The quantities of every band.
    pub(super) fn all(&self) -> impl Iterator<Item = (LayerId, Vec<(Cell, f64)>)> + '_ {
        let quantities = |band: &Band| band.levels.iter().map(|(cell, level)| (cell, band.quantity(level))).collect();
        self.bands.iter().map(move |(&id, band)| (id, quantities(band)))
    }

    /// These layers and the bands above the built-in ones.
    pub(super) fn added_to(&self, layers: LayerMask) -> LayerMask {
        let more = self.bands.keys().copied().filter(|id| id.index() >= BUILT_IN_LAYERS.len());
        layers.iter().chain(more).collect()
    }
}
