//! What the surface's host sees of a vehicle.

use super::Peer;
use crate::directive::SlotProgress;
use crate::link::LinkStats;
use crate::mac::ClockMap;
use crate::map::{PlaneKind, PlaneReplica, Replica, StateReplica};
use crate::time::Instant;
use crate::wire::{Backlog, VehicleStatus};
use std::time::Duration;

/// A read-only view of a vehicle for the host.
#[derive(Debug)]
pub struct PeerView<'a, R: StateReplica = Replica>(pub(in crate::link::surface) &'a Peer<R>);

impl<R: StateReplica> Clone for PeerView<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R: StateReplica> Copy for PeerView<'_, R> {}

impl<'a, R: StateReplica> PeerView<'a, R> {
    /// The operator's copy of what the vehicle replicates.
    pub fn replica(&self) -> &'a R {
        &self.0.content.replica
    }

    /// The operator's copy of a plane of the map; `None` while nothing of it was heard.
    pub fn plane(&self, kind: PlaneKind) -> Option<&'a PlaneReplica> {
        self.0.content.planes.get(kind)
    }

    /// Counts changes of what the vehicle replicates, planes included.
    pub fn map_version(&self) -> u64 {
        self.0.content.map_version()
    }

    /// The last status and when its position came in.
    pub fn status(&self) -> Option<&'a (VehicleStatus, Instant)> {
        self.0.content.status.whole()
    }

    /// What the vehicle had still to send by its last report, less what has come in since, and when that report came in.
    pub fn backlog(&self) -> Option<(Backlog, Instant)> {
        self.0.content.backlog.map(|reported| reported.left(self.stats()))
    }

    /// When a frame was last taken.
    pub fn heard(&self) -> Option<Instant> {
        self.0.contact.last_received()
    }

    /// When the next turn will be granted at the latest; `now` if that is due.
    pub fn next_contact(&self, now: Instant) -> Option<Instant> {
        self.0.master.next_wakeup(false).map(|at| at.max(now))
    }

    /// Two-way propagation.
    pub fn round_trip(&self) -> Option<Duration> {
        self.0.master.round_trip()
    }

    /// The vehicle's clock.
    pub fn clock(&self) -> Option<&'a ClockMap> {
        self.0.timing.clock()
    }

    /// The slots that were issued and how far they have come.
    pub fn slots(&self) -> impl Iterator<Item = &'a SlotProgress> + use<'a, R> {
        self.0.outbox.progress()
    }

    /// Counters.
    pub fn stats(&self) -> &'a LinkStats {
        &self.0.pair.stats
    }
}
