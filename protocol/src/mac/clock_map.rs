//! The peer's clock relative to ours.

use crate::time::Instant;
use crate::wire::Stamp;
use std::collections::VecDeque;
use std::time::Duration;

/// The offset of the peer's clock. The error is at most half the difference between the two propagation times.
///
/// A frame that was late, or is a copy of an earlier one, makes the peer's clock look slow. Therefore the greatest of
/// the last few measurements counts.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ClockMap {
    /// The peer's clock minus ours in microseconds; the peer's clock wraps every 4 h 39 min.
    measured_us: VecDeque<i64>,
    at: Instant,
}

impl ClockMap {
    const KEPT: usize = 4;

    /// Takes the clock reading in a frame whose transmission began `ago` before `now`.
    pub fn measure(&mut self, clock_ms: u32, ago: Duration, now: Instant) {
        let began = (now - ago).as_micros() as i64;
        // Unwrapped near the known offset, so that a wrapped clock is not taken for a slow one.
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

    /// When the offset was last measured.
    pub fn measured_at(&self) -> Instant {
        self.at
    }

    /// Our time, nearest to `now`, at which the peer's clock showed `clock_ms`.
    pub fn to_ours(&self, clock_ms: u32, now: Instant) -> Instant {
        let theirs = Stamp::unwrap_clock(clock_ms, now.as_micros() as i64 + self.ahead_us());
        Instant::from_micros((theirs - self.ahead_us()).max(0) as u64)
    }

    /// The reading of the peer's clock at `at`: milliseconds, low 24 bits.
    pub fn to_theirs(&self, at: Instant) -> u32 {
        Stamp::clock(Instant::from_micros((at.as_micros() as i64 + self.ahead_us()).rem_euclid(1000 << 24) as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_convert_to_the_peers_clock_and_back() {
        let now = Instant::from_secs_f64(90_000.5);
        let mut map = ClockMap::default();
        map.measure(1_000, Duration::from_millis(500), now);
        map.measure(500, Duration::from_millis(200), now);
        let earlier = now - Duration::from_secs(60);
        assert_eq!(map.to_theirs(now), 1_500);
        assert_eq!(map.to_ours(map.to_theirs(earlier), now), earlier);
    }
}
