//! Where a vehicle was, as it reported.

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::{TrailCorner, VehicleStatus};
use std::collections::VecDeque;

/// Ages of corners are whole seconds, and frames take their time through the water: a corner counts as later than a position
/// from this difference on.
const TRAIL_MARGIN_S: f64 = 0.5;

/// Reported positions in the map frame: time, metres east, metres north.
#[derive(Debug, Clone, Default)]
pub struct Track {
    points: VecDeque<(Instant, f64, f64)>,
    total: u64,
}

impl Track {
    /// The most positions that are kept.
    pub(crate) const MAX_POINTS: usize = 500;

    /// A track that was interrupted after `total` positions, of which these are the last.
    pub fn restored(points: impl IntoIterator<Item = (Instant, f64, f64)>, total: u64) -> Self {
        Self { points: points.into_iter().collect(), total }
    }

    pub fn iter(&self) -> impl DoubleEndedIterator<Item = (Instant, f64, f64)> + ExactSizeIterator + '_ {
        self.points.iter().copied()
    }

    /// The number of positions so far, those that were dropped included.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Appends a pose that came in at `now`, and before it those corners of its trail that are later than the track so far. A
    /// status whose pose is older than that changes nothing.
    pub(crate) fn handle_pose(&mut self, status: &VehicleStatus, now: Instant) {
        let last = self.points.back().map(|&(at, ..)| at);
        if last.is_some_and(|last| now <= last) {
            return;
        }
        let known_s = last.map_or(0.0, |last| last.as_secs_f64() + TRAIL_MARGIN_S);
        for &TrailCorner { ago_s, place } in status.trail.iter().rev() {
            let at_s = now.as_secs_f64() - f64::from(ago_s);
            if at_s > known_s {
                self.push(Instant::from_secs_f64(at_s), place.x_m, place.y_m);
            }
        }
        self.push(now, status.position.x_m, status.position.y_m);
    }

    pub(crate) fn push(&mut self, at: Instant, x_m: f64, y_m: f64) {
        self.points.push_back((at, x_m, y_m));
        self.total += 1;
        self.points.drain(..self.points.len().saturating_sub(Self::MAX_POINTS));
    }
}
