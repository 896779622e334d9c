//! The vehicle's role: link, position estimate and steering in one sans-IO whole.

mod course;
mod gallery;
#[cfg(test)]
mod obedience_tests;
mod obey;
mod place;
mod tuning;
mod whole_png;

use super::failsafe::{Failsafe, Habits};
use super::mapper::MapUpdate;
use super::navigator::Navigator;
use super::steering::Steering;
use course::Doing;
use gallery::Gallery;
use scene_model::exemplars::ExemplarPatch as Picture;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{Fix, RefusalReason, Settings, Slot, SlotId, SlotState, Utility};
use scenecast_protocol::link::{LinkStats, SlotInboxState, Transmit, VehicleEvent, VehicleLink, Wakeup};
use scenecast_protocol::map::{LabelGrid, LayerSource};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::PlannedPath;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, VecDeque};
use tuning::Telling;
use whole_png::WholePng;

pub use place::LastPlace;

/// What must survive a restart of the vehicle, so that nothing is applied twice and no label changes its meaning.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Durable {
    pub inbox: SlotInboxState,
    /// Epoch of the label ids in use.
    pub epoch: u8,
    /// Label ids of the epoch that may have been told: 1 to this.
    pub labels: u8,
    /// Random number of the mission, by which its checkpoints are known.
    pub lineage: u64,
    /// Utility in force: epoch, exploration, curiosity, weights.
    pub utility: Option<(u8, i8, i8, BTreeMap<u8, i8>)>,
    /// Whether the vehicle is told to hold.
    pub hold: bool,
    /// Whether it is told to abort.
    pub abort: bool,
    /// Budget in force, bits a second, if somebody has changed it.
    pub budget_bps: Option<u32>,
    /// Least shares in force in percent, if somebody has changed them.
    pub shares: Option<[u8; 5]>,
    /// What left-over bits are spent on, as on the wire, if somebody has changed it.
    pub background: Option<u128>,
    /// Settings in force, as on the wire; empty: all as configured.
    pub settings: Vec<u8>,
    /// Limits in force, as on the wire; empty: none.
    pub limits: Vec<u8>,
    /// Metres and seconds of them that are used up, nearly.
    pub used: (u32, u32),
    /// A breach that the operator has not answered yet: the reason's number on the wire.
    pub breach: u8,
    /// Fence in force, as on the wire; empty: none.
    pub fence: Vec<u8>,
    /// Where it was at its last fix.
    pub place: Option<LastPlace>,
}

/// What the vehicle asks of its host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleOutput {
    /// Make [`Vehicle::durable`] durable, then call [`Vehicle::handle_persisted`]. If that fails, do nothing that is asked
    /// for later, and send nothing.
    Persist,
    /// Go there, metres east and north in the map's frame.
    Waypoint(MapPoint),
    Hold,
    Surface,
    /// Have the scene model follow these settings; what they do not name is as configured. A run begins with
    /// [`Vehicle::settings`].
    Tune(Settings),
    /// A slot was decided about.
    Applied(AppliedSlot),
    /// A fix in the world that was used, and when it was taken: an autopilot may want it too.
    Fixed(Fix, Instant),
}

/// A decision about a slot.
#[derive(Debug, Clone, PartialEq)]
pub struct AppliedSlot {
    pub id: SlotId,
    pub version: u16,
    pub state: SlotState,
    pub at: Instant,
}

pub struct Vehicle {
    link: VehicleLink,
    navigator: Navigator,
    steering: Steering,
    durable: Durable,
    utility: Option<Utility>,
    gallery: Gallery,
    labels: u8,
    explored: u32,
    failsafe: Failsafe,
    course: Doing,
    waypoint: Option<MapPoint>,
    /// What is planned after the waypoint.
    path: PlannedPath,
    /// An order was applied that may change the way; the surface is to hear what comes of it.
    has_new_orders: bool,
    done: bool,
    outputs: VecDeque<VehicleOutput>,
    fixes_applied: u64,
    autopilot_silent: bool,
    telling: Telling,
    /// Instead of the link's map, for comparison.
    whole_png: Option<WholePng>,
}

impl Vehicle {
    /// A vehicle at its start; `durable` is what survived the last run, with the epoch this run begins.
    pub fn new(
        link: VehicleLink,
        navigator: Navigator,
        steering: Steering,
        habits: Habits,
        durable: Durable,
        now: Instant,
    ) -> Self {
        let utility = durable.utility.clone().map(|(epoch, exploration, curiosity, weights)| Utility {
            epoch,
            exploration,
            curiosity,
            weights,
        });
        let mut vehicle = Self {
            link,
            navigator,
            steering,
            // Weights speak of labels of their epoch; a new epoch has none yet.
            utility: utility.filter(|u| u.epoch == durable.epoch),
            telling: Telling::restore(&durable.settings),
            durable,
            gallery: Gallery::default(),
            labels: 0,
            explored: 0,
            failsafe: Failsafe::new(habits, now),
            course: Doing::default(),
            waypoint: None,
            path: PlannedPath::default(),
            has_new_orders: false,
            done: false,
            outputs: VecDeque::new(),
            fixes_applied: 0,
            autopilot_silent: false,
            whole_png: None,
        };
        if vehicle.utility.is_none() && vehicle.durable.utility.take().is_some() {
            let other = SlotState::Refused(RefusalReason::OtherEpoch);
            vehicle.link.decide(SlotId::Utility, other, now);
            vehicle.durable.inbox = vehicle.link.persistent_state().clone();
            vehicle.outputs.push_back(VehicleOutput::Persist);
        }
        vehicle.follow_telling();
        vehicle.follow_utility();
        vehicle.restore_course();
        vehicle
    }

    /// Sends the whole map as a PNG whenever it has changed instead of what changed, for comparison.
    pub fn send_whole_png(&mut self) {
        self.whole_png = Some(WholePng::default());
    }

    /// What must survive a restart.
    pub fn durable(&self) -> &Durable {
        &self.durable
    }

    /// The map as the vehicle tells it.
    pub fn map(&self) -> &LabelGrid {
        self.whole_png.as_ref().map_or_else(|| self.link.map(), WholePng::map)
    }

    /// The layers of the map that are told.
    pub fn layers(&self) -> impl Iterator<Item = &LayerSource> {
        self.link.layers()
    }

    /// Versions of that map so far.
    pub fn map_version(&self) -> u64 {
        self.whole_png.as_ref().map_or_else(|| self.link.map_version(), WholePng::version)
    }

    /// Changes of labels that never had to be sent, for they did not last.
    pub fn flips_suppressed(&self) -> u64 {
        self.link.source().flips_suppressed()
    }

    /// Whether the surface is known to have everything.
    pub fn is_converged(&self) -> bool {
        self.link.is_converged() && self.whole_png.as_ref().is_none_or(WholePng::is_converged)
    }

    pub fn stats(&self) -> &LinkStats {
        self.link.stats()
    }

    /// Bits a second that the link may use.
    pub fn budget_bps(&self) -> u32 {
        self.link.budget_bps()
    }

    /// An earlier run may have sent until `now`: the budget counts as spent.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.link.assume_budget_spent(now);
    }

    pub fn utility(&self) -> Option<&Utility> {
        self.utility.as_ref()
    }

    /// The next thing asked of the host.
    pub fn poll_output(&mut self) -> Option<VehicleOutput> {
        self.outputs.pop_front()
    }

    /// The vehicle's own sensors say that it moved.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        self.navigator.handle_odometry(dx_m, dy_m, heading_rad, depth_m, now);
        self.failsafe.handle_way(dx_m.hypot(dy_m));
    }

    /// The scene model has a new map.
    pub fn handle_map(&mut self, update: &MapUpdate, now: Instant) {
        if update.epoch != self.durable.epoch {
            self.begin_epoch(update.epoch, now);
        }
        if update.labels > self.durable.labels {
            // Before the surface can hear of them: after a restart they keep their meaning or have none.
            self.durable.labels = update.labels;
            self.outputs.push_back(VehicleOutput::Persist);
        }
        self.labels = update.labels;
        self.explored = update.cells.len() as u32;
        self.telling.see(update);
        match &mut self.whole_png {
            Some(whole) => whole.set(update.cells.iter().copied()),
            None => self.tell(now),
        }
        let at = self.navigator.position();
        self.steering.handle_view(at.xy());
        update.perplexity.iter().for_each(|&(cell, p)| self.steering.handle_perplexity(cell, p));
    }

    /// Label ids start afresh: the surface learns it by a new run, before any of the new ids.
    fn begin_epoch(&mut self, epoch: u8, now: Instant) {
        self.link.begin_epoch(now);
        self.telling.forget();
        self.whole_png = self.whole_png.take().map(|_| WholePng::default());
        (self.durable.epoch, self.durable.labels) = (epoch, 0);
        self.utility = None;
        self.gallery = Gallery::default();
        self.follow_utility();
        self.outputs.push_back(VehicleOutput::Persist);
    }

    /// The images of each label that represent it best by now, the best first.
    pub fn handle_exemplars(&mut self, pictures: BTreeMap<u8, Vec<Picture>>) {
        self.gallery.set_pictures(pictures);
        self.tend_gallery();
    }

    /// The best patches of each label, as [`Self::handle_exemplars`] got them.
    pub fn exemplars(&self) -> &BTreeMap<u8, Vec<Picture>> {
        self.gallery.pictures()
    }

    fn tend_gallery(&mut self) {
        let Self { utility, gallery, link, durable, .. } = self;
        let weight = |label| utility.as_ref().map_or(0.0, |u| u.weight(label));
        gallery.tend(durable.epoch, weight, link);
    }

    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        self.link.handle_frame(bytes, now);
        if let Some(at) = self.link.last_received() {
            self.failsafe.handle_surface_heard(at);
        }
        while let Some(event) = self.link.poll_event() {
            match event {
                VehicleEvent::Slot { id, version, content } => self.handle_slot(id, version, content, now),
                VehicleEvent::ObjectDelivered(id) => {
                    self.gallery.handle_delivered(id);
                    self.tend_gallery();
                    if let Some(whole) = &mut self.whole_png {
                        whole.handle_delivered(id);
                    }
                }
                VehicleEvent::SurfaceRestarted => self.handle_surface_restart(),
            }
        }
    }

    /// What was on its way to the surface is lost.
    fn handle_surface_restart(&mut self) {
        self.gallery.handle_restart(&mut self.link);
        self.link.cancel_objects();
        if let Some(whole) = &mut self.whole_png {
            whole.send_again();
        }
        self.tend_gallery();
    }

    fn handle_slot(&mut self, id: SlotId, version: u16, content: Option<Slot>, now: Instant) {
        // Before everything that the host does because of the slot, or a power cut would have it done twice.
        self.outputs.push_back(VehicleOutput::Persist);
        let state = match content.ok_or(RefusalReason::Malformed).and_then(|slot| self.apply(slot, now)) {
            Ok(()) => SlotState::Applied,
            Err(reason) => SlotState::Refused(reason),
        };
        self.has_new_orders |= id.steers() && state == SlotState::Applied;
        self.link.decide(id, state, now);
        self.durable.inbox = self.link.persistent_state().clone();
        self.outputs.push_back(VehicleOutput::Applied(AppliedSlot { id, version, state, at: now }));
    }

    /// The host has made [`Self::durable`] durable.
    pub fn handle_persisted(&mut self) {
        self.link.handle_persisted();
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        self.link.handle_transmit_outcome(now);
    }

    /// The modem asks for so many frames.
    pub fn handle_poll(&mut self, frames: u32) {
        self.link.handle_poll(frames);
    }

    /// The modem itself put so many bits on air.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.link.handle_repeated(bits, now);
    }

    /// The next frame to put on air.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        if self.link.wants_status(now) {
            let status = self.status(now);
            self.link.set_status(status);
        }
        if let Some(whole) = &mut self.whole_png {
            whole.push(&mut self.link);
        }
        self.link.poll_transmit(now)
    }

    /// When to ask for the next frame.
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        self.link.poll_timeout()
    }
}
