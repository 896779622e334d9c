//! What the operator has and asked for, for one vehicle.

use super::pauses::Pauses;
use crate::auv::Exemplar;
use crate::modem::UsblLine;
use scenecast_protocol::directive::{Fence, Limits, Requests, Settings, SlotId, Utility};
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;
use std::collections::{BTreeMap, VecDeque};

/// How far a representative image has come.
#[derive(Debug, Clone, PartialEq)]
pub enum ExemplarState {
    /// Asked for; how far the request is, the directive's slot knows.
    Asked,
    /// Bytes held of bytes in all.
    Coming(usize, usize),
    /// Here: the WebP file.
    Here(Vec<u8>),
}

/// An image of a label that was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ExemplarDesk {
    /// Serial number of the request.
    pub serial: u8,
    /// How far it has come.
    pub state: ExemplarState,
    /// When that last changed.
    pub changed: Instant,
}

/// The operator's papers about one vehicle.
#[derive(Debug)]
pub struct Desk {
    /// Name for people.
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
    /// The settings that were sent last.
    pub settings: Settings,
    /// Images by label.
    pub exemplars: BTreeMap<u8, ExemplarDesk>,
    /// Where the vehicle said it was: time, east, north.
    pub track: VecDeque<(Instant, f64, f64)>,
    /// Epoch of the labels.
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

impl Desk {
    /// Places of the track that are kept.
    const TRACK: usize = 500;

    /// An empty desk.
    pub fn new(name: String) -> Self {
        Self {
            name,
            utility: Utility::default(),
            fence: None,
            limits: None,
            fence_in_force: None,
            limits_in_force: None,
            settings: Settings::default(),
            exemplars: BTreeMap::new(),
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
            self.exemplars.clear();
        }
        self.track.push_back((now, status.x_m, status.y_m));
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

    /// Asks for an image of a label, a further one if there is one already; returns all that is still wanted.
    pub fn request(&mut self, label: u8, now: Instant) -> Requests {
        let serial = self.exemplars.get(&label).map_or(1, |e| e.serial.wrapping_add(1));
        self.exemplars.insert(label, ExemplarDesk { serial, state: ExemplarState::Asked, changed: now });
        self.wanted()
    }

    /// Requests that are not met yet.
    pub fn wanted(&self) -> Requests {
        let open = self.exemplars.iter().filter(|(_, e)| !matches!(e.state, ExemplarState::Here(_)));
        Requests { epoch: self.epoch, wanted: open.map(|(&label, e)| (label, e.serial)).collect() }
    }

    /// Part of an image came in; `head` are its first bytes, once they are held.
    pub fn handle_progress(&mut self, head: Option<&[u8]>, held: usize, total: usize, now: Instant) {
        let Some(&[epoch, label, serial]) = head.and_then(|h| h.first_chunk::<3>()) else { return };
        let Some(desk) = self.exemplars.get_mut(&label) else { return };
        if epoch == self.epoch && serial == desk.serial && !matches!(desk.state, ExemplarState::Here(_)) {
            (desk.state, desk.changed) = (ExemplarState::Coming(held, total), now);
        }
    }

    /// An image is complete; says whether it was asked for.
    pub fn handle_exemplar(&mut self, exemplar: Exemplar, now: Instant) -> bool {
        let wanted = exemplar.epoch == self.epoch;
        let Some(desk) = self.exemplars.get_mut(&exemplar.label).filter(|_| wanted) else { return false };
        if desk.serial != exemplar.serial {
            return false;
        }
        (desk.state, desk.changed) = (ExemplarState::Here(exemplar.webp), now);
        true
    }
}
