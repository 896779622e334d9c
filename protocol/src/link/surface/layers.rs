//! The layers of a vehicle's map, as the surface holds them.

use crate::map::{LayerChunk, LayerDescriptor, LayerId, LayerReplica, LayerSet, TextAssembly, TextPart};
use crate::time::Instant;
use std::collections::BTreeMap;

/// The result of handling a layer chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LayerOutcome {
    Accepted,
    /// It is unreadable, or belongs to a layer that the vehicle has not announced.
    Skipped,
    /// It contradicts the layer, so the two ends hold different states.
    OutOfStep,
}

/// The layers that a vehicle has announced in this pair of runs.
#[derive(Debug, Default)]
pub(super) struct Layers {
    set: LayerSet,
    /// Descriptions of which parts are here.
    announced: BTreeMap<LayerId, TextAssembly>,
    replicas: BTreeMap<LayerId, LayerReplica>,
    version: u64,
}

impl Layers {
    /// Most cells of all layers together, but for those of one patch, beside the bounds of each layer.
    const MAX_CELLS: usize = 3 << 23;

    pub(super) fn get(&self, id: LayerId) -> Option<&LayerReplica> {
        self.replicas.get(&id)
    }

    pub(super) fn set(&self) -> &LayerSet {
        &self.set
    }

    /// Counts changes of the shown levels.
    pub(super) fn version(&self) -> u64 {
        self.version
    }

    pub(super) fn advance_base(&mut self, horizon: u64) {
        self.replicas.values_mut().for_each(|r| r.advance_base(horizon));
    }

    /// Whether a chunk that is based on every frame up to `horizon` is readable, and decodes if its layer is known.
    pub(super) fn decodes(&self, horizon: u64, payload: &[u8]) -> bool {
        match LayerChunk::decode(payload) {
            Some(LayerChunk::Patch(id, patch)) => self.get(id).is_none_or(|replica| replica.decodes(horizon, patch)),
            other => other.is_some(),
        }
    }

    pub(super) fn handle_chunk(&mut self, number: u64, payload: &[u8], now: Instant) -> LayerOutcome {
        let Some(chunk) = LayerChunk::decode(payload) else { return LayerOutcome::Skipped };
        if let LayerChunk::Descriptor(id, part) = chunk {
            return self.handle_descriptor(id, &part);
        }
        let cells: usize = self.replicas.values().map(|r| r.levels().received_cells()).sum();
        let Some(replica) = self.replicas.get_mut(&chunk.id()) else { return LayerOutcome::Skipped };
        let is_consistent = match chunk {
            LayerChunk::Digest(_, digest) => digest == replica.base_digest(),
            LayerChunk::Patch(_, patch) => {
                let before = replica.version();
                let is_applied = cells <= Self::MAX_CELLS && replica.apply(number, patch, now);
                self.version += u64::from(replica.version() != before);
                is_applied
            }
            LayerChunk::Descriptor(..) => true,
        };
        if is_consistent { LayerOutcome::Accepted } else { LayerOutcome::OutOfStep }
    }

    /// A repeated part of a layer that is already known has no effect: the vehicle lacks the acknowledgement of the first.
    fn handle_descriptor(&mut self, id: LayerId, part: &TextPart<'_>) -> LayerOutcome {
        if let Some(replica) = self.get(id) {
            let is_same = replica.descriptor().digest() == part.digest;
            return if is_same { LayerOutcome::Accepted } else { LayerOutcome::OutOfStep };
        }
        let parts = self.announced.entry(id).or_default();
        let taken = parts.take(part, LayerDescriptor::MAX_BYTES);
        let Some(whole) = taken else { return LayerOutcome::Skipped };
        if let Some(bytes) = whole {
            self.announced.remove(&id);
            let Some(descriptor) = LayerDescriptor::from_bytes(&bytes) else { return LayerOutcome::Skipped };
            self.set.insert(id, descriptor.clone());
            self.replicas.insert(id, LayerReplica::new(descriptor));
        }
        LayerOutcome::Accepted
    }

    /// Takes all layers and leaves none: the vehicle has begun a new run.
    pub(super) fn take(&mut self) -> Self {
        let empty = Self { version: self.version + 1, ..Self::default() };
        std::mem::replace(self, empty)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{Cell, LayerDescriptor, LayerSource, StateSource};
    use crate::map_codec::Codec;
    use std::time::Duration;

    fn depths(middle_m: f64) -> LayerSource {
        let descriptor = LayerDescriptor::depth_around(middle_m, 0.5);
        let mut source = LayerSource::new(LayerId::DEPTH, descriptor, Codec::Png, Duration::ZERO);
        source.set((0..20).map(|i| (Cell::new(i, -i), middle_m + f64::from(i))), Instant::ZERO);
        source
    }

    fn announce(layers: &mut Layers, source: &mut LayerSource) {
        let (chunk, carried) = source.next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(layers.handle_chunk(1, &chunk, Instant::ZERO), LayerOutcome::Accepted);
        source.handle_fate(carried, true, Instant::ZERO);
    }

    #[test]
    fn a_layer_is_skipped_until_it_is_announced() {
        let (mut layers, mut source, mut other) = (Layers::default(), depths(80.0), depths(90.0));
        let (descriptor, carried) = source.next_chunk(200, Instant::ZERO).unwrap();
        source.handle_fate(carried, true, Instant::ZERO);
        let (chunk, _) = source.next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(layers.handle_chunk(1, &chunk, Instant::ZERO), LayerOutcome::Skipped);
        assert_eq!(layers.handle_chunk(2, &source.digest_chunk(), Instant::ZERO), LayerOutcome::Skipped);
        assert!(layers.get(LayerId::DEPTH).is_none());
        assert_eq!(layers.handle_chunk(3, &descriptor, Instant::ZERO), LayerOutcome::Accepted);
        assert_eq!(layers.set().get(LayerId::DEPTH), Some(source.descriptor()));
        assert_eq!((layers.handle_chunk(4, &chunk, Instant::ZERO), layers.version()), (LayerOutcome::Accepted, 1));
        let shown = layers.get(LayerId::DEPTH).unwrap().levels().shown();
        assert!(source.target().iter().all(|(cell, level)| shown.get(cell) == level));
        assert_eq!(layers.handle_chunk(5, &descriptor, Instant::ZERO), LayerOutcome::Accepted, "repeated");
        let (descriptor, _) = other.next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(layers.handle_chunk(6, &descriptor, Instant::ZERO), LayerOutcome::OutOfStep, "another scale");
        layers.take();
        assert_eq!((layers.get(LayerId::DEPTH).is_none(), layers.version()), (true, 2));
        assert_eq!(layers.set(), &LayerSet::default());
    }

    #[test]
    fn a_digest_is_held_against_the_base() {
        let (mut layers, mut source) = (Layers::default(), depths(20.0));
        announce(&mut layers, &mut source);
        let (chunk, carried) = source.next_chunk(200, Instant::ZERO).unwrap();
        layers.handle_chunk(1, &chunk, Instant::ZERO);
        source.handle_fate(carried, true, Instant::ZERO);
        assert_eq!(layers.handle_chunk(2, &source.digest_chunk(), Instant::ZERO), LayerOutcome::OutOfStep);
        layers.advance_base(1);
        assert_eq!(layers.handle_chunk(3, &source.digest_chunk(), Instant::ZERO), LayerOutcome::Accepted);
    }
}
