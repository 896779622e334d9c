//! The quality of both maps of a mission over time.

use super::{MapInformation, Mission};
use scenecast_protocol::time::Instant;
use serde::Serialize;
use std::time::Duration;

const INTERVAL: Duration = Duration::from_secs(30);

/// The quality of both maps at one moment.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MapQuality {
    /// Mission time, seconds.
    pub t_s: f64,
    /// `None` without annotation, as for the operator's map.
    pub vehicle: Option<MapInformation>,
    pub operator: Option<MapInformation>,
    /// Share of the vehicle's explored cells on which the maps agree.
    pub agreement: f64,
    /// Seconds for which the operator's label has differed, mean over the vehicle's explored cells.
    pub age_s: f64,
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

/// The samples so far.
#[derive(Debug, Default)]
pub(crate) struct QualitySeries {
    samples: Vec<MapQuality>,
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
}

impl Mission {
    /// The quality of both maps now.
    pub fn quality(&self) -> MapQuality {
        let errors = self.registration_error_m();
        let cells = |metres: f64| metres / self.cell_m();
        MapQuality {
            t_s: self.now().as_secs_f64(),
            vehicle: self.map_information(self.vehicle().map()),
            operator: self.operator_information(),
            agreement: self.meters.labels.agreement(),
            age_s: self.meters.labels.age_s(self.now()),
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
            let sample = self.quality();
            self.meters.quality.samples.push(sample);
        }
    }
}
