//! The copy of a run that has ended.

use crate::link::surface::layers::Layers;
use crate::map::{LayerId, LayerReplica, LayerSet, Replica};
use crate::time::Instant;
use crate::wire::VehicleStatus;

/// The surface's copy of a vehicle's state at the end of a run, until the copy of a later run has as many cells.
#[derive(Debug)]
pub struct EndedRun<R = Replica> {
    pub(super) replica: R,
    pub(super) layers: Layers,
    pub(super) status: Option<(VehicleStatus, Instant)>,
    pub(super) epoch: Option<u8>,
    pub(super) ended: Instant,
}

impl<R> EndedRun<R> {
    /// The replicated state at its end.
    pub fn replica(&self) -> &R {
        &self.replica
    }

    /// The layers of its map.
    pub fn layers(&self) -> &LayerSet {
        self.layers.set()
    }

    /// A layer of its map, if the vehicle had announced it.
    pub fn layer(&self, id: LayerId) -> Option<&LayerReplica> {
        self.layers.get(id)
    }

    /// The last status of the run, and when its pose came in.
    pub fn status(&self) -> Option<&(VehicleStatus, Instant)> {
        self.status.as_ref()
    }

    /// The epoch of its label ids; `None` if no report had come in.
    pub fn epoch(&self) -> Option<u8> {
        self.epoch
    }

    /// When the surface noticed its end.
    pub fn ended(&self) -> Instant {
        self.ended
    }
}
