//! The peer's clock, seen from ours.

use crate::time::Instant;
use crate::wire::Stamp;
use std::time::Duration;

/// How far the peer's clock is ahead of ours, known within half of the asymmetry of the two ways.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockMap {
    /// Peer's clock minus ours, microseconds; the peer's comes round after 4 h 39 min.
    ahead_us: i64,
    /// When that was measured.
    measured: Instant,
}

impl ClockMap {
    /// From a stamp whose transmission began `ago` before `now`.
    pub fn measured(clock_ms: u32, ago: Duration, now: Instant) -> Self {
        let began = (now - ago).as_micros() as i64;
        Self { ahead_us: Stamp::unwrap_clock(clock_ms, began) - began, measured: now }
    }

    /// When it was measured.
    pub fn measured_at(&self) -> Instant {
        self.measured
    }

    /// Our time, nearest to `now`, when the peer's clock showed `clock_ms`.
    pub fn to_ours(&self, clock_ms: u32, now: Instant) -> Instant {
        let theirs = Stamp::unwrap_clock(clock_ms, now.as_micros() as i64 + self.ahead_us);
        Instant::from_micros((theirs - self.ahead_us).max(0) as u64)
    }

    /// What the peer's clock shows at `at`, milliseconds, low 24 bits.
    pub fn to_theirs(&self, at: Instant) -> u32 {
        Stamp::clock(Instant::from_micros((at.as_micros() as i64 + self.ahead_us).rem_euclid(1000 << 24) as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_comes_back_through_the_peers_clock() {
        let now = Instant::from_secs_f64(90_000.5);
        let map = ClockMap::measured(1_000, Duration::from_millis(500), now);
        let earlier = now - Duration::from_secs(60);
        assert_eq!(map.to_theirs(now), 1_500);
        assert_eq!(map.to_ours(map.to_theirs(earlier), now), earlier);
    }
}
