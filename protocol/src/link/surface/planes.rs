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
