//! The surface's clock and distance, measured from the stamps in its frames.

use crate::time::{ClockMap, Instant};
use crate::wire::Stamp;
use std::time::Duration;

/// The latest frame of the surface, which a stamp of ours can name.
#[derive(Debug, Clone, Copy)]
struct LatestFrame {
    number: u64,
    at: Instant,
}

/// Timing of the surface as seen by the vehicle.
#[derive(Debug, Default)]
pub(super) struct SurfaceTiming {
    latest: Option<LatestFrame>,
    clock: Option<ClockMap>,
    one_way: Option<Duration>,
    /// When the last turn with stamps began.
    stamped: Option<Instant>,
    /// Whether the frames of the current turn have stamps.
    is_stamped: bool,
}

/// The part of the bit budget that stamps take once the surface has measured the distance, and more of one below 114 bit/s. Before,
/// a turn has two of them.
const STAMP_SHARE: f64 = 0.003;
/// The surface takes a measured distance for current for five minutes, in which two stamps go out: one may be lost.
const MAX_STAMP_INTERVAL: Duration = Duration::from_secs(140);

impl SurfaceTiming {
    /// A numbered frame came in that was on air for `airtime`. Hellos are not passed in: they may be replays.
    pub(super) fn handle_frame(&mut self, number: u64, stamp: Option<&Stamp>, airtime: Duration, now: Instant) {
        self.latest = Some(LatestFrame { number, at: now });
        if let Some(&Stamp::Surface { clock_ms, one_way }) = stamp {
            self.one_way = one_way.or(self.one_way);
            let transit = self.transit(airtime);
            self.clock.get_or_insert_default().measure(clock_ms, transit, now);
        }
    }

    /// The surface has begun a new run, which numbers its frames again.
    pub(super) fn handle_peer_restart(&mut self) {
        (self.latest, self.stamped) = (None, None);
    }

    /// Time from the start of a transmission of `airtime` at the surface to its end here.
    pub(super) fn transit(&self, airtime: Duration) -> Duration {
        airtime + self.one_way.unwrap_or_default()
    }

    pub(super) fn clock(&self) -> Option<&ClockMap> {
        self.clock.as_ref()
    }

    /// One-way propagation time, as the surface has measured it.
    pub(super) fn one_way(&self) -> Option<Duration> {
        self.one_way
    }

    /// When the latest frame of the surface's current run came in.
    pub(super) fn last_received(&self) -> Option<Instant> {
        self.latest.map(|l| l.at)
    }

    /// Decides whether the frames of a turn that begins at `now` have stamps: those of each turn until the surface has
    /// measured the distance, then of as many turns as the share of the stamps allows.
    pub(super) fn begin_turn(&mut self, budget_bps: u32, now: Instant) {
        let bits = Stamp::VEHICLE_BYTES as f64 * 8.0;
        let pause = Duration::from_secs_f64(bits / STAMP_SHARE / f64::from(budget_bps.max(1)));
        let pause = pause.min(MAX_STAMP_INTERVAL);
        self.is_stamped = self.one_way.is_none() || self.stamped.is_none_or(|at| now.since(at) >= pause);
        if self.is_stamped && self.latest.is_some() {
            self.stamped = Some(now);
        }
    }

    /// The stamp of a frame written at `now`, if those of this turn have one.
    pub(super) fn stamp(&self, now: Instant) -> Option<Stamp> {
        let latest = self.latest.filter(|_| self.is_stamped)?;
        Some(Stamp::Vehicle {
            clock_ms: Stamp::clock(now),
            last_received: latest.number as u8,
            held: now.since(latest.at),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_budget_stamps_few_turns_once_the_distance_is_known() {
        let at = |s: u64| Instant::from_micros(s * 1_000_000);
        let stamped = |budget_bps: u32, one_way: Option<Duration>| {
            let mut timing = SurfaceTiming::default();
            // A turn of hellos, before the first frame of a new run, has no stamp.
            timing.begin_turn(budget_bps, at(0));
            let stamp = Stamp::Surface { clock_ms: 0, one_way };
            timing.handle_frame(1, Some(&stamp), Duration::ZERO, at(0));
            let turns = (0..10).map(|turn| at(turn * 10));
            turns.filter(|&now| (timing.begin_turn(budget_bps, now), timing.stamp(now)).1.is_some()).count()
        };
        let known = Some(Duration::from_millis(300));
        assert_eq!([stamped(250, None), stamped(250, known), stamped(1000, known)], [10, 2, 5]);
    }
}
