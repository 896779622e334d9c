//! The layers that bands of another program have.

use scenecast_protocol::link::VehicleLink;
use scenecast_protocol::map::{BUILT_IN_LAYERS, LayerDescriptor, LayerId, LayerMask, LayerSet, LayerSource};
use scenecast_protocol::map_codec::Codec;
use std::time::Duration;

/// The built-in layers, and the bands under the indexes above them.
#[derive(Debug, Default)]
pub(super) struct Bands {
    set: LayerSet,
    /// Every band, those of built-in layers included.
    ids: LayerMask,
}

impl Bands {
    /// The number of bands.
    pub(super) fn len(&self) -> usize {
        self.ids.iter().count()
    }

    /// The layer of a band, if there is one.
    pub(super) fn get(&self, id: LayerId) -> Option<&LayerDescriptor> {
        self.set.get(id).filter(|_| self.ids.has(id))
    }

    /// The layer of a band, which the link has from then on; `None` if it has no further one. A band with the name of a
    /// built-in layer has that layer's levels.
    pub(super) fn add(
        &mut self,
        descriptor: &LayerDescriptor,
        codec: Codec,
        link: &mut VehicleLink,
    ) -> Option<LayerId> {
        if let Some(id) = self.set.id(&descriptor.name) {
            self.ids.0 |= 1 << id.index();
            return Some(id);
        }
        let id = self.set.add(descriptor.clone())?;
        link.add_layer(LayerSource::new(id, descriptor.clone(), codec, Duration::ZERO));
        self.ids.0 |= 1 << id.index();
        Some(id)
    }

    /// These layers and the bands above the built-in ones.
    pub(super) fn added_to(&self, layers: LayerMask) -> LayerMask {
        let more = self.ids.iter().filter(|id| id.index() >= BUILT_IN_LAYERS.len());
        layers.iter().chain(more).collect()
    }
}
