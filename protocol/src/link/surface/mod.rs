//! The surface's end of the link.
//!
//! [`SurfaceLink`] joins parts that own their state: `fleet` (the known vehicles, each a `peer`, and the calls for unknown
//! ones). `transmit` decides when a frame goes out, also in the cycles of a modem that polls.

mod config;
mod fleet;
mod layers;
mod peer;
mod transmit;

pub use config::{IssueError, SurfaceConfig, SurfaceEvent};
pub use peer::{EndedRun, InForce, OtherSurface, PeerView};
pub use transmit::Cycle;

use crate::directive::{Series, Slot, SlotId, SlotProgress, VersionedSlot};
use crate::link::run::Identities;
use crate::link::{DropReason, FrameNumber, Mismatch, Transmit};
use crate::mac::Access;
use crate::map::{Replica, StateReplica};
use crate::schedule::{BitBudget, ClassShares, Shares};
use crate::time::Instant;
use crate::wire::{Address, Envelope, FrameKind, Introduction, Seal, UtcHours};
use fleet::{Discovery, Fleet};
use peer::{Ready, VehiclePeer, room_for_slot};
use std::collections::VecDeque;

/// A frame in the modem.
#[derive(Debug, Clone, Copy)]
struct OnAir {
    to: Address,
    number: Option<FrameNumber>,
    /// Whether a turn ends with it.
    last: bool,
}

/// The surface's end of the link: grants turns, holds a replica for each vehicle, sends each its directive.
#[derive(Debug)]
pub struct SurfaceLink<R: StateReplica = Replica> {
    config: SurfaceConfig,
    fleet: Fleet<R>,
    budget: BitBudget,
    shares: ClassShares,
    /// The frames of the surface's own turn that are still to go out.
    turn: VecDeque<Ready>,
    in_modem: VecDeque<OnAir>,
    discovery: Discovery,
    cycle: transmit::Cycles,
    series: Series,
    clock: Option<UtcHours>,
    random: u64,
    events: VecDeque<SurfaceEvent>,
    unknown_senders: u64,
}

impl<R: StateReplica> SurfaceLink<R> {
    /// An end without contact; `seed` must be random for each run.
    pub fn new(config: SurfaceConfig, seed: u64, now: Instant) -> Self {
        let mut random = seed;
        let series = Series::from_random(crate::link::run::next_random(&mut random));
        let is_any_known = !config.vehicles.is_empty();
        let calls = Identities::new(seed ^ 0xCA11, config.authenticity.as_ref().map(|a| a.key.calls()));
        let mut link = Self {
            fleet: Fleet::new(),
            budget: BitBudget::new(config.budget_bps, config.budget_window, now),
            shares: ClassShares::new(config.shares),
            turn: VecDeque::new(),
            in_modem: VecDeque::new(),
            discovery: Discovery::new(config.discovery_period, is_any_known, config.master.max_propagation, calls, now),
            cycle: transmit::Cycles::default(),
            series,
            clock: None,
            random,
            events: VecDeque::new(),
            unknown_senders: 0,
            config,
        };
        for vehicle in link.config.vehicles.clone() {
            link.add(vehicle, now);
        }
        link
    }

    fn add(&mut self, vehicle: Address, now: Instant) {
        let seed = crate::link::run::next_random(&mut self.random);
        let c = &self.config;
        let introduction = Introduction {
            cell_edge: c.cell_edge,
            origin: c.origin,
            series: Some(self.series),
            name: c.name,
            clock: self.clock,
            frame_bytes: c.modem.frame_bytes as u16,
            is_full_duplex: c.modem.access == Access::FullDuplex,
            ..Introduction::default()
        };
        let peer = VehiclePeer::new(c.mission, vehicle, c.authenticity.clone(), introduction, seed, c.master, now);
        let peer = peer.with_modem(&c.modem).with_abort_lifetime(c.abort_lifetime);
        self.fleet.insert(vehicle, peer);
    }

    /// The random number that distinguishes the orders of this surface from those of others.
    pub fn series(&self) -> Series {
        self.series
    }

    /// Continues with the series of an earlier run of the surface, before any order is issued.
    pub fn restore_series(&mut self, series: Series) {
        self.series = series;
        for vehicle in self.fleet.addresses().collect::<Vec<_>>() {
            self.restore_orders(vehicle, series, [], Instant::ZERO);
        }
    }

    /// Puts the orders to a vehicle back that an earlier run of the surface has issued in `series`. A vehicle that is not
    /// configured is added at `now`, if discovery calls may find vehicles. Returns whether the vehicle is known.
    pub fn restore_orders(
        &mut self,
        vehicle: Address,
        series: Series,
        orders: impl IntoIterator<Item = SlotProgress>,
        now: Instant,
    ) -> bool {
        let is_known = self.fleet.get(vehicle).is_some();
        if !is_known && self.config.discovery_period.is_some() && self.fleet.has_room() {
            self.add(vehicle, now);
        }
        let Some(peer) = self.fleet.get_mut(vehicle) else { return false };
        peer.restore_orders(series, orders);
        true
    }

    /// Takes the contents of [`PeerView::in_force_memory`] of an earlier run of the surface. They count once a report of the
    /// vehicle confirms their digests.
    pub fn restore_in_force(&mut self, vehicle: Address, contents: impl IntoIterator<Item = Slot>) {
        let Some(peer) = self.fleet.get_mut(vehicle) else { return };
        peer.restore_in_force(contents);
    }

    /// The current view of a vehicle; `None` if it is unknown.
    pub fn vehicle(&self, vehicle: Address) -> Option<PeerView<'_, R>> {
        self.fleet.get(vehicle).map(PeerView)
    }

    /// The known vehicles, in the order of their addresses.
    pub fn vehicles(&self) -> impl Iterator<Item = Address> + '_ {
        self.fleet.addresses()
    }

    /// Frames that no known vehicle has sent, or that could not be read.
    pub fn unknown_senders(&self) -> u64 {
        self.unknown_senders
    }

    /// Issues a new version of a slot to a vehicle; returns the version.
    pub fn issue(&mut self, vehicle: Address, slot: Slot, now: Instant) -> Result<u16, IssueError> {
        let seal = Seal::bytes(self.config.authenticity.is_some(), FrameKind::Numbered);
        let room = room_for_slot(self.config.modem.frame_bytes, seal);
        let bytes = VersionedSlot::encode(0, &slot).len();
        if bytes > room {
            return Err(IssueError::TooLarge { bytes, room });
        }
        let version = self.fleet.get_mut(vehicle).map(|p| p.issue(slot, now)).ok_or(IssueError::NoVehicle)?;
        self.resync_if_out_of_step(vehicle, now);
        Ok(version)
    }

    /// Begins a new run toward a vehicle if the two ends were found to differ.
    fn resync_if_out_of_step(&mut self, vehicle: Address, now: Instant) {
        let is_current = self.fleet.is_current(vehicle);
        let Some(peer) = self.fleet.get_mut(vehicle) else { return };
        if !peer.resync_if_out_of_step(now, &mut self.events) {
            return;
        }
        if is_current && !self.turn.is_empty() {
            // The rest of the turn was written for the run that has ended.
            self.turn.clear();
            match self.in_modem.back_mut() {
                Some(sent) => sent.last = true,
                None => peer.master.postpone(now),
            }
        }
        self.events.push_back(SurfaceEvent::MapChanged(vehicle));
    }

    /// Has a vehicle leave another surface that holds it.
    pub fn take_over(&mut self, vehicle: Address, now: Instant) -> Result<(), IssueError> {
        self.fleet.get_mut(vehicle).map(|peer| peer.take_over(now)).ok_or(IssueError::NoVehicle)
    }

    /// Gives a withdrawn order again, as a new one; returns its version, `None` if no order of this kind was withdrawn.
    pub fn give_again(&mut self, vehicle: Address, id: SlotId, now: Instant) -> Result<Option<u16>, IssueError> {
        let version = self.fleet.get_mut(vehicle).map(|p| p.give_again(id, now)).ok_or(IssueError::NoVehicle)?;
        self.resync_if_out_of_step(vehicle, now);
        Ok(version)
    }

    /// Sends the orders that a vehicle has lost again, except one that only lifts a hold or an abort; returns their slots.
    pub fn restore_lost(&mut self, vehicle: Address, now: Instant) -> Result<Vec<SlotId>, IssueError> {
        let restored = self.fleet.get_mut(vehicle).map(|p| p.restore_lost(now)).ok_or(IssueError::NoVehicle)?;
        self.resync_if_out_of_step(vehicle, now);
        Ok(restored)
    }

    /// Issues a new version of a slot to several vehicles; each acknowledges and decides by itself.
    pub fn issue_to(&mut self, vehicles: &[Address], slot: &Slot, now: Instant) -> Result<Vec<u16>, IssueError> {
        if vehicles.iter().any(|&v| self.fleet.get(v).is_none()) {
            return Err(IssueError::NoVehicle);
        }
        vehicles.iter().map(|&v| self.issue(v, slot.clone(), now)).collect()
    }

    /// Sets the clock of this computer, with which those of the vehicles are compared. Without it, none is.
    pub fn set_clock(&mut self, clock: UtcHours) {
        self.clock = Some(clock);
        self.fleet.set_clock(clock);
    }

    /// Counts the budget as spent, because an earlier run of this end may have transmitted until `now`.
    pub fn assume_budget_spent(&mut self, now: Instant) {
        self.budget.assume_spent(now);
    }

    /// Changes the surface's own bit budget.
    pub fn set_budget(&mut self, bits_per_s: u32, now: Instant) {
        self.budget.set_rate(bits_per_s, now);
    }

    /// The surface's own bit budget in bit/s.
    pub fn budget_bps(&self) -> u32 {
        self.budget.bits_per_s()
    }

    /// Changes the least shares of the classes.
    pub fn set_shares(&mut self, shares: Shares) {
        self.shares.set(shares);
    }

    /// The least shares of the classes.
    pub fn shares(&self) -> Shares {
        self.shares.shares()
    }

    /// The next event; the host calls this until it returns `None`.
    #[must_use]
    pub fn poll_event(&mut self) -> Option<SurfaceEvent> {
        self.events.pop_front()
    }

    /// Handles the bytes of one received frame; a frame that cannot be used is counted and dropped.
    pub fn handle_frame(&mut self, bytes: &[u8], now: Instant) {
        let envelope = match Envelope::decode(bytes, |to| to == Address::SURFACE) {
            Ok(envelope) if envelope.header.from.is_vehicle() => envelope,
            Ok(_) => return self.drop_unknown(DropReason::UnknownSender),
            Err(e) => return self.drop_unknown(e.into()),
        };
        let from = envelope.header.from;
        let authenticity = self.config.authenticity.as_ref();
        if self.discovery.is_answered_by(&envelope, self.config.mission, authenticity, now) {
            return self.handle_call_answer(from, now);
        }
        if self.discovery.is_new_complaint(&envelope) {
            self.events.push_back(SurfaceEvent::Mismatch(from, Mismatch::Unverified));
        }
        let Some(peer) = self.fleet.get_mut(from) else { return self.drop_unknown(DropReason::UnknownSender) };
        peer.handle_frame(&envelope, bytes.len(), &self.config.modem, now, &mut self.events);
        self.resync_if_out_of_step(from, now);
        if let Some(peer) = self.fleet.get_mut(from) {
            peer.owe_answer(now);
        }
    }

    /// Drops the copy of an ended run of a vehicle, because the operator needs it no more.
    pub fn drop_ended_run(&mut self, vehicle: Address) {
        if self.fleet.get_mut(vehicle).is_some_and(VehiclePeer::drop_ended) {
            self.events.push_back(SurfaceEvent::MapChanged(vehicle));
        }
    }

    fn handle_call_answer(&mut self, from: Address, now: Instant) {
        match self.fleet.get_mut(from) {
            Some(peer) => peer.handle_call_answer(now),
            None => {
                self.add(from, now);
                self.events.push_back(SurfaceEvent::VehicleFound(from));
            }
        }
    }

    fn drop_unknown(&mut self, reason: DropReason) {
        self.unknown_senders += 1;
        if let Some(first) = self.fleet.first_mut() {
            first.drop_frame(reason);
        }
    }

    /// The transmission that was handed out has left the modem.
    pub fn handle_transmit_outcome(&mut self, now: Instant) {
        if self.config.modem.access.is_free() {
            self.budget.handle_delay(self.in_modem.len(), now);
        }
        let Some(sent) = self.in_modem.pop_front() else { return };
        let Some(peer) = self.fleet.get_mut(sent.to) else { return };
        peer.handle_sent(sent.number, now);
        if sent.last {
            let losable = peer.stats().incoming.loss.copies(0.03, 8) - 1;
            peer.master.handle_turn_sent(&self.config.modem, losable, now);
            self.cycle.handle_turn_sent();
        }
    }

    /// The modem put `bits` on air beside those it was given, for example by repeating a frame itself.
    pub fn handle_repeated(&mut self, bits: u64, now: Instant) {
        self.budget.spend(bits, now);
    }

    /// Puts a frame into the modem.
    fn send(&mut self, ready: Ready, last: bool, now: Instant) -> Transmit {
        let to = ready.transmit.to;
        self.in_modem.push_back(OnAir { to, number: ready.number, last });
        self.budget.spend(self.config.modem.bits_on_air(ready.transmit.bytes.len()), now);
        ready.transmit
    }
}
