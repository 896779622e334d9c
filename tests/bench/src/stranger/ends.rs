//! Both ends of the link in virtual time, with a lossy channel between them.

use super::Protection;
use super::account::{Judged, LinkCounters, LinkJudgement};
use super::orders::OrderBook;
use crate::link_ends::{EndsSetup, auv, draw_seed};
use scenecast_protocol::directive::{OrderStatus, RefusalReason, SlotId, SlotProgress, SlotState, Withdrawal};
use scenecast_protocol::link::{SlotInboxState, SurfaceLink, VehicleEvent, VehicleLink};
use scenecast_protocol::mac::Access;
use scenecast_protocol::map::{Cell, LabelGrid, StateReplica};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{Envelope, VehicleStatus};
use scenecast_rehearsal::VirtualTime;
use sim_channel::RandomStream;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

/// Share of authentic frames that the channel loses, and of those that it damages.
const LOSS: f64 = 0.05;
const CORRUPTION: f64 = 0.02;
const PROPAGATION: Duration = Duration::from_millis(300);
/// Side of the surveyed area, cells.
const SIDE: i32 = 48;

enum ChannelEvent {
    Sent { by_vehicle: bool },
    Arrives { at_vehicle: bool, bytes: Vec<u8>, is_whole: bool },
    Poll { of_vehicle: bool, frames: u32 },
}

/// Both ends of the link, the channel between them, and the accounts of authentic traffic.
pub(super) struct AttackedEnds {
    now: Instant,
    pub(super) vehicle: VehicleLink,
    pub(super) surface: SurfaceLink,
    pub(super) orders: OrderBook,
    /// Authentic numbered frames, then authentic hellos, that arrived unharmed, by judgement.
    pub(super) authentic: [Judged; 2],
    /// Copies of ended runs that were lost without being overtaken.
    pub(super) erased_maps: u64,
    /// Transmitted frames that the stranger has not collected.
    pub(super) overheard: Vec<Vec<u8>>,
    /// Authentic frames whose content no end has taken: lost, damaged, in the channel, or refused when they arrived.
    untaken: BTreeSet<Vec<u8>>,
    /// Whether all authentic frames are lost.
    pub(super) is_out_of_range: bool,
    /// When the run ended of which the surface keeps a copy, and the size of the copy in cells.
    ended: Option<(Instant, usize)>,
    protection: Protection,
    pub(super) access: Access,
    rng: RandomStream,
    in_channel: BTreeMap<(Instant, u64), ChannelEvent>,
    /// The frames in the modems of surface and vehicle, and whether each transmits.
    modems: [(VecDeque<Vec<u8>>, bool); 2],
    serial: u64,
    durable: SlotInboxState,
    surveyed: i32,
}

impl AttackedEnds {
    pub(super) fn new(protection: Protection, access: Access, mut rng: RandomStream) -> Self {
        let now = Instant::from_secs_f64(1000.0);
        let setup = protection.setup(access);
        let (vehicle_seed, surface_seed) = (draw_seed(&mut rng), draw_seed(&mut rng));
        Self {
            now,
            vehicle: setup.vehicle(vehicle_seed, SlotInboxState::default(), now),
            surface: setup.surface(surface_seed, now),
            orders: OrderBook::default(),
            authentic: Default::default(),
            erased_maps: 0,
            overheard: Vec::new(),
            untaken: BTreeSet::new(),
            is_out_of_range: false,
            ended: None,
            protection,
            access,
            rng,
            in_channel: BTreeMap::new(),
            modems: Default::default(),
            serial: 0,
            durable: SlotInboxState::default(),
            surveyed: 0,
        }
    }

    fn setup(&self) -> EndsSetup {
        self.protection.setup(self.access)
    }

    /// The vehicle's process starts again, with its journal.
    pub(super) fn restart_vehicle(&mut self) {
        let map: Vec<(Cell, u8)> = self.vehicle.map().iter().collect();
        let in_force = SlotId::ALL.map(|id| (id, self.vehicle.in_force(id).cloned()));
        let seed = draw_seed(&mut self.rng);
        self.vehicle = self.setup().vehicle(seed, self.durable.clone(), self.now);
        self.vehicle.assume_budget_spent(self.now);
        for (id, content) in in_force {
            self.vehicle.set_in_force(id, content, self.now);
        }
        self.vehicle.set_map(map, self.now);
        self.empty_modem(true);
    }

    /// The surface's process starts again, with its orders and without its map.
    pub(super) fn restart_surface(&mut self) {
        let seed = draw_seed(&mut self.rng);
        let kept = self.surface.vehicle(auv()).map(|view| (view.series(), view.slots().cloned().collect::<Vec<_>>()));
        self.surface = self.setup().surface(seed, self.now);
        if let Some((series, orders)) = kept {
            self.surface.restore_series(series);
            self.surface.restore_orders(auv(), series, orders, self.now);
        }
        self.surface.assume_budget_spent(self.now);
        self.ended = None;
        self.empty_modem(false);
    }

    fn empty_modem(&mut self, of_vehicle: bool) {
        self.modems[usize::from(of_vehicle)] = (VecDeque::new(), false);
        self.in_channel.retain(|_, e| !matches!(e, ChannelEvent::Sent { by_vehicle } if *by_vehicle == of_vehicle));
    }

    /// The operator gives the next order.
    pub(super) fn issue(&mut self) {
        let slot = self.orders.next();
        // A utility of three labels fits into every frame.
        let issued = self.surface.issue(auv(), slot, self.now);
        debug_assert!(issued.is_ok(), "{issued:?}");
    }

    /// The vehicle surveys more cells, and changes a few that it knows.
    pub(super) fn survey(&mut self, cells: i32) {
        let at = |i: i32| Cell::new(i % SIDE - SIDE / 2, i / SIDE - 3);
        let label = |i: i32| 1 + ((f64::from(i % SIDE) * 0.13 + f64::from(i / SIDE) * 0.17).sin().abs() * 4.0) as u8;
        let until = (self.surveyed + cells).min(SIDE * SIDE);
        let mut changes: Vec<(Cell, u8)> = (self.surveyed..until).map(|i| (at(i), label(i))).collect();
        for _ in 0..cells / 8 {
            let cell = self.rng.below(until.max(1) as usize) as i32;
            changes.push((at(cell), 1 + self.rng.below(8) as u8));
        }
        self.surveyed = until;
        self.vehicle.set_map(changes, self.now);
    }

    pub(super) fn shown(&self) -> Option<&LabelGrid> {
        self.surface.vehicle(auv()).map(|view| view.replica().shown())
    }

    /// Without a key, a forged hello may say that the vehicle has lost its orders. The operator is asked, and sends his order again.
    pub(super) fn answer_question(&mut self) {
        let slots = self.surface.vehicle(auv()).into_iter().flat_map(|view| view.slots());
        let is_lost =
            |s: &SlotProgress| s.id == SlotId::Utility && s.status == OrderStatus::Withdrawn(Withdrawal::Lost);
        if slots.into_iter().any(is_lost) {
            let _ = self.surface.give_again(auv(), SlotId::Utility, self.now);
        }
    }

    /// Whether the maps agree, and the last order is in force and known to be.
    pub(super) fn is_recovered(&self) -> bool {
        let Some(view) = self.surface.vehicle(auv()) else { return false };
        let is_known = view.slots().any(|s| s.id == SlotId::Utility && s.status == OrderStatus::Applied);
        is_known
            && self.orders.in_force == Some(self.orders.issued)
            && self.vehicle.is_converged()
            && view.replica().shown() == self.vehicle.map()
    }

    /// The facts by which [`Self::is_recovered`] decides, for people.
    pub(super) fn facts(&self) -> String {
        let Some(view) = self.surface.vehicle(auv()) else { return "the surface has no vehicle".to_owned() };
        let order = view.slots().find(|s| s.id == SlotId::Utility).map(|s| s.status);
        format!(
            "order {:?} is {order:?}, {:?} in force, holder {:?}, map complete {}, equal {}",
            self.orders.issued,
            self.orders.in_force,
            view.holder().map(|holder| holder.series),
            self.vehicle.is_converged(),
            view.replica().shown() == self.vehicle.map()
        )
    }

    /// Counts the copy of an ended run if it was lost: neither a copy that is as large nor the present map has replaced it.
    fn note_ended(&mut self) {
        let Some(view) = self.surface.vehicle(auv()) else { return };
        let ended = view.ended_run();
        if self.ended.map(|(at, _)| at) == ended.map(|run| run.ended()) {
            return;
        }
        let copy = ended.map(|run| (run.ended(), run.replica().size()));
        let successor = copy.map_or_else(|| view.replica().size(), |(_, cells)| cells);
        self.erased_maps += u64::from(self.ended.is_some_and(|(_, cells)| successor < cells));
        self.ended = copy;
    }

    fn handle(&mut self, event: ChannelEvent) {
        match event {
            ChannelEvent::Sent { by_vehicle } => {
                self.modems[usize::from(by_vehicle)].1 = false;
                match by_vehicle {
                    true => self.vehicle.handle_transmit_outcome(self.now),
                    false => self.surface.handle_transmit_outcome(self.now),
                }
            }
            ChannelEvent::Arrives { at_vehicle, bytes, is_whole } => {
                let judgement = self.deliver(at_vehicle, &bytes);
                if is_whole {
                    let is_hello = Envelope::decode(&bytes, |_| true).is_ok_and(|e| e.header.kind().is_hello());
                    *self.authentic[usize::from(is_hello)].entry(judgement).or_default() += 1;
                }
            }
            ChannelEvent::Poll { of_vehicle: true, frames } => self.vehicle.handle_poll(frames),
            ChannelEvent::Poll { of_vehicle: false, frames } => self.surface.handle_poll(frames),
        }
    }

    /// Gives a frame to an end, which judges it.
    pub(super) fn deliver(&mut self, at_vehicle: bool, bytes: &[u8]) -> LinkJudgement {
        let before = self.counters(at_vehicle);
        if at_vehicle {
            self.vehicle.handle_frame(bytes, self.now);
        } else {
            self.surface.handle_frame(bytes, self.now);
            self.note_ended();
        }
        let judgement = LinkJudgement::between(&before, &self.counters(at_vehicle));
        if judgement.is_kept() {
            self.untaken.remove(bytes);
        }
        judgement
    }

    fn counters(&self, of_vehicle: bool) -> LinkCounters {
        if of_vehicle {
            return LinkCounters::of(self.vehicle.stats());
        }
        self.surface.vehicle(auv()).map(|view| LinkCounters::of(view.stats())).unwrap_or_default()
    }

    /// Whether a frame is authentic and no end has taken its content.
    pub(super) fn is_untaken(&self, bytes: &[u8]) -> bool {
        self.untaken.contains(bytes)
    }

    /// Lets the vehicle's host decide about the orders that came in.
    pub(super) fn apply_orders(&mut self) {
        while let Some(event) = self.vehicle.poll_event() {
            let VehicleEvent::Slot { id, content, .. } = event else { continue };
            let decision = match &content {
                Some(slot) => {
                    self.orders.note_applied(slot);
                    self.vehicle.set_in_force(id, Some(slot.clone()), self.now);
                    SlotState::Applied
                }
                None => SlotState::Refused(RefusalReason::Malformed),
            };
            self.vehicle.decide(id, decision, self.now);
            self.durable = self.vehicle.persistent_state().clone();
            self.vehicle.handle_persisted();
        }
    }

    /// The modem's own cycle: an initiation that may be lost, then requests for the sender's frames.
    fn begin_cycle(&mut self) {
        if self.access != Access::Polled {
            return;
        }
        let Some(cycle) = self.surface.poll_cycle(self.now) else { return };
        let of_vehicle = cycle.from == auv();
        let is_lost = of_vehicle && (self.is_out_of_range || self.rng.bernoulli(LOSS));
        if !is_lost {
            let at = self.now + PROPAGATION * u32::from(of_vehicle) + Duration::from_millis(300);
            self.schedule(at, ChannelEvent::Poll { of_vehicle, frames: cycle.frames.min(8) });
        }
    }

    fn transmit(&mut self, mut bytes: Vec<u8>, by_vehicle: bool) {
        let modem = self.setup().modem();
        let end = self.now + modem.airtime(bytes.len());
        self.schedule(end, ChannelEvent::Sent { by_vehicle });
        self.overheard.push(bytes.clone());
        let (is_lost, is_damaged) = (self.rng.bernoulli(LOSS), self.rng.bernoulli(CORRUPTION));
        self.untaken.insert(bytes.clone());
        if is_lost || self.is_out_of_range {
            return;
        }
        if is_damaged {
            let bit = self.rng.below(bytes.len() * 8);
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let arrives = ChannelEvent::Arrives { at_vehicle: !by_vehicle, bytes, is_whole: !is_damaged };
        self.schedule(end + PROPAGATION, arrives);
    }

    fn schedule(&mut self, at: Instant, event: ChannelEvent) {
        self.serial += 1;
        self.in_channel.insert((at, self.serial), event);
    }
}

impl VirtualTime for AttackedEnds {
    fn now(&self) -> Instant {
        self.now
    }

    fn set_now(&mut self, now: Instant) {
        self.now = now;
    }

    fn next_event(&self) -> Instant {
        let timers = [self.vehicle.poll_timeout(), self.surface.poll_timeout(self.now)];
        let timer = timers.into_iter().flatten().map(|(at, _)| at).filter(|&at| at > self.now).min();
        let event = self.in_channel.first_key_value().map(|((at, _), _)| *at);
        // A timer that has passed without a frame waits for the next event, or a while.
        timer.into_iter().chain(event).min().unwrap_or(self.now + Duration::from_millis(200))
    }

    fn handle_events(&mut self) {
        let later = self.in_channel.split_off(&(self.now, u64::MAX));
        for event in std::mem::replace(&mut self.in_channel, later).into_values() {
            self.handle(event);
        }
    }

    fn pump(&mut self) {
        self.apply_orders();
        while self.surface.poll_event().is_some() {}
        if self.vehicle.wants_status(self.now) {
            let explored_cells = self.surveyed as u32;
            self.vehicle.set_status(VehicleStatus { labels: 8, explored_cells, ..VehicleStatus::default() });
        }
        self.begin_cycle();
        while let Some(transmit) = self.vehicle.poll_transmit(self.now) {
            self.modems[1].0.push_back(transmit.bytes);
        }
        while let Some(transmit) = self.surface.poll_transmit(self.now) {
            self.modems[0].0.push_back(transmit.bytes);
        }
        for by_vehicle in [false, true] {
            let (queue, is_busy) = &mut self.modems[usize::from(by_vehicle)];
            if !*is_busy && let Some(bytes) = queue.pop_front() {
                *is_busy = true;
                self.transmit(bytes, by_vehicle);
            }
        }
    }
}
