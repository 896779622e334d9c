//! Read access to the vehicle: for its host, for reports, and for the status that it sends.

use super::{Durable, Evidence, Vehicle};
use crate::{Navigator, SharedExemplars};
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{Settings, Utility};
use scenecast_protocol::link::LinkStats;
use scenecast_protocol::map::{Cell, LabelGrid, LayerSource};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{EquipmentFaults, ModeReason, PlannedPath, VehicleMode, VehicleStatus};

/// The state of the vehicle's equipment, as the next status reports it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct EquipmentState {
    pub(super) is_autopilot_silent: bool,
    pub(super) faults: EquipmentFaults,
}

impl Vehicle {
    /// The state that the host stores at [`super::VehicleOutput::Persist`].
    pub fn durable(&self) -> &Durable {
        &self.durable
    }

    /// Whether the disk has refused the present state, and how often it has refused one in this run.
    pub fn disk_refusals(&self) -> (bool, u64) {
        (self.storing.is_refused(), self.storing.refusals())
    }

    /// The map as it is sent to the surface.
    pub fn map(&self) -> &LabelGrid {
        self.link.map()
    }

    /// The number of versions of [`Self::map`] so far.
    pub fn map_version(&self) -> u64 {
        self.link.map_version()
    }

    /// The layers that are selected to be sent.
    pub fn layers(&self) -> impl Iterator<Item = &LayerSource> {
        self.link.layers()
    }

    /// Why a cell of [`Self::cells`] has its label, if a camera frame of this run gave it.
    pub fn evidence(&self, cell: Cell) -> Option<&Evidence> {
        self.publisher.evidence(cell)
    }

    /// The map of the scene model, of which [`Self::map`] may be a part.
    pub fn cells(&self) -> impl Iterator<Item = (Cell, u8)> + '_ {
        self.publisher.seen().0.iter()
    }

    /// Label changes that were never sent, because they did not last for the debounce time.
    pub fn flips_suppressed(&self) -> u64 {
        self.link.source().flips_suppressed()
    }

    /// Whether the surface has acknowledged everything that there is to send.
    pub fn is_converged(&self) -> bool {
        self.link.is_converged()
    }

    pub fn stats(&self) -> &LinkStats {
        self.link.stats()
    }

    /// The budget in force, bit/s.
    pub fn budget_bps(&self) -> u32 {
        self.link.budget_bps()
    }

    pub fn utility(&self) -> Option<&Utility> {
        self.weights.ordered()
    }

    /// The settings in force; those that have no value are as configured.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The best patches of each label, as [`Self::handle_exemplars`] got them.
    pub fn exemplars(&self) -> &SharedExemplars {
        self.gallery.exemplars()
    }

    pub fn navigator(&self) -> &Navigator {
        &self.navigator
    }

    /// The number of fixes that corrected the position estimate.
    pub fn fixes_applied(&self) -> u64 {
        self.navigator.fixes_used()
    }

    /// The current goal in the map frame.
    pub fn waypoint(&self) -> Option<MapPoint> {
        self.guidance.waypoint()
    }

    /// The plan after the waypoint, in the map frame.
    pub fn path(&self) -> &PlannedPath {
        self.guidance.path()
    }

    pub fn mode(&self) -> (VehicleMode, ModeReason) {
        self.guidance.mode()
    }

    /// The status as it is sent to the surface.
    pub fn status(&self, now: Instant) -> VehicleStatus {
        let (mode, reason) = self.guidance.mode();
        VehicleStatus {
            mode,
            reason,
            autopilot_silent: self.equipment.is_autopilot_silent,
            position: self.navigator.position(),
            depth_m: self.navigator.depth_m(),
            heading_deg: self.navigator.heading_rad().to_degrees().rem_euclid(360.0),
            sigma_m: self.navigator.sigma_m(),
            fix_age_s: self.navigator.last_fix().map(|at| now.since(at).as_secs_f64()),
            waypoint: self.guidance.waypoint(),
            path: self.guidance.path().clone(),
            intent: self.guidance.intent(),
            registration: self.registration.report(),
            faults: self.equipment.faults,
            trail: self.track.corners(self.navigator.position(), now),
            epoch: self.storing.epoch(),
            labels: self.publisher.labels(),
            explored_cells: self.publisher.explored(),
            placement: self.navigator.placement(),
            disk: self.storing.disk_report(),
            ..VehicleStatus::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::VehicleDisk;
    use scenecast_config::Config;
    use scenecast_core::Area;
    use scenecast_protocol::wire::DiskReport;

    #[test]
    fn a_vehicle_without_files_reports_no_disk_until_one_refuses() {
        let (config, now) = (Config::default(), Instant::ZERO);
        let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
        let area = Area { west: 0.0, south: 0.0, east: 20.0, north: 20.0 };
        let mut vehicle = crate::assemble(&config, None, profile, area, Durable::default(), 1, now).unwrap();
        assert_eq!(vehicle.status(now).disk, None);
        vehicle.handle_persist_failed(now);
        let refused = DiskReport { journal_refused: true, ..DiskReport::default() };
        assert_eq!(vehicle.status(now).disk, Some(refused));
        vehicle.handle_persisted();
        assert_eq!(vehicle.status(now).disk, Some(DiskReport::default()), "it has recovered");
        vehicle.set_disk(VehicleDisk { free_bytes: Some(7), is_checkpoint_refused: true });
        let full = DiskReport { journal_refused: false, checkpoint_refused: true, free_bytes: Some(7) };
        assert_eq!(vehicle.status(now).disk, Some(full));
    }
}
