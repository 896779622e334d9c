//! What the operator has and asked for, for one vehicle.

use super::exemplar_cache::ExemplarCache;
use super::pauses::Pauses;
use super::settings::SettingsRecord;
use scenecast_core::UsblLine;
use scenecast_protocol::directive::{ExemplarRequests, Fence, Limits, SlotId, Utility};
use scenecast_protocol::exemplar::Exemplar;
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use std::collections::VecDeque;

/// The operator's papers about one vehicle.
#[derive(Debug)]
pub struct VehicleRecord {
    pub name: String,
    /// The utility that was sent last.
    pub utility: Utility,
    /// The fence that was sent last.
    pub fence: Option<Fence>,
    /// The limits that were sent last.
    pub limits: Option<Limits>,
    /// The fence that it said last to obey, with its version.
    pub fence_in_force: Option<(u16, Fence)>,
    /// The limits that it said last to obey, with their version.
    pub limits_in_force: Option<(u16, Limits)>,
    /// The settings that were asked for, and those in force.
    pub settings: SettingsRecord,
    pub exemplars: ExemplarCache,
    /// Where the vehicle said it was: time, east, north.
    pub track: VecDeque<(Instant, f64, f64)>,
    pub epoch: u8,
    /// The last whole map, where the vehicle sends those.
    pub whole: Option<LabelGrid>,
    /// Whole maps that came in.
    pub wholes: u64,
    /// How long it is usually silent.
    pub pauses: Pauses,
    /// Where the surface's modem found it last, and when it said so.
    pub found: Option<(UsblLine, Instant)>,
}

impl VehicleRecord {
    /// Places of the track that are kept.
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
        }
    }

    /// Takes note of a status; a new epoch voids everything that names labels.
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

    /// The vehicle obeys the version of a slot that was sent last.
    pub fn handle_applied(&mut self, slot: SlotId, version: u16) {
        match slot {
            SlotId::Fence => self.fence_in_force = self.fence.clone().map(|fence| (version, fence)),
            SlotId::Limits => self.limits_in_force = self.limits.map(|limits| (version, limits)),
            _ => {}
        }
    }

    /// Part of an image came in; `head` are its first bytes, once they are held.
    pub fn handle_progress(&mut self, head: Option<&[u8]>, held: usize, total: usize, now: Instant) {
        let head = head.and_then(|h| h.first_chunk::<4>()).filter(|h| h[0] == self.epoch);
        head.into_iter().for_each(|head| self.exemplars.handle_progress(*head, (held, total), now));
    }

    /// An image is complete; says whether there is something new to show.
    pub fn handle_exemplar(&mut self, exemplar: &Exemplar, now: Instant) -> bool {
        exemplar.epoch == self.epoch && self.exemplars.handle_exemplar(exemplar, now)
    }

    /// Images that are asked for and not here.
    pub fn wanted(&self) -> ExemplarRequests {
        self.exemplars.wanted(self.epoch)
    }
}
