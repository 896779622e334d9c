//! Mission times as stamps of ROS 2, and names as parts of topics.

use crate::builtin_interfaces::Time;

/// The time of day at a mission time.
#[derive(Debug, Clone, Default)]
pub struct Stamps {
    now_s: f64,
    /// Seconds of mission time for each second of the clock.
    speed: f64,
    /// Nanoseconds since 1970 at `now_s`.
    nanos: i64,
}

impl Stamps {
    /// Those of a mission whose time is `now_s` at `nanos` since 1970.
    pub fn new(now_s: f64, speed: f64, nanos: i64) -> Self {
        Self { now_s, speed: speed.max(1e-3), nanos }
    }

    /// The time of day at a mission time.
    pub fn at(&self, mission_s: f64) -> Time {
        let ago_s = (self.now_s - mission_s) / self.speed;
        Time::from_nanos(self.nanos.saturating_sub((ago_s * 1e9) as i64))
    }

    /// The time of day now.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.nanos)
    }

    /// The mission time now, seconds.
    pub fn now_s(&self) -> f64 {
        self.now_s
    }
}

/// A name for people as a part of a topic's name: `auv-1` becomes `auv_1`.
pub fn valid_part(name: &str) -> String {
    let part: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(64).collect();
    match part.chars().next() {
        Some(first) if !first.is_ascii_digit() => part,
        _ => format!("_{part}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mission_times_become_times_of_day() {
        let stamps = Stamps::new(100.0, 2.0, 1_000_000_000_000);
        assert_eq!(stamps.at(100.0), Time { sec: 1000, nanosec: 0 });
        assert_eq!(stamps.at(97.0), Time { sec: 998, nanosec: 500_000_000 });
    }
}
