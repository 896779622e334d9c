//! The surface's view of a vehicle, for its host.

use super::{EndedRun, InForce, OtherSurface, VehiclePeer};
use crate::directive::{Series, Slot, SlotId, SlotProgress};
use crate::link::{LinkStats, Mismatch};
use crate::map::{ClassReplica, LabelTree, LayerId, LayerReplica, LayerSet, Replica, StateReplica};
use crate::time::{ClockMap, Instant};
use crate::wire::{Backlog, VehicleStatus};
use std::time::Duration;

/// A read-only view of a vehicle for the host.
#[derive(Debug)]
pub struct PeerView<'a, R: StateReplica = Replica>(pub(in crate::link::surface) &'a VehiclePeer<R>);

impl<R: StateReplica> Clone for PeerView<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R: StateReplica> Copy for PeerView<'_, R> {}

impl<'a, R: StateReplica> PeerView<'a, R> {
    /// The operator's copy of the replicated state.
    pub fn replica(&self) -> &'a R {
        &self.0.content.replica
    }

    /// The copy of a run that has ended, until the present copy is as large.
    pub fn ended_run(&self) -> Option<&'a EndedRun<R>> {
        self.0.content.ended.as_ref()
    }

    /// The edge of a cell on the vehicle's map in metres, as its hello states it.
    pub fn cell_m(&self) -> Option<f64> {
        self.0.pair.peer_introduction()?.cell_edge.metres()
    }

    /// A setting of the vehicle that does not fit, as far as is known.
    pub fn mismatch(&self, now: Instant) -> Option<Mismatch> {
        let twin = self.0.twins.is_found(now).then_some(Mismatch::Twin);
        // A surface that holds the vehicle is shown by its name.
        let is_explained = |found: &Mismatch| *found == Mismatch::Foreign && self.holder().is_some();
        twin.or(self.0.pair.mismatch()).filter(|found| !is_explained(found))
    }

    /// The other surface that holds the vehicle.
    pub fn holder(&self) -> Option<OtherSurface> {
        self.0.rivals.holder()
    }

    /// Another surface that has called the vehicle in the last minutes, while this one holds it.
    pub fn caller(&self, now: Instant) -> Option<OtherSurface> {
        self.0.rivals.caller(now)
    }

    /// Whether this surface takes the vehicle over, and the vehicle has not followed yet.
    pub fn takes_over(&self) -> bool {
        self.0.pair.takes_over()
    }

    /// The series that the versions of its orders belong to.
    pub fn series(&self) -> Series {
        self.0.outbox.series()
    }

    /// The layers of its map: the built-in ones, and above them those that it has announced in this run.
    pub fn layers(&self) -> &'a LayerSet {
        self.0.content.layers.set()
    }

    /// The operator's copy of a layer of the map; `None` until the vehicle has announced it.
    pub fn layer(&self, id: LayerId) -> Option<&'a LayerReplica> {
        self.0.content.layers.get(id)
    }

    /// The names and colours of labels that the vehicle has announced in this run.
    pub fn classes(&self) -> &'a ClassReplica {
        &self.0.content.classes
    }

    /// The newest tree of its labels; `None` until one has arrived in this run.
    pub fn tree(&self) -> Option<&'a LabelTree> {
        self.0.content.tree.tree()
    }

    /// Counts changes of the replicated state and its layers.
    pub fn map_version(&self) -> u64 {
        self.0.content.map_version()
    }

    /// The number of times that the copy of the vehicle's state was emptied, because one of the two ends has begun a new run.
    pub fn generation(&self) -> u64 {
        self.0.content.generation()
    }

    /// The last status, and when its pose came in.
    pub fn status(&self) -> Option<&'a (VehicleStatus, Instant)> {
        self.0.content.status.whole()
    }

    /// The backlog of the last report less the bytes received since, and when that report came in.
    pub fn backlog(&self) -> Option<(Backlog, Instant)> {
        self.0.content.backlog.map(|reported| reported.left(self.stats()))
    }

    /// When a frame was last accepted.
    pub fn last_received(&self) -> Option<Instant> {
        self.0.contact.last_received()
    }

    /// When the next turn is granted at the latest; `now` if it is due.
    pub fn next_contact(&self, now: Instant) -> Option<Instant> {
        self.0.master.next_wakeup(false).map(|at| at.max(now))
    }

    /// Two-way propagation time, once it was measured.
    pub fn round_trip(&self) -> Option<Duration> {
        self.0.master.round_trip()
    }

    /// The vehicle's clock, once a stamp came in.
    pub fn clock(&self) -> Option<&'a ClockMap> {
        self.0.timing.clock()
    }

    /// The latest version of each issued slot, and how far it has come.
    pub fn slots(&self) -> impl Iterator<Item = &'a SlotProgress> + use<'a, R> {
        self.0.outbox.progress()
    }

    /// The content of a slot that is in force at the vehicle: utility, settings, budget, limits or fence.
    pub fn in_force(&self, id: SlotId) -> InForce<'a> {
        self.0.in_force.get(id)
    }

    /// The contents that are or may be in force, as far as the surface knows them: of each slot the last known one first, then
    /// those of replaced orders that the vehicle may have put in force. A store keeps them for a restart.
    pub fn in_force_memory(&self) -> impl Iterator<Item = &'a Slot> {
        self.0.in_force.memory()
    }

    /// Counters and estimates of the link to this vehicle.
    pub fn stats(&self) -> &'a LinkStats {
        &self.0.pair.stats
    }
}
