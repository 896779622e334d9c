//! Layers of the map: what of them goes into a frame, and when they are worth a turn.

use super::content::{Carried, Part, VehicleContent};
use crate::map::{Cell, LayerKind, LayerSource, StateSource};
use crate::schedule::Class;
use crate::time::Instant;
use crate::wire::{ChunkKind, FrameBuilder, room_for_payload};

/// A layer that the link replicates.
#[derive(Debug)]
pub(super) struct LayerOut {
    pub(super) source: LayerSource,
    /// Whether it has a share; one without takes what nobody else needs.
    pub(super) has_share: bool,
    /// Whether its digest is to be told.
    pub(super) owes_digest: bool,
    /// Whether it is told at all; one that is not rests with what the surface has of it.
    pub(super) is_told: bool,
}

impl LayerOut {
    pub(super) fn class(&self) -> Class {
        self.source.scale().kind().into()
    }
}

impl<S: StateSource> VehicleContent<S> {
    /// Replicates these layers beside the state, each with its part of the map's share in percent.
    pub(super) fn set_layers(&mut self, layers: impl IntoIterator<Item = (LayerSource, u8)>) {
        let mut shares = [0; Class::LAYERS.len()];
        self.layers.clear();
        for (source, share) in layers {
            let layer = LayerOut { source, has_share: share > 0, owes_digest: false, is_told: true };
            Class::LAYERS.iter().zip(&mut shares).filter(|(c, _)| **c == layer.class()).for_each(|(_, s)| *s = share);
            self.layers.push(layer);
        }
        self.shares.set_layers(shares);
    }

    /// The layers that are told: those that have a share or a place in the spending of left-over bits.
    pub(super) fn layers(&self) -> impl Iterator<Item = &LayerSource> {
        let has_bits = |p: &&LayerOut| p.has_share || self.background.iter().any(|stream| stream.class() == p.class());
        self.layers.iter().filter(|p| p.is_told).filter(has_bits).map(|p| &p.source)
    }

    /// Which of the layers are told from now on; the others rest, and go on from there when they are told again.
    pub(super) fn set_told_layers(&mut self, is_told: impl Fn(LayerKind) -> bool) {
        self.layers.iter_mut().for_each(|p| p.is_told = is_told(p.source.scale().kind()));
    }

    /// As [`LayerSource::set_coarse_limit`], for each layer.
    pub(super) fn set_coarse_layers(&mut self, after_bytes: Option<usize>) {
        self.layers.iter_mut().for_each(|p| p.source.set_coarse_limit(after_bytes));
    }

    /// Sets quantities of cells of a layer, if it is replicated; returns whether the layer has changed.
    pub(super) fn set_layer(
        &mut self,
        kind: LayerKind,
        cells: impl IntoIterator<Item = (Cell, f64)>,
        now: Instant,
    ) -> bool {
        self.layer_mut(kind).is_some_and(|layer| layer.source.set(cells, now) > 0)
    }

    pub(super) fn layer_mut(&mut self, kind: LayerKind) -> Option<&mut LayerOut> {
        self.layers.iter_mut().find(|p| p.source.scale().kind() == kind)
    }

    /// Classes of the layers that have something to send and a share.
    pub(super) fn waiting_layers(&self) -> impl Iterator<Item = Class> {
        self.layers.iter().filter(|p| p.is_told && p.has_share && p.source.backlog_bytes() > 0).map(LayerOut::class)
    }

    /// About how many bytes of layers with a share wait.
    pub(super) fn shared_layer_backlog(&self) -> usize {
        self.layers.iter().filter(|p| p.is_told && p.has_share).map(|p| p.source.backlog_bytes()).sum()
    }

    pub(super) fn fill_layer(
        &mut self,
        class: Class,
        builder: &mut FrameBuilder,
        carried: &mut Carried<S::Carried>,
        now: Instant,
    ) {
        let room = room_for_payload(builder.room());
        let layer = self.layers.iter_mut().find(|p| p.class() == class);
        let Some(source) = layer.map(|p| &mut p.source) else { return };
        let Some((bytes, content)) = source.next_chunk(room, now) else { return };
        let fits = builder.push(ChunkKind::Layer, &bytes);
        assert!(fits, "a chunk of {} bytes was made for {room}", bytes.len());
        carried.push((Part::Layer(source.scale().kind(), content), bytes.len()));
    }

    /// The digests that are owed, as far as there is room for them.
    pub(super) fn fill_digests(&mut self, builder: &mut FrameBuilder, carried: &mut Carried<S::Carried>) {
        for layer in self.layers.iter_mut().filter(|p| p.is_told && p.owes_digest) {
            let bytes = layer.source.digest_chunk();
            if builder.push(ChunkKind::Layer, &bytes) {
                layer.owes_digest = false;
                carried.push((Part::LayerDigest(layer.source.scale().kind()), bytes.len()));
            }
        }
    }
}
