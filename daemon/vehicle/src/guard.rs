//! When the vehicle stops following its survey, of its own accord or because it is told to.

use scenecast_protocol::directive::{Constraints, Limits, Reaction};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::ModeReason;

/// What the vehicle does where the operator's limits say nothing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Habits {
    pub on_silence: Reaction,
    /// Outside the fence or a band.
    pub on_breach: Reaction,
    pub on_abort: Reaction,
    /// Seconds of silence that are allowed; infinite: any.
    pub silence_s: f64,
    /// Speed over ground, metres a second, to reckon the time of a way.
    pub speed_m_s: f64,
    /// Height at which it flies, metres above the sea floor.
    pub altitude_m: f64,
}

impl Default for Habits {
    fn default() -> Self {
        Self {
            on_silence: Reaction::Return,
            on_breach: Reaction::Return,
            on_abort: Reaction::Surface,
            silence_s: f64::INFINITY,
            speed_m_s: 0.5,
            altitude_m: 4.0,
        }
    }
}

/// What is done instead of the survey, and why.
pub type Stop = (Reaction, ModeReason);

/// Watches over limits, silence and breaches.
#[derive(Debug)]
pub struct Guard {
    habits: Habits,
    pub limits: Limits,
    pub order: Constraints,
    /// Metres gone since the limits are in force.
    pub used_m: f64,
    pub used_s: f64,
    /// A breach, until the operator's next order or fence; silence that made the vehicle come up.
    pub latched: ModeReason,
    last_received: Instant,
    now: Instant,
}

/// Part of the limits kept back for what the reckoning misses.
const RESERVE: f64 = 0.03;

impl Guard {
    /// Watches from `now`; the surface counts as last_received then.
    pub fn new(habits: Habits, now: Instant) -> Self {
        let (limits, order, latched) = (Limits::default(), Constraints::default(), ModeReason::Survey);
        Self { habits, limits, order, used_m: 0.0, used_s: 0.0, latched, last_received: now, now }
    }

    pub fn handle_time(&mut self, now: Instant) {
        self.used_s += now.since(self.now).as_secs_f64();
        self.now = now;
    }

    /// The vehicle went so far.
    pub fn handle_travel(&mut self, metres: f64) {
        self.used_m += metres;
    }

    /// Speed over ground at which it flies, metres a second.
    pub fn speed_m_s(&self) -> f64 {
        self.habits.speed_m_s
    }

    /// A frame of the surface was taken.
    pub fn handle_received(&mut self, at: Instant) {
        self.last_received = self.last_received.max(at);
    }

    /// The vehicle is outside of where it may be.
    pub fn handle_breach(&mut self, why: ModeReason) {
        if self.latched == ModeReason::Survey {
            self.latched = why;
        }
    }

    /// The operator has decided anew.
    pub fn clear_breach(&mut self) {
        self.latched = ModeReason::Survey;
    }

    /// New limits: distance and time count afresh.
    pub fn set_limits(&mut self, limits: Limits) {
        (self.limits, self.used_m, self.used_s) = (limits, 0.0, 0.0);
    }

    /// Whether the depth is outside its band.
    pub fn is_band_broken(&self, depth_m: f64) -> bool {
        self.limits.depth.is_some_and(|band| !band.contains(depth_m))
    }

    /// Whether the vehicle flies as these limits demand.
    pub fn is_able(&self, limits: &Limits, depth_m: f64) -> bool {
        limits.depth.is_none_or(|b| b.contains(depth_m))
            && limits.altitude.is_none_or(|b| b.contains(self.habits.altitude_m))
    }

    /// Metres that may still be gone, the way home included.
    pub fn left_m(&self) -> f64 {
        self.left_of_distance().min(self.left_of_time())
    }

    fn left_of_distance(&self) -> f64 {
        self.limits.distance_m.map_or(f64::INFINITY, |m| f64::from(m) * (1.0 - RESERVE) - self.used_m)
    }

    fn left_of_time(&self) -> f64 {
        let left_s = |s: u32| f64::from(s) * (1.0 - RESERVE) - self.used_s;
        self.limits.time_s.map_or(f64::INFINITY, |s| left_s(s) * self.habits.speed_m_s)
    }

    /// Which of the limits is the tighter one.
    pub fn tighter(&self) -> ModeReason {
        if self.left_of_time() < self.left_of_distance() { ModeReason::Time } else { ModeReason::Distance }
    }

    /// What is to be done instead of the survey, if anything; `home_m` is the way home.
    pub fn stop(&mut self, home_m: f64) -> Option<Stop> {
        let silence_s = self.limits.silence_s.map_or(self.habits.silence_s, f64::from);
        let on_silence = self.limits.on_silence.unwrap_or(self.habits.on_silence);
        let silent = self.now.since(self.last_received).as_secs_f64() > silence_s;
        if silent && on_silence == Reaction::Surface {
            // It does not dive again because somebody is last_received: up there are ships.
            self.handle_breach(ModeReason::Silence);
        }
        if self.order.abort {
            return Some((self.limits.on_abort.unwrap_or(self.habits.on_abort), ModeReason::Order));
        }
        match self.latched {
            ModeReason::Survey => {}
            ModeReason::Silence => return Some((Reaction::Surface, ModeReason::Silence)),
            why => return Some((self.limits.on_breach.unwrap_or(self.habits.on_breach), why)),
        }
        if silent {
            return Some((on_silence, ModeReason::Silence));
        }
        if self.order.hold {
            return Some((Reaction::Hold, ModeReason::Order));
        }
        (self.left_m() <= home_m.min(f64::MAX)).then(|| (Reaction::Return, self.tighter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(s)
    }

    #[test]
    fn silence_triggers_the_policy_until_the_surface_is_received() {
        let mut guard = Guard::new(Habits::default(), at(0.0));
        guard.set_limits(Limits { silence_s: Some(60), on_silence: Some(Reaction::Hold), ..Limits::default() });
        guard.handle_time(at(60.0));
        assert_eq!(guard.stop(0.0), None);
        guard.handle_time(at(61.0));
        assert_eq!(guard.stop(0.0), Some((Reaction::Hold, ModeReason::Silence)));
        guard.handle_received(at(61.0));
        assert_eq!(guard.stop(0.0), None);
    }

    #[test]
    fn a_vehicle_surfaced_by_silence_waits_for_an_order() {
        let mut guard =
            Guard::new(Habits { silence_s: 60.0, on_silence: Reaction::Surface, ..Habits::default() }, at(0.0));
        guard.handle_time(at(61.0));
        assert_eq!(guard.stop(0.0), Some((Reaction::Surface, ModeReason::Silence)));
        guard.handle_received(at(62.0));
        assert_eq!(guard.stop(0.0), Some((Reaction::Surface, ModeReason::Silence)));
        guard.clear_breach();
        assert_eq!(guard.stop(0.0), None);
    }

    #[test]
    fn an_abort_goes_before_a_breach_and_a_breach_before_a_hold() {
        let mut guard = Guard::new(Habits::default(), at(0.0));
        guard.order = Constraints { hold: true, abort: false };
        assert_eq!(guard.stop(0.0), Some((Reaction::Hold, ModeReason::Order)));
        guard.handle_breach(ModeReason::Fence);
        assert_eq!(guard.stop(0.0), Some((Reaction::Return, ModeReason::Fence)));
        guard.order.abort = true;
        assert_eq!(guard.stop(0.0), Some((Reaction::Surface, ModeReason::Order)));
    }

    #[test]
    fn the_way_home_is_kept_of_distance_and_time() {
        let mut guard = Guard::new(Habits::default(), at(0.0));
        guard.set_limits(Limits { distance_m: Some(1000), time_s: Some(1000), ..Limits::default() });
        assert_eq!(guard.tighter(), ModeReason::Time, "a thousand seconds are five hundred metres");
        guard.handle_travel(900.0);
        assert_eq!(guard.stop(80.0), Some((Reaction::Return, ModeReason::Distance)));
        assert_eq!(guard.stop(10.0), None);
        guard.handle_time(at(960.0));
        assert_eq!(guard.stop(10.0), Some((Reaction::Return, ModeReason::Time)));
    }
}
