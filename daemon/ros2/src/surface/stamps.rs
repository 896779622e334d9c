//! Mission times as stamps of ROS 2.

use scenecast_console::state::MissionState;
use scenecast_messages::builtin_interfaces::Time;
use std::time::{SystemTime, UNIX_EPOCH};

/// The time of day at a mission time.
#[derive(Debug, Clone, Default)]
pub(super) struct Stamps {
    now_s: f64,
    /// Seconds of mission time for each second of the clock.
    speed: f64,
    /// Nanoseconds since 1970 at `now_s`.
    nanos: i64,
}

pub(super) fn nanos(time: SystemTime) -> i64 {
    time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as i64)
}

impl Stamps {
    /// Those of a state that is of now.
    pub fn new(state: &MissionState) -> Self {
        Self { now_s: state.now_s, speed: state.mission.speed.max(1e-3), nanos: nanos(SystemTime::now()) }
    }

    pub fn at(&self, mission_s: f64) -> Time {
        let ago_s = (self.now_s - mission_s) / self.speed;
        Time::from_nanos(self.nanos.saturating_sub((ago_s * 1e9) as i64))
    }

    pub fn now(&self) -> Time {
        Time::from_nanos(self.nanos)
    }

    pub fn now_s(&self) -> f64 {
        self.now_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mission_times_become_times_of_day() {
        let stamps = Stamps { now_s: 100.0, speed: 2.0, nanos: 1_000_000_000_000 };
        assert_eq!(stamps.at(100.0), Time { sec: 1000, nanosec: 0 });
        assert_eq!(stamps.at(97.0), Time { sec: 998, nanosec: 500_000_000 });
    }
}
