//! Layers of the map: their chunks in a frame, and the turns that they need.

use super::content::{Carried, Part, VehicleContent};
use super::event::OversizedChunk;
use crate::map::{Cell, LayerId, LayerMask, LayerSource, StateSource};
use crate::schedule::BackgroundStream;
use crate::time::Instant;
use crate::wire::{ChunkKind, FrameBuilder, room_for_payload};

/// A layer that the link replicates.
#[derive(Debug)]
pub(super) struct LayerOut {
    pub(super) source: LayerSource,
    /// Whether its digest is due.
    pub(super) owes_digest: bool,
    /// Whether it is sent at all; another one rests with the levels that the surface has of it.
    pub(super) is_selected: bool,
}

impl LayerOut {
    /// A layer without a share is sent with spare capacity only.
    pub(super) fn has_share(&self) -> bool {
        self.source.descriptor().share > 0
    }

    fn is_shared(&self) -> bool {
        self.is_selected && self.has_share()
    }
}

impl<S: StateSource> VehicleContent<S> {
    /// Replicates a layer beside the state; `false` if there is one with its index already.
    pub(super) fn add_layer(&mut self, source: LayerSource) -> bool {
        let is_new = self.layers.iter().all(|l| l.source.id() != source.id());
        if is_new {
            self.shares.set_layer(source.id(), source.descriptor().share);
            self.layers.push(LayerOut { source, owes_digest: false, is_selected: true });
        }
        is_new
    }

    /// The layers that are sent: those that are selected and have a share or are a background stream.
    pub(super) fn layers(&self) -> impl Iterator<Item = &LayerSource> {
        let is_background = |l: &LayerOut| self.background.has(BackgroundStream::Layer(l.source.id()));
        self.layers.iter().filter(move |l| l.is_selected && (l.has_share() || is_background(l))).map(|l| &l.source)
    }

    /// Selects the layers that are sent from now on; the others rest, and continue from there when they are selected again.
    pub(super) fn select_layers(&mut self, layers: LayerMask) {
        self.layers.iter_mut().for_each(|l| l.is_selected = layers.has(l.source.id()));
    }

    /// As [`LayerSource::set_coarse_limit`], for each layer.
    pub(super) fn set_coarse_layers(&mut self, after_bytes: Option<usize>) {
        self.layers.iter_mut().for_each(|l| l.source.set_coarse_limit(after_bytes));
    }

    /// Sets quantities of cells of a layer, if it is replicated; returns whether the layer has changed.
    pub(super) fn set_layer(
        &mut self,
        id: LayerId,
        cells: impl IntoIterator<Item = (Cell, f64)>,
        now: Instant,
    ) -> bool {
        self.layer_mut(id).is_some_and(|layer| layer.source.set(cells, now) > 0)
    }

    pub(super) fn layer_mut(&mut self, id: LayerId) -> Option<&mut LayerOut> {
        self.layers.iter_mut().find(|l| l.source.id() == id)
    }

    /// The layers that have something to send and a share.
    pub(super) fn waiting_layers(&self) -> impl Iterator<Item = LayerId> {
        self.layers.iter().filter(|l| l.is_shared() && l.source.backlog_bytes() > 0).map(|l| l.source.id())
    }

    /// About how many bytes of layers with a share wait.
    pub(super) fn shared_layer_backlog(&self) -> usize {
        self.layers.iter().filter(|l| l.is_shared()).map(|l| l.source.backlog_bytes()).sum()
    }

    pub(super) fn fill_layer(
        &mut self,
        id: LayerId,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        now: Instant,
    ) {
        let room = room_for_payload(builder.room());
        let Some(source) = self.layer_mut(id).map(|l| &mut l.source) else { return };
        let Some((bytes, content)) = source.next_chunk(room, now) else { return };
        if builder.push(ChunkKind::Layer, &bytes) {
            carried.push((Part::Layer(id, content), bytes.len()));
        } else {
            source.handle_fate(content, false, now);
            self.oversized = Some(OversizedChunk { bytes: bytes.len(), room });
        }
    }

    /// The digests that are owed, as far as there is room for them.
    pub(super) fn fill_digests(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        for layer in self.layers.iter_mut().filter(|l| l.is_selected && l.owes_digest) {
            let bytes = layer.source.digest_chunk();
            if builder.push(ChunkKind::Layer, &bytes) {
                layer.owes_digest = false;
                carried.push((Part::LayerDigest(layer.source.id()), bytes.len()));
            }
        }
    }
}
