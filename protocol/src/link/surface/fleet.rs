//! The vehicles that the surface knows, and the choice of the next one to contact.

use super::peer::VehiclePeer;
use crate::map::StateReplica;
use crate::time::Instant;
use crate::wire::{Address, UtcHours};
use std::collections::BTreeMap;

/// The known vehicles; the surface exchanges turns with one of them at a time.
#[derive(Debug)]
pub(super) struct Fleet<R> {
    peers: BTreeMap<Address, VehiclePeer<R>>,
    /// The vehicle that has or had the last turn.
    current: Option<Address>,
}

impl<R: StateReplica> Fleet<R> {
    /// No further vehicle is looked for beyond this number.
    const MAX_FOUND: usize = 14;

    pub(super) fn new() -> Self {
        Self { peers: BTreeMap::new(), current: None }
    }

    pub(super) fn insert(&mut self, vehicle: Address, peer: VehiclePeer<R>) {
        self.peers.insert(vehicle, peer);
    }

    pub(super) fn get(&self, vehicle: Address) -> Option<&VehiclePeer<R>> {
        self.peers.get(&vehicle)
    }

    pub(super) fn get_mut(&mut self, vehicle: Address) -> Option<&mut VehiclePeer<R>> {
        self.peers.get_mut(&vehicle)
    }

    pub(super) fn first_mut(&mut self) -> Option<&mut VehiclePeer<R>> {
        self.peers.values_mut().next()
    }

    pub(super) fn set_clock(&mut self, clock: UtcHours) {
        self.peers.values_mut().for_each(|peer| peer.set_clock(clock));
    }

    pub(super) fn addresses(&self) -> impl Iterator<Item = Address> + '_ {
        self.peers.keys().copied()
    }

    /// Whether discovery may still add a vehicle.
    pub(super) fn has_room(&self) -> bool {
        self.peers.len() < Self::MAX_FOUND
    }

    pub(super) fn is_current(&self, vehicle: Address) -> bool {
        self.current == Some(vehicle)
    }

    pub(super) fn set_current(&mut self, vehicle: Address) {
        self.current = Some(vehicle);
    }

    pub(super) fn current_mut(&mut self) -> Option<&mut VehiclePeer<R>> {
        self.current.and_then(|a| self.peers.get_mut(&a))
    }

    /// The vehicle whose turn occupies the medium.
    fn engaged(&self) -> Option<&VehiclePeer<R>> {
        self.current.and_then(|a| self.peers.get(&a)).filter(|p| p.master.is_engaged())
    }

    /// Whether the turn of a vehicle still occupies the medium at `now`.
    pub(super) fn is_medium_taken(&self, now: Instant) -> bool {
        self.engaged().is_some_and(|p| !p.master.may_speak(false, now))
    }

    /// Vehicles that answer their grants.
    pub(super) fn active(&self) -> usize {
        self.peers.values().filter(|p| p.master.unanswered() < 3).count()
    }

    /// Withdraws aborts that have not arrived in time; returns their vehicles.
    pub(super) fn withdraw_late_aborts(&mut self, now: Instant) -> impl Iterator<Item = Address> {
        self.peers.iter_mut().filter_map(move |(&vehicle, peer)| peer.withdraw_late_abort(now).then_some(vehicle))
    }

    /// The vehicle to grant a turn to at `now`: of those that are due, the one that waited longest.
    pub(super) fn choose(&self, now: Instant) -> Option<Address> {
        if self.is_medium_taken(now) {
            return None;
        }
        let is_alone = self.peers.len() == 1;
        self.longest_waiting(|p| {
            let is_quiet = p.quiet_until().is_some_and(|until| now < until);
            !is_quiet && p.master.may_speak(p.has_slots_to_send(), now) && (is_alone || now >= p.master.retry_at())
        })
    }

    /// The vehicle that waited longest of those to which a frame should go without a turn.
    pub(super) fn choose_without_turn(&self, now: Instant) -> Option<Address> {
        self.longest_waiting(|p| p.has_reason_to_transmit(now))
    }

    fn longest_waiting(&self, is_due: impl Fn(&VehiclePeer<R>) -> bool) -> Option<Address> {
        self.peers
            .values()
            .filter(|p| is_due(p))
            .min_by_key(|p| (p.master.begun(), p.address()))
            .map(VehiclePeer::address)
    }

    /// When the next turn may be granted; `discovery` is when the next discovery call is due.
    pub(super) fn next_turn(&self, discovery: Option<Instant>) -> Option<Instant> {
        if let Some(peer) = self.engaged() {
            return peer.master.next_wakeup(false);
        }
        let is_alone = self.peers.len() == 1;
        let due = |p: &VehiclePeer<R>| {
            let at = p.master.next_wakeup(p.has_slots_to_send())?.max(p.quiet_until().unwrap_or(Instant::ZERO));
            Some(if is_alone { at } else { at.max(p.master.retry_at()) })
        };
        self.peers.values().filter_map(due).chain(discovery).min()
    }

    /// When a frame is next due that goes out without a turn.
    pub(super) fn next_without_turn(&self) -> Option<Instant> {
        self.peers.values().filter_map(VehiclePeer::next_reason).min()
    }
}
