//! The layers of a vehicle's map, as the surface holds them.

use crate::map::{LayerChunk, LayerKind, LayerReplica};
use crate::time::Instant;
use std::collections::BTreeMap;

/// What became of a layer chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// It is carried out.
    Taken,
    /// It is of no layer that is known here.
    Unknown,
    /// The two ends differ.
    OutOfStep,
}

/// Layers that a vehicle has spoken of in this pair of runs.
#[derive(Debug, Default)]
pub(super) struct Layers {
    replicas: BTreeMap<LayerKind, LayerReplica>,
    version: u64,
}

impl Layers {
    pub(super) fn get(&self, kind: LayerKind) -> Option<&LayerReplica> {
        self.replicas.get(&kind)
    }

    /// Counts changes of what is shown.
    pub(super) fn version(&self) -> u64 {
        self.version
    }

    pub(super) fn advance_base(&mut self, horizon: u64) {
        self.replicas.values_mut().for_each(|r| r.advance_base(horizon));
    }

    pub(super) fn handle_chunk(&mut self, number: u64, payload: &[u8], now: Instant) -> Heard {
        let is_equal = match LayerChunk::decode(payload) {
            None => return Heard::Unknown,
            Some(LayerChunk::Digest(kind, digest)) => digest == self.get(kind).map_or(0, LayerReplica::base_digest),
            Some(LayerChunk::Patch(scale, patch)) => {
                let replica = self.replicas.entry(scale.kind()).or_insert_with(|| LayerReplica::new(scale));
                let before = replica.version();
                let applied = replica.apply(number, scale, patch, now);
                self.version += u64::from(replica.version() != before);
                applied
            }
        };
        if is_equal { Heard::Taken } else { Heard::OutOfStep }
    }

    /// Forgets everything: the vehicle began afresh.
    pub(super) fn clear(&mut self) {
        *self = Self { version: self.version + 1, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::{Cell, LayerScale, LayerSource, StateSource};
    use crate::map_codec::Codec;
    use std::time::Duration;

    fn depths(from_dm: u16) -> LayerSource {
        let scale = LayerScale::Depth { step_dm: 5, first: from_dm };
        let mut source = LayerSource::new(scale, Codec::Png, Duration::ZERO);
        source.set((0..20).map(|i| (Cell::new(i, -i), 20.0 + f64::from(i))), Instant::ZERO);
        source
    }

    #[test]
    fn a_layer_that_is_not_known_is_passed_over_and_one_on_another_scale_is_not() {
        let mut layers = Layers::default();
        let (chunk, carried) = depths(0).next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(layers.handle_chunk(1, &[&[4], &chunk[1..]].concat(), Instant::ZERO), Heard::Unknown);
        assert_eq!((layers.handle_chunk(1, &chunk, Instant::ZERO), layers.version()), (Heard::Taken, 1));
        let shown = layers.get(LayerKind::Depth).unwrap().levels().shown();
        assert!(carried.iter().all(|&(cell, level)| shown.get(cell) == level));
        let (chunk, _) = depths(1).next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(layers.handle_chunk(2, &chunk, Instant::ZERO), Heard::OutOfStep);
        layers.clear();
        assert_eq!((layers.get(LayerKind::Depth).is_none(), layers.version()), (true, 2));
    }

    #[test]
    fn a_digest_is_held_against_the_base() {
        let (mut layers, mut source) = (Layers::default(), depths(0));
        let (chunk, carried) = source.next_chunk(200, Instant::ZERO).unwrap();
        layers.handle_chunk(1, &chunk, Instant::ZERO);
        source.handle_fate(carried, true, Instant::ZERO);
        assert_eq!(layers.handle_chunk(2, &source.digest_chunk(), Instant::ZERO), Heard::OutOfStep);
        layers.advance_base(1);
        assert_eq!(layers.handle_chunk(3, &source.digest_chunk(), Instant::ZERO), Heard::Taken);
    }
}
