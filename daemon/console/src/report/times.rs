//! Times of a dive in words: those of the clock, and of the mission where it was played at another speed.

use super::dive::Dive;
use super::seconds;
use super::words::duration;

/// Whether a mission of this speed is not as fast as the clock.
pub(super) fn is_scaled(mission_speed: f64) -> bool {
    (mission_speed - 1.0).abs() > 0.01
}

impl Dive {
    /// A time span of the record as mission time, seconds: the mission may run faster than the clock.
    pub(super) fn mission_s(&self, span_s: f64) -> f64 {
        span_s * self.state.mission.speed
    }

    /// The moment of a mission time, seconds since 1970.
    pub(super) fn unix_s(&self, at_s: f64) -> f64 {
        self.clock.nanos(at_s).map_or(self.span_s.1, seconds)
    }

    /// Whether the mission had another speed than the clock.
    pub(super) fn is_scaled(&self) -> bool {
        is_scaled(self.state.mission.speed)
    }

    /// A time span of the clock for people.
    pub(super) fn lasted(&self, span_s: f64) -> String {
        self.with_mission(span_s, duration)
    }

    /// The same with tenths of a second.
    pub(super) fn lasted_tenths(&self, span_s: f64) -> String {
        self.with_mission(span_s, |s| format!("{s:.1} s"))
    }

    /// A time span of the mission for people.
    pub(super) fn mission_lasted(&self, mission_s: f64) -> String {
        self.lasted(mission_s / self.state.mission.speed)
    }

    fn with_mission(&self, span_s: f64, told: impl Fn(f64) -> String) -> String {
        match self.is_scaled() {
            true => format!("{} ({} of the mission)", told(span_s), told(self.mission_s(span_s))),
            false => told(span_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mission_time_stands_beside_that_of_the_clock() {
        let mut dive = Dive::default();
        dive.state.mission.speed = 3.0;
        assert_eq!(dive.lasted(21.0), "21 s (63 s of the mission)");
        assert_eq!(dive.lasted_tenths(0.1), "0.1 s (0.3 s of the mission)");
        assert_eq!(dive.mission_lasted(63.0), dive.lasted(21.0));
        dive.state.mission.speed = 1.0;
        assert_eq!(dive.lasted(21.0), "21 s");
    }
}
