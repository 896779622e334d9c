//! Time as an argument: the crate reads no clock. Also an estimate of the peer's clock relative to ours.

use std::collections::VecDeque;
use std::ops::{Add, Sub};
use std::time::Duration;

/// Bits of a clock reading in milliseconds; it wraps every 4 h 39 min.
const CLOCK_BITS: u32 = 24;

/// A moment on the host's monotonic clock, in microseconds since any fixed origin of the host's choosing.
///
/// ```
/// use scenecast_protocol::time::Instant;
/// use std::time::Duration;
///
/// let start = Instant::from_secs_f64(1.5);
/// assert_eq!((start + Duration::from_millis(250)).as_micros(), 1_750_000);
/// assert_eq!(Instant::ZERO.since(start), Duration::ZERO, "a later moment");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Instant(u64);

impl Instant {
    /// The origin of the host's clock.
    pub const ZERO: Self = Self(0);

    /// The moment `micros` microseconds after the origin.
    pub const fn from_micros(micros: u64) -> Self {
        Self(micros)
    }

    /// The moment `seconds` seconds after the origin; negative or non-finite values yield the origin.
    pub fn from_secs_f64(seconds: f64) -> Self {
        Self((seconds * 1e6).round() as u64)
    }

    /// The time since the origin in microseconds.
    pub const fn as_micros(self) -> u64 {
        self.0
    }

    /// The time since the origin in seconds.
    pub fn as_secs_f64(self) -> f64 {
        self.0 as f64 / 1e6
    }

    /// The reading of a clock in a stamp: milliseconds, low 24 bits.
    pub(crate) fn clock_ms(self) -> u32 {
        (self.0 / 1000) as u32 & ((1 << CLOCK_BITS) - 1)
    }

    /// Time since `earlier`, zero if it lies in the future.
    #[must_use]
    pub fn since(self, earlier: Self) -> Duration {
        Duration::from_micros(self.0.saturating_sub(earlier.0))
    }
}

impl From<Duration> for Instant {
    /// Rounds up, so that anything due at the given time is due at the instant.
    fn from(since_origin: Duration) -> Self {
        Self(since_origin.as_nanos().div_ceil(1000) as u64)
    }
}

impl From<Instant> for Duration {
    fn from(at: Instant) -> Self {
        Self::from_micros(at.0)
    }
}

impl Add<Duration> for Instant {
    type Output = Self;
    fn add(self, d: Duration) -> Self {
        Self(self.0.saturating_add(d.as_micros() as u64))
    }
}

impl Sub<Duration> for Instant {
    type Output = Self;
    fn sub(self, d: Duration) -> Self {
        Self(self.0.saturating_sub(d.as_micros() as u64))
    }
}

/// The time in microseconds by the clock that showed `clock_ms`, as near to `near_us` as possible.
fn unwrap_clock(clock_ms: u32, near_us: i64) -> i64 {
    let turn = 1_000_i64 << CLOCK_BITS;
    let at = i64::from(clock_ms) * 1000;
    let turns = (near_us - at + turn / 2).div_euclid(turn);
    at + turns * turn
}

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
        self.measured_us.push_back(unwrap_clock(clock_ms, near) - began);
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
        let theirs = unwrap_clock(clock_ms, now.as_micros() as i64 + self.ahead_us());
        Instant::from_micros((theirs - self.ahead_us()).max(0) as u64)
    }

    /// The reading of the peer's clock at `at`: milliseconds, low 24 bits.
    pub fn to_theirs(&self, at: Instant) -> u32 {
        Instant::from_micros((at.as_micros() as i64 + self.ahead_us()).rem_euclid(1000 << 24) as u64).clock_ms()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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

    proptest! {
        #[test]
        fn a_clock_unwraps_to_the_nearest_moment(at in 0u64..1 << 50, drift_us in -8_000_000_000i64..8_000_000_000) {
            let shown = Instant::from_micros(at).clock_ms();
            let near = at as i64 + drift_us;
            prop_assert_eq!(unwrap_clock(shown, near), at as i64 / 1000 * 1000);
        }
    }
}
