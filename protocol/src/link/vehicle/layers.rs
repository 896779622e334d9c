//! Layers of the map and background streams: their chunks in a frame, and the turns that they need.

use super::config::OversizedChunk;
use super::content::VehicleContent;
use super::parts::{Carried, LayerOut, Part};
use crate::map::{LayerId, LayerMask, LayerSource, StateSource};
use crate::schedule::{BackgroundStream, BitBudget};
use crate::time::Instant;
use crate::wire::{ChunkKind, FrameBuilder, room_for_payload};

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

impl<S: StateSource> VehicleContent<S> {
    /// Whether the waiting cells of the map are themselves a background stream.
    pub(super) fn is_refining(&self) -> bool {
        self.background.has(BackgroundStream::Finer) && self.source.is_refining()
    }

    /// The background streams that wait and may be sent now. There is spare capacity while less than half of the
    /// budget's window was used, so that urgent content that comes up next finds room. While finer cells wait, the
    /// streams that the operator lists before them may be sent too. Exemplars of labels of which the surface has one, and the
    /// floor, come last.
    pub(super) fn background_streams(
        &self,
        budget: &BitBudget,
        now: Instant,
    ) -> impl Iterator<Item = BackgroundStream> {
        let (spare, refining) = (budget.is_plentiful(now), self.is_refining());
        let finer = self.background.iter().position(|s| s == BackgroundStream::Finer).filter(|_| refining);
        let allowed = move |place: usize| spare || finer.is_some_and(|finer| place <= finer);
        let are_objects = |stream| matches!(stream, BackgroundStream::Exemplars | BackgroundStream::Floor);
        let is_last = move |stream| are_objects(stream) && self.objects.waits_only_with_last();
        let waits =
            move |&(place, stream): &(usize, BackgroundStream)| allowed(place) && self.waiting_bytes(stream) > 0;
        let in_order = move |last: bool| self.background.iter().enumerate().filter(move |&(_, s)| is_last(s) == last);
        in_order(false).chain(in_order(true)).filter(waits).map(|(_, stream)| stream)
    }

    fn waiting_bytes(&self, stream: BackgroundStream) -> usize {
        match stream {
            BackgroundStream::Finer if self.is_refining() => self.source.backlog_bytes(),
            BackgroundStream::Finer => 0,
            // One queue has the objects of both, in the place of the exemplars where there are any.
            BackgroundStream::Floor if self.background.has(BackgroundStream::Exemplars) => 0,
            BackgroundStream::Exemplars | BackgroundStream::Floor => self.objects.background_backlog_bytes(),
            BackgroundStream::Layer(id) => {
                let of_stream = |l: &&LayerOut| l.is_selected && !l.has_share() && l.source.id() == id;
                self.layers.iter().find(of_stream).map_or(0, |l| l.source.backlog_bytes())
            }
        }
    }

    /// About how many bytes of background streams, without the map's finer cells, wait and may be sent.
    pub(super) fn background_backlog(&self, budget: &BitBudget, now: Instant) -> usize {
        self.background_streams(budget, now)
            .filter(|&e| e != BackgroundStream::Finer)
            .map(|e| self.waiting_bytes(e))
            .sum()
    }

    /// Whether no layer and no background object waits that may be sent, and none is outstanding.
    pub(super) fn background_is_quiet(&self, budget: &BitBudget, now: Instant) -> bool {
        let objects = self.objects.has_no_background() || self.objects.background_backlog_bytes() > 0;
        let layers = self.layers().all(|l| l.is_quiet() || l.backlog_bytes() > 0) && self.shared_layer_backlog() == 0;
        objects && layers && self.background_backlog(budget, now) == 0
    }
}
