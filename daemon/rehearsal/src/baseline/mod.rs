//! The baseline: the whole PNG is sent again after each change of the map.

mod whole;

pub use whole::{WholeReplica, WholeSource};

use crate::fidelity::Stream;
use crate::link_rig::LinkRig;
use crate::meter::Meter;
use crate::mission::{MapQuality, Mission};
use crate::uplink::Repeats;
use crate::virtual_time::VirtualTime;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_protocol::map::{LabelGrid, StateReplica};

/// Bare links beside a mission that carry its map as whole PNGs.
///
/// Frames, acknowledgements, repair of lost parts, turns, budget and shares are those of the mission, and the channel has the
/// same losses. Orders, fixes, images and layers are not sent.
pub(crate) struct Baseline {
    rig: LinkRig<WholeSource, WholeReplica>,
    /// The version of the vehicle's map that the source has.
    version: u64,
    labels: Meter,
    series: Vec<MapQuality>,
}

impl Baseline {
    /// Links for a mission with this configuration and seed.
    pub(crate) fn new(config: &Config, seed: u64) -> Result<Self, UserError> {
        let rig = LinkRig::new(config, WholeSource::default(), seed)?;
        Ok(Self { rig, version: 0, labels: Meter::default(), series: Vec::new() })
    }

    /// Follows the mission to its present time, and takes its map.
    pub(crate) fn follow(&mut self, mission: &Mission) {
        let (vehicle, now) = (mission.vehicle(), mission.now());
        self.rig.run_until(now, |_| false);
        if vehicle.map_version() != self.version {
            self.version = vehicle.map_version();
            self.rig.vehicle.end_mut().source_mut().replace(vehicle.map().clone());
        }
        self.rig.status = vehicle.status(now);
        let operator = self.rig.view().map(|view| view.replica());
        let versions = (self.version, operator.map_or(0, WholeReplica::version));
        let empty = LabelGrid::default();
        self.labels.look(vehicle.map(), operator.map_or(&empty, WholeReplica::shown), versions, now);
        if let Some(sample) = mission.quality_series().get(self.series.len()) {
            self.series.push(self.quality(mission, sample));
        }
    }

    /// A sample of the mission, with the operator's map of these links.
    fn quality(&self, mission: &Mission, sample: &MapQuality) -> MapQuality {
        let view = self.rig.view();
        let map = view.map(|view| view.replica().shown().clone()).unwrap_or_default();
        let report = view.and_then(|view| view.status()).map(|(status, _)| status);
        MapQuality {
            operator: mission.shown_information(&map, report),
            agreement: self.labels.agreement(),
            age_s: self.labels.age_s(mission.now()),
            ..*sample
        }
    }

    /// The measurements after the survey.
    pub(crate) fn stream(&self, mission: &Mission) -> Stream<'_> {
        let audit = self.rig.vehicle.audit();
        Stream {
            name: "whole-png",
            labels: &self.labels,
            series: &self.series,
            end: self.quality(mission, &mission.quality()),
            stats: self.rig.vehicle.end().stats(),
            sent_bits: audit.total_bits(),
            bits_on_air: self.rig.bits_on_air()[0],
            frames: self.rig.frames(),
            repeats: Repeats::of(self.rig.view(), self.rig.frames()),
        }
    }
}
