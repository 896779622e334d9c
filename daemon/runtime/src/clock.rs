//! Mission time of a process.

use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::UtcHours;
use std::time::{Duration, SystemTime};

/// The hour of the computer's clock; `None` where it is not set.
pub(crate) fn utc_hours() -> Option<UtcHours> {
    SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).ok().and_then(UtcHours::from_unix)
}

/// A monotonic clock that may run faster than wall time, for rehearsals. It goes on while the computer sleeps, so that ages include
/// the sleep; timers that passed meanwhile are due once.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    /// Time since the computer was switched on.
    began: Duration,
    /// The mission time at `began`.
    start: Instant,
    scale: f64,
}

impl Clock {
    /// A clock at zero that runs `scale` times as fast as wall time.
    pub fn new(scale: f64) -> Self {
        Self::starting_at(Instant::ZERO, scale)
    }

    /// A clock that now shows `start`.
    pub fn starting_at(start: Instant, scale: f64) -> Self {
        Self { began: since_boot(), start, scale }
    }

    pub fn now(&self) -> Instant {
        self.start + self.elapsed().mul_f64(self.scale)
    }

    fn elapsed(&self) -> Duration {
        since_boot().saturating_sub(self.began)
    }

    /// Mission time for each unit of wall time.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The mission time of a moment since the computer last slept; `None` before the clock began.
    pub fn at(&self, moment: std::time::Instant) -> Option<Instant> {
        // Its age comes first: time that passes between the two readings must not put it before the clock began.
        let age = moment.elapsed();
        Some(self.start + self.elapsed().checked_sub(age)?.mul_f64(self.scale))
    }

    /// The wall time of a mission time; now for one that has passed.
    pub fn wall(&self, at: Instant) -> tokio::time::Instant {
        tokio::time::Instant::now() + at.since(self.now()).div_f64(self.scale)
    }
}

/// Time since the computer was switched on, sleep included.
#[cfg(target_os = "linux")]
fn since_boot() -> Duration {
    let time = nix::time::clock_gettime(nix::time::ClockId::CLOCK_BOOTTIME);
    time.map_or_else(|_| since_start(), Duration::from)
}

#[cfg(not(target_os = "linux"))]
fn since_boot() -> Duration {
    since_start()
}

/// Time since the first call, without sleep: for a system that has no other clock.
fn since_start() -> Duration {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    START.elapsed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_has_the_time_that_the_clock_showed() {
        let before = std::time::Instant::now();
        let clock = Clock::starting_at(Instant::from_secs_f64(100.0), 1.0);
        let (moment, shown) = (std::time::Instant::now(), clock.now());
        let at = clock.at(moment).unwrap();
        assert!(shown.since(at).max(at.since(shown)) < Duration::from_secs(5), "{at:?} and {shown:?}");
        assert!(clock.at(before - Duration::from_secs(1)).is_none(), "before it began");
        assert!(clock.wall(Instant::ZERO) <= tokio::time::Instant::now(), "a time that has passed");
    }
}
