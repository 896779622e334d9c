//! The vehicle's role: link, position estimate, guidance and map in one state machine without IO.
//!
//! [`Vehicle`] joins parts that own their state: the navigator estimates the position, the guidance chooses waypoints, the
//! publisher selects the parts of the map that are sent, and the gallery sends exemplars.

mod bands;
mod durable;
mod evidence;
mod floor;
mod gallery;
mod guidance;
mod publisher;
mod report;
mod slots;
mod storing;

pub use durable::{Durable, KeptBudget, KeptGoals, KeptKeys, KeptLimits, KeptUtility, LostOrders};
pub use evidence::{Evidence, MappedFrame};
pub use storing::VehicleDisk;

use super::changes::{MapChanges, SharedExemplars};
use super::failsafe::FailsafePolicy;
use super::mosaic::cells_of_tile;
use super::navigator::Navigator;
use super::registration::{RegisteredFrame, RegistrationMonitor};
use super::steering::Steering;
use super::track::RecentTrack;
use floor::FloorPictures;
use gallery::Gallery;
use guidance::{Guidance, Situation};
use publisher::MapPublisher;
pub use publisher::MapSelection;
use report::EquipmentState;
use scenecast_protocol::coordinates::MapPoint;
use scenecast_protocol::directive::{Fix, RefusalReason, Settings, SlotId, SlotState};
use scenecast_protocol::link::{Transmit, VehicleEvent, VehicleLink, Wakeup};
use scenecast_protocol::map::ClassEntry;
use scenecast_protocol::map_codec::Codec;
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{EquipmentFaults, UtcHours};
use slots::Weights;
use std::collections::VecDeque;
use std::time::Duration;
use storing::Storing;

/// Metres and seconds of use of the limits after which they are stored again.
const RECORD_INTERVAL: (f64, f64) = (50.0, 60.0);

/// A request of the vehicle to its host.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleOutput {
    /// Store [`Vehicle::durable`], then call [`Vehicle::handle_persisted`]; if that fails, call
    /// [`Vehicle::handle_persist_failed`]. Until then act on no later request and transmit no frame.
    Persist,
    /// Go to this point of the map frame.
    Waypoint(MapPoint),
    Hold,
    Surface,
    /// Have the scene model use these settings; those that have no value are as configured.
    /// A run begins with [`Vehicle::settings`].
    Tune(Settings),
    /// The vehicle has decided about a slot.
    Applied(AppliedSlot),
    /// A fix was used, with the time at which it was measured. An autopilot may need it too.
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
    registration: RegistrationMonitor,
    track: RecentTrack,
    guidance: Guidance,
    publisher: MapPublisher,
    gallery: Gallery,
    floor: FloorPictures,
    durable: Durable,
    storing: Storing,
    weights: Weights,
    settings: Settings,
    /// Whether an order was applied that may change the path, so that the surface needs a new pose.
    has_new_orders: bool,
    outputs: VecDeque<VehicleOutput>,
    equipment: EquipmentState,
}

impl Vehicle {
    /// A vehicle at its start. `durable` is the state of the last run, with the epoch of this run.
    pub fn new(
        link: VehicleLink,
        navigator: Navigator,
        steering: Steering,
        policy: FailsafePolicy,
        durable: Durable,
        now: Instant,
    ) -> Self {
        let settings = Settings::from_bytes(&durable.settings).unwrap_or_default();
        let mut vehicle = Self {
            link,
            navigator,
            registration: RegistrationMonitor::default(),
            track: RecentTrack::default(),
            guidance: Guidance::new(steering, policy, &durable, &settings, now),
            publisher: MapPublisher::default(),
            gallery: Gallery::default(),
            floor: FloorPictures::default(),
            // The weights are those of labels of their epoch; a new epoch has no labels yet.
            weights: Weights::new(
                durable.utility.order().filter(|u| u.epoch == durable.epoch),
                durable.utility.weighed,
            ),
            storing: Storing::new(durable.epoch, durable.labels),
            durable,
            settings,
            has_new_orders: false,
            outputs: VecDeque::new(),
            equipment: EquipmentState::default(),
        };
        if vehicle.weights.ordered().is_none() && vehicle.durable.utility.order.take().is_some() {
            let other = SlotState::Refused(RefusalReason::OtherEpoch);
            vehicle.link.decide(SlotId::Utility, other, now);
            vehicle.durable.inbox = vehicle.link.persistent_state().clone();
            vehicle.outputs.push_back(VehicleOutput::Persist);
        }
        vehicle.publisher.set_settings(&vehicle.settings);
        vehicle.publisher.select(&mut vehicle.link);
        vehicle.follow_utility();
        vehicle.report_in_force(now);
        vehicle
    }

    /// Sets the part of the map that is sent unless the operator orders another.
    pub fn configure_map(&mut self, selection: MapSelection) {
        self.publisher.configure(selection);
        self.publisher.select(&mut self.link);
    }

    /// Sets the codec of the layers of bands.
    pub fn set_codec(&mut self, codec: Codec) {
        self.publisher.set_codec(codec);
    }

    /// Sets the clock of this computer, with which that of the surface is compared.
    pub fn set_clock(&mut self, clock: UtcHours) {
        self.link.set_clock(clock);
    }

    /// Counts the whole budget window as spent, because an earlier run may have transmitted until `now`.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.link.assume_budget_spent(now);
    }

    /// The disk has refused the state with which the run begins. Until it takes one, no map is sent, because the next
    /// run could give its labels other meanings.
    pub fn assume_start_refused(&mut self, now: Instant) {
        self.storing.handle_refused_start(now);
    }

    /// Sets whether the autopilot does not answer; the next status reports it.
    pub fn set_autopilot_silent(&mut self, is_silent: bool) {
        self.equipment.is_autopilot_silent = is_silent;
    }

    /// Sets the faults of the equipment; the next status reports them.
    pub fn set_faults(&mut self, faults: EquipmentFaults) {
        self.equipment.faults = faults;
    }

    /// Sets the state of the disk; the next status reports it.
    pub fn set_disk(&mut self, disk: VehicleDisk) {
        self.storing.set_disk(disk);
    }

    /// The next request to the host.
    pub fn poll_output(&mut self) -> Option<VehicleOutput> {
        self.outputs.pop_front()
    }

    /// What one pass of the survey takes within the fence in force: metres, and the time at survey speed.
    pub fn pass(&self) -> (f64, Duration) {
        let metres = self.guidance.steering().pass_m();
        (metres, Duration::try_from_secs_f64(metres / self.guidance.speed_m_s()).unwrap_or(Duration::MAX))
    }

    /// The vehicle's own sensors measured a displacement since the last call: metres east and north.
    pub fn handle_odometry(&mut self, dx_m: f64, dy_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        self.navigator.handle_odometry(dx_m, dy_m, heading_rad, depth_m, now);
        self.track.handle_place(self.navigator.position(), now);
        self.guidance.handle_travel(dx_m.hypot(dy_m));
    }

    /// Sets the dead-reckoned pose from another source, such as a recorded mission.
    pub fn set_pose(&mut self, x_m: f64, y_m: f64, heading_rad: f64, depth_m: f64, now: Instant) {
        let before = self.navigator.position();
        self.navigator.set_pose(x_m, y_m, heading_rad, depth_m, now);
        self.track.handle_place(self.navigator.position(), now);
        self.guidance.handle_travel(before.distance_m(self.navigator.position()));
    }

    /// The mapper has placed a camera frame on the map.
    pub fn handle_registration(&mut self, frame: &RegisteredFrame, now: Instant) {
        let placed = MapPoint { x_m: frame.pose.x, y_m: frame.pose.y };
        self.navigator.handle_registration(frame.dead_reckoned, placed, frame.is_seen(), now);
        self.registration.handle_frame(frame);
        self.track.handle_place(self.navigator.position(), now);
    }

    /// No sensor measured the vehicle's motion for `time`. The distance that it could have gone adds to the position's
    /// uncertainty and counts against the limits.
    pub fn handle_unmeasured(&mut self, time: Duration) {
        let metres = time.as_secs_f64() * self.guidance.speed_m_s();
        self.navigator.handle_unmeasured(metres);
        self.guidance.handle_travel(metres);
    }

    /// A producer has changed the map. New labels are stored before any of them is sent, so that a restart cannot give one
    /// another meaning. Returns the label whose name is refused, because it has another one already.
    pub fn handle_changes(&mut self, changes: &MapChanges, now: Instant) -> Option<u8> {
        self.floor.add(&changes.floor, &mut self.link);
        let is_more = changes.labels.as_ref().is_some_and(|labels| self.durable.claim(labels));
        if !self.storing.holds_changes(changes, now) {
            self.publish(changes, now);
        }
        // A refused state is given to the disk again at its time, not with each frame of the camera.
        if is_more || self.is_waiting_for_labels() && !self.storing.is_refused() {
            self.outputs.push_back(VehicleOutput::Persist);
        }
        let mut refused = changes.classes.iter().filter(|entry| !self.link.add_class(entry)).map(ClassEntry::label);
        refused.next()
    }

    /// Whether labels wait for the disk.
    fn is_waiting_for_labels(&self) -> bool {
        self.storing.has_next_map() || self.publisher.is_waiting()
    }

    fn publish(&mut self, changes: &MapChanges, now: Instant) {
        self.publisher.handle_changes(changes, self.storing.labels(), &mut self.link, now);
        let Some(labels) = &changes.labels else { return };
        if labels.tree.as_ref().is_some_and(|tree| self.weights.handle_tree(tree, labels.highest)) {
            self.guidance.replan();
            self.follow_utility();
        }
        self.guidance.handle_view(self.navigator.position().xy(), &changes.perplexity);
    }

    /// Labels are numbered again from 1. The surface learns it by a new run of the link, before any of the new labels.
    fn begin_epoch(&mut self, now: Instant) {
        self.link.begin_epoch(now);
        self.publisher.begin_epoch(&mut self.link, now);
        self.weights = Weights::default();
        self.gallery = Gallery::default();
        self.floor.begin_epoch(&mut self.link);
        self.follow_utility();
        self.report_in_force(now);
    }

    /// Takes the best exemplars of each label, the best first.
    pub fn handle_exemplars(&mut self, exemplars: SharedExemplars, now: Instant) {
        if self.is_waiting_for_labels() {
            return self.storing.hold_exemplars(exemplars, now);
        }
        self.gallery.set_exemplars(exemplars);
        self.serve_exemplars(now);
    }

    fn serve_exemplars(&mut self, now: Instant) {
        let Self { weights, gallery, floor, link, storing, publisher, navigator, guidance, .. } = self;
        gallery.set_frames(publisher.frames());
        gallery.serve(storing.epoch(), |label| weights.weight(label), link, now);
        let map = publisher.seen().0;
        let weight = |at, (x_m, y_m): (f64, f64)| {
            let place = navigator.to_world(MapPoint { x_m, y_m });
            let of_place = guidance.steering().weight_of_place((place.east_m, place.north_m));
            cells_of_tile(at).map(|cell| weights.weight(map.get(cell)) + of_place).sum()
        };
        floor.serve(storing.epoch(), weight, &publisher.frames(), link, now);
    }

    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        self.link.handle_frame(bytes, now);
        if let Some(at) = self.link.last_received() {
            self.guidance.handle_received(at);
        }
        while let Some(event) = self.link.poll_event() {
            match event {
                VehicleEvent::Slot { id, version, content } => self.handle_slot(id, version, content, now),
                VehicleEvent::ObjectDelivered(id) => {
                    self.gallery.handle_delivered(id);
                    self.floor.handle_delivered(id);
                    self.serve_exemplars(now);
                }
                VehicleEvent::SurfaceMet => self.handle_meeting(),
                VehicleEvent::SurfaceRestarted => self.handle_surface_restart(now),
                VehicleEvent::NextKey(key) => {
                    tracing::info!(
                        "the surface gives the next key, of the mission key with fingerprint {:08x}",
                        key.mission
                    );
                    self.durable.keys.keep(&key);
                    self.outputs.push_back(VehicleOutput::Persist);
                }
                VehicleEvent::KeyChanged => {
                    tracing::info!("the surface uses the next key: the one before opens nothing more");
                    self.durable.keys.change();
                    self.outputs.push_back(VehicleOutput::Persist);
                }
                VehicleEvent::Mismatch(mismatch) => {
                    tracing::warn!("the settings of the ends do not fit: {mismatch}");
                }
                VehicleEvent::Oversized(fault) => tracing::error!("{fault}: it is left out of this frame"),
            }
        }
    }

    /// A surface is heard for the first time. If orders were lost, those in its present series may be among them.
    fn handle_meeting(&mut self) {
        if self.durable.lost == LostOrders::Present {
            self.durable.lost.may_contain(self.link.persistent_state().series());
        }
        self.durable.inbox = self.storing.with_decisions(self.link.persistent_state().clone());
        self.outputs.push_back(VehicleOutput::Persist);
    }

    /// Everything that was in flight is lost.
    fn handle_surface_restart(&mut self, now: Instant) {
        self.gallery.handle_restart(&mut self.link);
        self.floor.handle_restart(&mut self.link);
        self.link.cancel_objects();
        self.serve_exemplars(now);
    }

    /// Chooses a waypoint if there is none or the last one is reached, or carries out the reaction of the failsafe.
    pub fn steer(&mut self, now: Instant) {
        if self.storing.takes_retry(now) {
            self.outputs.push_back(VehicleOutput::Persist);
        }
        if !self.guidance.handle_time(now) {
            return;
        }
        let (navigator, map, utility) = (&self.navigator, self.publisher.seen(), self.weights.in_use());
        let request = self.guidance.steer(&Situation { navigator, map, utility });
        self.outputs.extend(request);
        self.follow_destination(now);
        if std::mem::take(&mut self.has_new_orders) {
            self.link.owe_pose(now);
        }
        self.record();
    }

    /// A destination is in force no longer once it is reached.
    fn follow_destination(&mut self, now: Instant) {
        if self.durable.goals.destination.is_some() && !self.guidance.has_destination() {
            self.durable.goals.destination = None;
            self.report_in_force(now);
            self.has_new_orders = true;
            self.outputs.push_back(VehicleOutput::Persist);
        }
    }

    /// Stores the use of the limits and the breach when they have changed enough.
    fn record(&mut self) {
        let (noted_m, noted_s) = self.durable.limits.used();
        let (used_m, used_s) = self.guidance.used();
        let is_far = used_m - noted_m > RECORD_INTERVAL.0 || used_s - noted_s > RECORD_INTERVAL.1;
        let breach = self.guidance.breach();
        if (is_far && self.guidance.is_limited()) || breach != self.durable.limits.breach {
            self.durable.limits.used = (used_m as u32, used_s as u32);
            self.durable.limits.breach = breach;
            self.outputs.push_back(VehicleOutput::Persist);
        }
    }

    /// Ends the survey: the vehicle holds, and the link continues.
    pub fn finish_survey(&mut self) {
        let request = self.guidance.finish();
        self.outputs.push_back(request);
    }

    /// The host has stored [`Self::durable`]. Orders that waited for it are applied, and stored in their turn.
    pub fn handle_persisted(&mut self) {
        let (decisions, next_map) = self.storing.handle_stored(self.durable.epoch, self.durable.labels);
        if let Some((map, at)) = next_map {
            self.begin_epoch(at);
            self.publish(&map, at);
        }
        self.publisher.handle_stored(self.storing.labels(), &mut self.link);
        if let Some((exemplars, at)) = self.storing.take_exemplars() {
            self.handle_exemplars(exemplars, at);
        }
        self.report_decisions(decisions);
        if let Some(next) = self.durable.keys.next() {
            self.link.keep_next_key(&next);
        }
        if !self.decide_waiting() {
            self.link.handle_persisted();
        }
    }

    /// The host could not store [`Self::durable`]. Holds and aborts are obeyed from memory, other orders that waited are
    /// refused, and the state is stored again later.
    pub fn handle_persist_failed(&mut self, now: Instant) {
        self.storing.handle_refusal(now);
        self.refuse_waiting();
        self.link.handle_persisted();
    }

    /// The last frame of [`Self::poll_transmit`] has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        self.link.handle_transmit_outcome(now);
    }

    /// The modem requests a number of frames.
    pub fn handle_poll(&mut self, frames: u32) {
        self.link.handle_poll(frames);
    }

    /// The modem itself transmitted a number of bits, which count against the budget.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.link.handle_repeated(bits, now);
    }

    /// The next frame to transmit.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        if self.link.wants_status(now) {
            let status = self.status(now);
            self.link.set_status(status);
        }
        self.publisher.push_tree(&mut self.link, now);
        self.link.poll_transmit(now)
    }

    /// When to call [`Self::poll_transmit`] again, and why.
    pub fn poll_timeout(&self) -> Option<(Instant, Wakeup)> {
        self.link.poll_timeout()
    }
}

/// The link of a vehicle that is configured by default.
#[cfg(test)]
fn default_link() -> VehicleLink {
    let config = scenecast_config::Config::default();
    let profile = scenecast_config::modem_profile(&config, config.modem.bit_rate);
    let link = crate::link_config(&config, None, profile).unwrap();
    VehicleLink::new(link, config.map.codec, 1, Default::default(), Instant::ZERO)
}

#[cfg(test)]
mod band_tests;
#[cfg(test)]
mod in_force_tests;
#[cfg(test)]
mod orders_tests;
