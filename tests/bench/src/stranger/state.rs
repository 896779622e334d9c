//! The state of both ends as far as a person or the other end notices it.

use crate::link_ends::auv;
use scenecast_protocol::directive::{OrderStatus, Series, SlotId};
use scenecast_protocol::link::{EndedRun, LinkStats, SlotInboxState, SurfaceLink, VehicleLink};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::VehicleStatus;

/// The state of the surface toward the vehicle.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct SurfaceState {
    pub(super) map_version: u64,
    /// When the run ended of which the copy is kept.
    ended: Option<Instant>,
    /// Runs of either end that the surface has begun or noticed.
    pub(super) runs: u64,
    frames_received: u64,
    series: Option<Series>,
    status: Option<(VehicleStatus, Instant)>,
    slots: Vec<(SlotId, u16, OrderStatus)>,
}

impl SurfaceState {
    pub(super) fn of(surface: &SurfaceLink) -> Self {
        let Some(view) = surface.vehicle(auv()) else { return Self::default() };
        Self {
            map_version: view.map_version(),
            ended: view.ended_run().map(EndedRun::ended),
            runs: runs(view.stats()),
            frames_received: view.stats().frames_received,
            series: Some(view.series()),
            status: view.status().cloned(),
            slots: view.slots().map(|slot| (slot.id, slot.version, slot.status)).collect(),
        }
    }
}

/// The state of the vehicle toward the surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct VehicleState {
    inbox: SlotInboxState,
    runs: u64,
    frames_received: u64,
    last_received: Option<Instant>,
    map_version: u64,
}

impl VehicleState {
    pub(super) fn of(vehicle: &VehicleLink) -> Self {
        Self {
            inbox: vehicle.persistent_state().clone(),
            runs: runs(vehicle.stats()),
            frames_received: vehicle.stats().frames_received,
            last_received: vehicle.last_received(),
            map_version: vehicle.map_version(),
        }
    }
}

fn runs(stats: &LinkStats) -> u64 {
    stats.peer_restarts + stats.resyncs
}
