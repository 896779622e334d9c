//! The surface's clock and distance, measured from the stamps in its frames.

use crate::mac::ClockMap;
use crate::time::Instant;
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
}

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
        self.latest = None;
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

    /// The stamp of a frame written at `now`.
    pub(super) fn stamp(&self, now: Instant) -> Option<Stamp> {
        let latest = self.latest?;
        Some(Stamp::Vehicle {
            clock_ms: Stamp::clock(now),
            last_received: latest.number as u8,
            held: now.since(latest.at),
        })
    }
}
