//! The operator's data about one vehicle.

use super::exemplar_cache::ExemplarCache;
use super::pauses::Pauses;
use super::settings::SettingsRecord;
use scenecast_core::UsblLine;
use scenecast_protocol::directive::{ExemplarRequests, Fence, Limits, SlotId, Utility};
use scenecast_protocol::exemplar::Exemplar;
use scenecast_protocol::link::Mismatch;
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use std::collections::VecDeque;

/// The last orders to a vehicle, and its last reports.
#[derive(Debug)]
pub struct VehicleRecord {
    pub name: String,
    /// The last utility that was sent.
    pub utility: Utility,
    /// The last fence that was sent.
    pub fence: Option<Fence>,
    /// The last limits that were sent.
    pub limits: Option<Limits>,
    /// The fence that the vehicle has applied, with its version.
    pub fence_in_force: Option<(u16, Fence)>,
    /// The limits that the vehicle has applied, with their version.
    pub limits_in_force: Option<(u16, Limits)>,
    /// The settings that were ordered, and those in force.
    pub settings: SettingsRecord,
    pub exemplars: ExemplarCache,
    /// Reported positions in the map frame: time, metres east, metres north.
    pub track: VecDeque<(Instant, f64, f64)>,
    pub epoch: u8,
    /// The last whole map, where the vehicle sends whole maps.
    pub whole: Option<LabelGrid>,
    /// The number of whole maps that have arrived.
    pub wholes: u64,
    /// The usual length of its silence.
    pub pauses: Pauses,
    /// The last measurement of the surface's modem, and its time.
    pub found: Option<(UsblLine, Instant)>,
    /// The last setting in which the vehicle was found to differ, and when.
    pub mismatch: Option<(Mismatch, Instant)>,
}

impl VehicleRecord {
    /// Maximum number of positions in the track.
    const TRACK: usize = 500;

    pub fn new(name: String) -> Self {
        Self {
            name,
            utility: Utility::default(),
            fence: None,
            limits: None,
            fence_in_force: None,
            limits_in_force: None,
            settings: SettingsRecord::default(),
            exemplars: ExemplarCache::default(),
            track: VecDeque::new(),
            epoch: 0,
            whole: None,
            wholes: 0,
            pauses: Pauses::default(),
            found: None,
            mismatch: None,
        }
    }

    /// Takes a status. A new epoch voids everything that refers to labels.
    pub fn handle_status(&mut self, status: &VehicleStatus, now: Instant) {
        if status.epoch != self.epoch {
            self.epoch = status.epoch;
            self.utility = Utility { epoch: status.epoch, ..Utility::default() };
            self.exemplars = ExemplarCache::default();
        }
        self.track.push_back((now, status.position.x_m, status.position.y_m));
        if self.track.len() > Self::TRACK {
            self.track.pop_front();
        }
    }

    /// The vehicle has applied the version of a slot that was sent last.
    pub fn handle_applied(&mut self, slot: SlotId, version: u16) {
        match slot {
            SlotId::Fence => self.fence_in_force = self.fence.clone().map(|fence| (version, fence)),
            SlotId::Limits => self.limits_in_force = self.limits.map(|limits| (version, limits)),
            _ => {}
        }
    }

    /// Part of an exemplar came in. `head` are its first bytes, once they have arrived.
    pub fn handle_progress(&mut self, head: Option<&[u8]>, held: usize, total: usize, now: Instant) {
        let head = head.and_then(|h| h.first_chunk::<4>()).filter(|h| h[0] == self.epoch);
        head.into_iter().for_each(|head| self.exemplars.handle_progress(*head, (held, total), now));
    }

    /// Takes a complete exemplar. Returns whether the operator has something new to see.
    pub fn handle_exemplar(&mut self, exemplar: &Exemplar, now: Instant) -> bool {
        exemplar.epoch == self.epoch && self.exemplars.handle_exemplar(exemplar, now)
    }

    /// The open requests for exemplars.
    pub fn wanted(&self) -> ExemplarRequests {
        self.exemplars.wanted(self.epoch)
    }
}
