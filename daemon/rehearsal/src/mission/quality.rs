//! The quality of both maps of a mission over time, layer by layer and in coarse blocks.

use super::{MapInformation, Mission};
use crate::meter::Meter;
use scenecast_protocol::map::{Cell, LabelGrid, LayerId, LayerReplica};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::Address;
use scenecast_surface::Surface;
use scenecast_vehicle::Vehicle;
use scenecast_worlds::scoring::{MutualInformation, Seams, TimedCell, mutual_information_nats};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

const INTERVAL: Duration = Duration::from_secs(30);
/// Samples between two maps whose labels are compared: five minutes.
const COMPARED: usize = 10;

/// The quality of both maps at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapQuality {
    /// Mission time of the sample, in seconds.
    pub t_s: f64,
    /// `None` without annotation, as for the operator's map.
    pub vehicle: Option<MapInformation>,
    pub operator: Option<MapInformation>,
    /// Share of the vehicle's explored cells on which the maps agree.
    pub agreement: f64,
    /// Seconds for which the operator's label has differed, mean over the vehicle's explored cells.
    pub age_s: f64,
    /// Share of the cells published five minutes ago whose label differs now; `None` before.
    pub relabelled: Option<f64>,
    /// Root mean square errors of the frames' places in cells, after the best turn and shift, and as the vehicle places
    /// them; `None` for a recording.
    pub error_rigid_cells: Option<f64>,
    pub error_placed_cells: Option<f64>,
}

impl MapQuality {
    /// The operator's mutual information divided by the vehicle's, both after the best rigid fit.
    pub fn operator_share(&self) -> Option<f64> {
        let vehicle = self.vehicle.map(|v| v.rigid_nats).filter(|nats| *nats > 0.0)?;
        Some(self.operator?.rigid_nats / vehicle)
    }
}

#[derive(Debug, Default)]
pub(crate) struct QualitySeries {
    samples: Vec<MapQuality>,
    /// The published maps of the last five minutes, the oldest first.
    published: VecDeque<LabelGrid>,
    due: Option<Instant>,
}

impl QualitySeries {
    fn takes_sample(&mut self, now: Instant) -> bool {
        let is_due = self.due.is_none_or(|due| now >= due);
        if is_due {
            self.due = Some(now + INTERVAL);
        }
        is_due
    }

    /// The share of the cells published five minutes ago whose label differs now.
    fn relabelled(&self, now: &LabelGrid) -> Option<f64> {
        let then = self.published.front().filter(|_| self.published.len() == COMPARED)?;
        let (cells, changed) = then
            .iter()
            .fold((0, 0), |(cells, changed), (cell, label)| (cells + 1, changed + u64::from(now.get(cell) != label)));
        (cells > 0).then(|| changed as f64 / cells as f64)
    }
}

impl Mission {
    /// The quality of both maps now.
    pub fn quality(&self) -> MapQuality {
        let errors = self.registration_error_m();
        let report = self.surface().status(self.address()).map(|(status, _)| status);
        let cells = |metres: f64| metres / self.cell_m();
        MapQuality {
            t_s: self.now().as_secs_f64(),
            vehicle: self.map_information(self.vehicle().map()),
            operator: self.shown_information(&self.operator_map(), report),
            agreement: self.meters.labels.agreement(),
            age_s: self.meters.labels.age_s(self.now()),
            relabelled: self.meters.quality.relabelled(self.vehicle().map()),
            error_rigid_cells: errors.map(|e| cells(e.rigid_m)),
            error_placed_cells: errors.map(|e| cells(e.placed_m)),
        }
    }

    /// The quality of both maps every half minute from the start of the mission on.
    pub fn quality_series(&self) -> &[MapQuality] {
        &self.meters.quality.samples
    }

    pub(super) fn sample_quality(&mut self) {
        if self.meters.quality.takes_sample(self.now()) {
            let (sample, published) = (self.quality(), self.vehicle().map().clone());
            let series = &mut self.meters.quality;
            series.samples.push(sample);
            series.published.push_back(published);
            if series.published.len() > COMPARED {
                series.published.pop_front();
            }
        }
    }

    /// The agreement of a map's labels with the true classes, cell by cell; `None` without annotation.
    pub fn class_agreement(&self, map: &LabelGrid) -> Option<MutualInformation> {
        let world = self.camera.world.is_annotated().then_some(&self.camera.world)?;
        let class = |cell| world.class_of(cell, self.cell_m());
        let pairs = map.iter().filter_map(|(cell, label)| Some((u32::from(label), u32::from(class(cell)?))));
        Some(mutual_information_nats(pairs))
    }

    /// Whether cells of one class that were first seen far apart in time have one label on the vehicle's map.
    pub fn seams(&self) -> Seams {
        let cell_m = self.cell_m();
        let timed = |(cell, label): (Cell, u8)| {
            let class = u32::from(self.camera.world.class_of(cell, cell_m)?);
            let first_seen_s = *self.logbook.map.first_seen_s.get(&cell)?;
            Some(((cell.x, cell.y), TimedCell { label: label.into(), class, first_seen_s }))
        };
        Seams::of(&self.vehicle().map().iter().filter_map(timed).collect())
    }
}

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
