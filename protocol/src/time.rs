//! Time as an argument; the crate reads no clock.

use std::ops::{Add, Sub};
use std::time::Duration;

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
