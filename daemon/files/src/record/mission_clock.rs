//! The mission times that a record of the surface tells.

use serde::Deserialize;

/// The mission time at each state that the page showed.
#[derive(Debug, Default, Clone)]
pub struct MissionClock {
    /// In the order of the surface's clock.
    states: Vec<ClockState>,
}

#[derive(Debug, Clone, Copy)]
struct ClockState {
    nanos: u64,
    now_s: f64,
    /// Seconds of mission time for each second of the clock.
    speed: f64,
}

/// The part of a state that has its time.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct StateTime {
    pub now_s: f64,
    pub mission: MissionSpeed,
}

/// Seconds of mission time for each second of the clock.
#[derive(Debug, Clone, Copy, Deserialize)]
pub struct MissionSpeed {
    pub speed: f64,
}

impl StateTime {
    /// Reads it from a state in JSON; `None` if it is none.
    pub fn of_json(text: &str) -> Option<Self> {
        serde_json::from_str(text).ok()
    }
}

impl MissionClock {
    /// Takes the time of a state, which was recorded at `nanos` since 1970. States may come in any order.
    pub fn take(&mut self, nanos: u64, StateTime { now_s, mission }: StateTime) {
        let at = self.states.partition_point(|state| state.nanos <= nanos);
        self.states.insert(at, ClockState { nanos, now_s, speed: mission.speed.max(1e-3) });
    }

    /// Adds the states of another record.
    pub fn add(&mut self, other: &Self) {
        self.states.extend(&other.states);
        self.states.sort_by_key(|state| state.nanos);
    }

    /// The mission time at a moment of the surface's clock, seconds; `None` if no state tells it.
    pub fn mission_s(&self, nanos: u64) -> Option<f64> {
        let next = self.next(nanos);
        let state = self.states.get(next.saturating_sub(1))?;
        let since_s = (i128::from(nanos) - i128::from(state.nanos)) as f64 / 1e9;
        let next_s = self.states.get(next.max(1)).map_or(f64::INFINITY, |later| later.now_s);
        Some((state.now_s + since_s * state.speed).min(next_s.max(state.now_s)).max(0.0))
    }

    /// The moment of the surface's clock at a mission time; `None` if no state tells it.
    pub fn nanos(&self, at_s: f64) -> Option<u64> {
        let next = self.states.partition_point(|state| state.now_s <= at_s);
        let state = self.states.get(next.saturating_sub(1))?;
        let since = ((at_s - state.now_s) / state.speed * 1e9) as i64;
        let latest = self.states.get(next.max(1)).map_or(u64::MAX, |later| later.nanos.max(state.nanos));
        Some(state.nanos.saturating_add_signed(since).min(latest))
    }

    /// Mission times in seconds and the nanoseconds since 1970 at which they were shown.
    pub fn moments(&self) -> impl Iterator<Item = (f64, u64)> {
        self.states.iter().map(|state| (state.now_s, state.nanos))
    }

    /// Seconds of mission time for each second of the clock at a moment; 1 if no state tells it.
    pub fn speed(&self, nanos: u64) -> f64 {
        // That of the last state up to it, or else of the first.
        self.states.get(self.next(nanos).saturating_sub(1)).map_or(1.0, |state| state.speed)
    }

    /// The place of the first state after a moment.
    fn next(&self, nanos: u64) -> usize {
        self.states.partition_point(|state| state.nanos <= nanos)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mission_times_follow_the_states_and_reach_beyond_them() {
        let mut clock = MissionClock::default();
        assert_eq!(clock.mission_s(5), None);
        let state = |now_s: f64, speed: f64| {
            StateTime::of_json(&format!(r#"{{"now_s":{now_s},"mission":{{"speed":{speed}}}}}"#)).unwrap()
        };
        clock.take(20_000_000_000, state(100.0, 4.0));
        clock.take(10_000_000_000, state(80.0, 2.0));
        assert!(StateTime::of_json("{}").is_none());
        let at = |s: u64| clock.mission_s(s * 1_000_000_000);
        assert_eq!([5, 15, 20, 25].map(at), [70.0, 90.0, 100.0, 120.0].map(Some));
        assert_eq!(clock.speed(30_000_000_000), 4.0);
        let back = |at_s| clock.nanos(at_s).map(|nanos| nanos / 1_000_000_000);
        assert_eq!([70.0, 90.0, 120.0].map(back), [5, 15, 25].map(Some));
    }
}
