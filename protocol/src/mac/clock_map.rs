//! The peer's clock, seen from ours.

use crate::time::Instant;
use crate::wire::Stamp;
use std::collections::VecDeque;
use std::time::Duration;

/// How far the peer's clock is ahead of ours, known within half of the asymmetry of the two ways.
///
/// A frame that was late, or was sent again as it was, makes the peer's clock look slow; so the greatest of the last few
/// measurements counts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ClockMap {
    /// Peer's clock minus ours, microseconds; the peer's comes round after 4 h 39 min.
    measured_us: VecDeque<i64>,
    at: Instant,
}

impl ClockMap {
    /// Measurements that are kept.
    const KEPT: usize = 4;

    /// Takes a stamp of a transmission that began `ago` before `now`.
    pub fn measure(&mut self, clock_ms: u32, ago: Duration, now: Instant) {
        let began = (now - ago).as_micros() as i64;
        // Counted near what is known, so that a clock that has come round is not taken for a slow one.
        let near = began + self.measured_us.back().copied().unwrap_or_default();
        self.measured_us.push_back(Stamp::unwrap_clock(clock_ms, near) - began);
        if self.measured_us.len() > Self::KEPT {
            self.measured_us.pop_front();
        }
        self.at = now;
    }

    fn ahead_us(&self) -> i64 {
        self.measured_us.iter().max().copied().unwrap_or_default()
    }

    /// When it was measured last.
    pub fn measured_at(&self) -> Instant {
        self.at
    }

    /// Our time, nearest to `now`, when the peer's clock showed `clock_ms`.
    pub fn to_ours(&self, clock_ms: u32, now: Instant) -> Instant {
        let theirs = Stamp::unwrap_clock(clock_ms, now.as_micros() as i64 + self.ahead_us());
        Instant::from_micros((theirs - self.ahead_us()).max(0) as u64)
    }

    /// What the peer's clock shows at `at`, milliseconds, low 24 bits.
    pub fn to_theirs(&self, at: Instant) -> u32 {
        Stamp::clock(Instant::from_micros((at.as_micros() as i64 + self.ahead_us()).rem_euclid(1000 << 24) as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_comes_back_through_the_peers_clock() {
        let now = Instant::from_secs_f64(90_000.5);
        let mut map = ClockMap::default();
        map.measure(1_000, Duration::from_millis(500), now);
        map.measure(500, Duration::from_millis(200), now);
        let earlier = now - Duration::from_secs(60);
        assert_eq!(map.to_theirs(now), 1_500);
        assert_eq!(map.to_ours(map.to_theirs(earlier), now), earlier);
    }
}
