//! What the surface's host sees of a vehicle.

use super::peer::Peer;
use crate::directive::SlotProgress;
use crate::link::LinkStats;
use crate::mac::ClockMap;
use crate::map::{Replica, StateReplica};
use crate::time::Instant;
use crate::wire::VehicleStatus;
use std::time::Duration;

/// When a vehicle was heard, and how often it is heard.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contact {
    heard: Option<Instant>,
    /// Smoothed time between two frames that were taken.
    interval: Option<Duration>,
}

impl Contact {
    pub(super) fn hear(&mut self, now: Instant) {
        if let Some(last) = self.heard {
            let gap = now.since(last);
            self.interval =
                Some(self.interval.map_or(gap, |old| if gap > old { (old + gap) / 2 } else { (old * 15 + gap) / 16 }));
        }
        self.heard = Some(now);
    }

    pub(super) fn heard(&self) -> Option<Instant> {
        self.heard
    }
}

/// A read-only view of a vehicle for the host.
#[derive(Debug)]
pub struct PeerView<'a, R: StateReplica = Replica>(pub(super) &'a Peer<R>);

impl<R: StateReplica> Clone for PeerView<'_, R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R: StateReplica> Copy for PeerView<'_, R> {}

impl<'a, R: StateReplica> PeerView<'a, R> {
    /// The operator's copy of what the vehicle replicates.
    pub fn replica(&self) -> &'a R {
        &self.0.replica
    }

    /// The last status and when its position came in.
    pub fn status(&self) -> Option<&'a (VehicleStatus, Instant)> {
        self.0.status.whole.as_ref()
    }

    /// When a frame was last taken.
    pub fn heard(&self) -> Option<Instant> {
        self.0.contact.heard
    }

    /// Time between two frames, smoothed.
    pub fn expected_interval(&self) -> Option<Duration> {
        self.0.contact.interval
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
        self.0.clock.as_ref()
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
