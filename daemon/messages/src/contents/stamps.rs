//! Mission times as stamps of ROS 2, and names as parts of topics.

use crate::builtin_interfaces::Time;
use std::sync::Arc;

/// The times of day at which mission times were reached. What has happened keeps its stamp, however fast the mission is later.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stamps {
    now: Moment,
    /// In the order of mission time.
    moments: Arc<Vec<Moment>>,
    /// Seconds of mission time for each second of the clock, before the first moment and after the last.
    speed: f64,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Moment {
    mission_s: f64,
    /// The time of day at which `mission_s` was reached, nanoseconds since 1970.
    nanos: i64,
}

impl Stamps {
    /// Moments that are kept; of the older half every second one leaves when there are more.
    const MAX_MOMENTS: usize = 512;
    /// Time between two moments, nanoseconds.
    const INTERVAL: i64 = 1_000_000_000;

    /// Those of a mission of which no moment is known yet, and that is so many times as fast as the clock.
    pub fn with_speed(speed: f64) -> Self {
        Self { speed, ..Self::default() }
    }

    /// Those of a mission whose time is `now_s` at `nanos` since 1970.
    pub fn new(now_s: f64, speed: f64, nanos: i64) -> Self {
        let mut stamps = Self::with_speed(speed);
        stamps.observe(now_s, nanos);
        stamps
    }

    /// The mission time is `now_s` at `nanos` since 1970.
    pub fn observe(&mut self, now_s: f64, nanos: i64) {
        let moment = Moment { mission_s: now_s, nanos };
        let moments = Arc::make_mut(&mut self.moments);
        if now_s < self.now.mission_s {
            moments.clear();
        }
        self.now = moment;
        match moments.as_mut_slice() {
            // While the mission stands still, its time has a first moment and a last one.
            [.., first, last] if first.mission_s == now_s && last.mission_s == now_s => *last = moment,
            [.., last] if nanos.abs_diff(last.nanos) < Self::INTERVAL as u64 => {}
            _ => moments.push(moment),
        }
        if moments.len() > Self::MAX_MOMENTS {
            let mut index = 0;
            moments.retain(|_| {
                index += 1;
                index % 2 == 1 || index > Self::MAX_MOMENTS / 2
            });
        }
    }

    /// The same moments, seen from one of them.
    pub fn seen_at(&self, now_s: f64, nanos: i64) -> Self {
        Self { now: Moment { mission_s: now_s, nanos }, ..self.clone() }
    }

    /// The time of day at a mission time.
    pub fn at(&self, mission_s: f64) -> Time {
        let next = self.moments.partition_point(|moment| moment.mission_s < mission_s);
        let before = next.checked_sub(1).and_then(|last| self.moments.get(last));
        let after = self.moments.get(next).or(Some(&self.now).filter(|now| now.mission_s >= mission_s));
        let speed = self.speed.max(1e-3);
        let (known, since_s) = match (before, after) {
            (Some(before), Some(after)) if after.mission_s > before.mission_s => {
                let share = (mission_s - before.mission_s) / (after.mission_s - before.mission_s);
                (before, share * (after.nanos - before.nanos) as f64 / 1e9)
            }
            (None, Some(after)) => (after, (mission_s - after.mission_s) / speed),
            _ => (&self.now, (mission_s - self.now.mission_s) / speed),
        };
        Time::from_nanos(known.nanos.saturating_add((since_s * 1e9) as i64))
    }

    /// The time of day now.
    pub fn now(&self) -> Time {
        Time::from_nanos(self.now.nanos)
    }

    /// The mission time now, seconds.
    pub fn now_s(&self) -> f64 {
        self.now.mission_s
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

    const SECOND: i64 = 1_000_000_000;

    #[test]
    fn mission_times_become_times_of_day() {
        let stamps = Stamps::new(100.0, 2.0, 1000 * SECOND);
        assert_eq!(stamps.at(100.0), Time { sec: 1000, nanosec: 0 });
        assert_eq!(stamps.at(97.0), Time { sec: 998, nanosec: 500_000_000 });
        assert_eq!(stamps.at(102.0), Time { sec: 1001, nanosec: 0 });
    }

    #[test]
    fn a_stamp_stays_when_the_mission_slows_down_or_stops() {
        let mut stamps = Stamps::new(0.0, 20.0, 1000 * SECOND);
        let at = |second: i64| 1000 * SECOND + second * SECOND;
        (1..=10).for_each(|second| stamps.observe(20.0 * second as f64, at(second)));
        (11..=3000).for_each(|second| stamps.observe(200.0, at(second)));
        (1..=10).for_each(|second| stamps.observe(200.0 + second as f64, at(3000 + second)));
        let reached = [(50.0, 1002.5), (200.0, 1010.0), (205.0, 4005.0), (210.0, 4010.0)];
        for (mission_s, utc_s) in reached {
            assert_eq!(stamps.at(mission_s).nanos() as f64 / 1e9, utc_s, "{mission_s} s");
        }
    }

    #[test]
    fn a_long_mission_keeps_few_moments_and_its_stamps() {
        let mut stamps = Stamps::with_speed(1.0);
        (0..100_000).for_each(|second| stamps.observe(second as f64, second * SECOND));
        assert!(stamps.moments.len() <= Stamps::MAX_MOMENTS);
        for second in [0, 77, 40_000, 99_000] {
            assert_eq!(i64::from(stamps.at(second as f64).sec), second);
        }
    }
}
