//! Agreement and delay of the operator's map, layer by layer.

use super::quality::QualitySeries;
use crate::meter::Meter;
use scenecast_protocol::map::{LabelGrid, LayerId, LayerReplica};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::Surface;
use scenecast_vehicle::Vehicle;
use std::collections::BTreeMap;

/// A meter for the labels and one for each layer that was sent.
#[derive(Default)]
pub(crate) struct Meters {
    pub(crate) labels: Meter,
    pub(crate) layers: BTreeMap<LayerId, Meter>,
    pub(super) quality: QualitySeries,
    /// Changes of the operator's map so far.
    operator_version: u64,
}

impl Meters {
    /// The operator's map of a vehicle has changed.
    pub(super) fn note_operator_change(&mut self) {
        self.operator_version += 1;
    }

    pub(super) fn look(&mut self, vehicle: &Vehicle, surface: &Surface, address: Address, now: Instant) {
        let Some(operator) = surface.map(address) else { return };
        let versions = (vehicle.map_version(), self.operator_version);
        self.labels.look(vehicle.map(), operator, versions, now);
        let (view, empty) = (surface.view(address), LabelGrid::default());
        for layer in vehicle.layers() {
            let id = layer.id();
            let replica = view.and_then(|v| v.layer(id));
            let versions = (layer.version(), replica.map_or(0, LayerReplica::version));
            let meter = self.layers.entry(id).or_default();
            meter.look(layer.target(), replica.map_or(&empty, |r| r.levels().shown()), versions, now);
        }
    }

    /// Changes from now on do not count for the means over the survey.
    pub(super) fn end_survey(&mut self) {
        self.labels.end_survey();
        self.layers.values_mut().for_each(Meter::end_survey);
    }
}
