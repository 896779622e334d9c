//! The planes of a vehicle's map, as the surface holds them.

use crate::map::{PlaneChunk, PlaneKind, PlaneReplica};
use crate::time::Instant;
use std::collections::BTreeMap;

/// What became of a plane chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// It is carried out.
    Taken,
    /// It is of no plane that is known here.
    Unknown,
    /// The two ends differ.
    OutOfStep,
}

/// Planes that a vehicle has spoken of in this pair of runs.
#[derive(Debug, Default)]
pub(super) struct Planes {
    replicas: BTreeMap<PlaneKind, PlaneReplica>,
    version: u64,
}

impl Planes {
    pub(super) fn get(&self, kind: PlaneKind) -> Option<&PlaneReplica> {
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
        let is_equal = match PlaneChunk::decode(payload) {
            None => return Heard::Unknown,
            Some(PlaneChunk::Digest(kind, digest)) => digest == self.get(kind).map_or(0, PlaneReplica::base_digest),
            Some(PlaneChunk::Patch(scale, patch)) => {
                let replica = self.replicas.entry(scale.kind()).or_insert_with(|| PlaneReplica::new(scale));
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
    use crate::map::{Cell, PlaneScale, PlaneSource, StateSource};
    use crate::map_codec::Codec;
    use std::time::Duration;

    fn depths(from_dm: u16) -> PlaneSource {
        let scale = PlaneScale::Depth { step_dm: 5, first: from_dm };
        let mut source = PlaneSource::new(scale, Codec::Png, Duration::ZERO);
        source.set((0..20).map(|i| (Cell::new(i, -i), 20.0 + f64::from(i))), Instant::ZERO);
        source
    }

    #[test]
    fn a_plane_that_is_not_known_is_passed_over_and_one_on_another_scale_is_not() {
        let mut planes = Planes::default();
        let (chunk, carried) = depths(0).next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(planes.handle_chunk(1, &[&[4], &chunk[1..]].concat(), Instant::ZERO), Heard::Unknown);
        assert_eq!((planes.handle_chunk(1, &chunk, Instant::ZERO), planes.version()), (Heard::Taken, 1));
        let shown = planes.get(PlaneKind::Depth).unwrap().levels().shown();
        assert!(carried.iter().all(|&(cell, level)| shown.get(cell) == level));
        let (chunk, _) = depths(1).next_chunk(200, Instant::ZERO).unwrap();
        assert_eq!(planes.handle_chunk(2, &chunk, Instant::ZERO), Heard::OutOfStep);
        planes.clear();
        assert_eq!((planes.get(PlaneKind::Depth).is_none(), planes.version()), (true, 2));
    }

    #[test]
    fn a_digest_is_held_against_the_base() {
        let (mut planes, mut source) = (Planes::default(), depths(0));
        let (chunk, carried) = source.next_chunk(200, Instant::ZERO).unwrap();
        planes.handle_chunk(1, &chunk, Instant::ZERO);
        source.handle_fate(carried, true, Instant::ZERO);
        assert_eq!(planes.handle_chunk(2, &source.digest_chunk(), Instant::ZERO), Heard::OutOfStep);
        planes.advance_base(1);
        assert_eq!(planes.handle_chunk(3, &source.digest_chunk(), Instant::ZERO), Heard::Taken);
    }
}
