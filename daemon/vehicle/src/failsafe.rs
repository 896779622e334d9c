//! The conditions under which the vehicle leaves its survey: by an order, or by itself.

use crate::planning::{Point, distance};
use scenecast_protocol::directive::{Constraints, Limits, Reaction};
use scenecast_protocol::time::Instant;
use scenecast_protocol::wire::ModeReason;
use std::time::Duration;

/// The configured policy, which applies where the operator's limits have no value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FailsafePolicy {
    pub on_silence: Reaction,
    /// Outside the fence or the depth band.
    pub on_breach: Reaction,
    pub on_abort: Reaction,
    /// Allowed silence of the surface, seconds; infinite: any.
    pub silence_s: f64,
    /// Speed over ground in metres a second, by which a time becomes a distance.
    pub speed_m_s: f64,
    /// Altitude above the sea floor that the vehicle keeps, metres.
    pub altitude_m: f64,
}

impl Default for FailsafePolicy {
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

/// The reaction that takes the place of the survey, and its reason.
pub type Stop = (Reaction, ModeReason);

/// Tells a vehicle that has left its fence from a position that has jumped out of it. One that is back within two seconds is no breach.
#[derive(Debug, Clone, Copy, Default)]
struct FenceWatch {
    /// The last place inside, and when the vehicle was there.
    inside: Option<(Point, Instant)>,
    outside_since: Option<Instant>,
}

impl FenceWatch {
    /// A position that stays outside for this time is right, however it came there.
    const PERSISTS: Duration = Duration::from_secs(2);
    /// A step of the position that is no jump, metres.
    const MARGIN_M: f64 = 0.5;

    /// Whether a position outside is a breach, because the vehicle could have travelled there or because it stays.
    fn is_breach(&mut self, at: Point, is_inside: bool, speed_m_s: f64, now: Instant) -> bool {
        if is_inside {
            *self = Self { inside: Some((at, now)), outside_since: None };
            return false;
        }
        let is_first = self.outside_since.is_none();
        let since = *self.outside_since.get_or_insert(now);
        let is_jump = self.inside.is_none_or(|(from, then)| {
            let reach_m = Self::MARGIN_M + 2.0 * speed_m_s * now.since(then).as_secs_f64();
            distance(from, at) > reach_m
        });
        if let Some((from, _)) = self.inside.filter(|_| is_jump && is_first) {
            tracing::warn!(
                "the position jumps out of the fence, from ({:.1}, {:.1}) m to ({:.1}, {:.1}) m: a breach if it stays for {} s",
                from.0,
                from.1,
                at.0,
                at.1,
                Self::PERSISTS.as_secs()
            );
        }
        !is_jump || now.since(since) >= Self::PERSISTS
    }
}

/// Watches limits, silence and breaches.
#[derive(Debug)]
pub struct Failsafe {
    policy: FailsafePolicy,
    pub limits: Limits,
    pub order: Constraints,
    /// Metres travelled since the limits were put in force.
    pub used_m: f64,
    pub used_s: f64,
    /// A breach until the operator's next order or fence, or a silence after which the vehicle has surfaced.
    pub latched: ModeReason,
    last_received: Instant,
    pub now: Instant,
    fence: FenceWatch,
    /// The limits are used up but for the return path.
    is_used_up: bool,
}

/// A return path may become shorter on the way by as much, because it follows the lattice, metres: the vehicle goes on with it.
const SHORTER_M: f64 = 10.0;

/// The share of the limits that is kept in reserve for errors of the estimate.
const RESERVE: f64 = 0.03;

impl Failsafe {
    /// Starts at `now`, as if a frame of the surface had been received then.
    pub fn new(policy: FailsafePolicy, now: Instant) -> Self {
        let (limits, order, latched) = (Limits::default(), Constraints::default(), ModeReason::Survey);
        Self {
            policy,
            limits,
            order,
            used_m: 0.0,
            used_s: 0.0,
            latched,
            last_received: now,
            now,
            fence: FenceWatch::default(),
            is_used_up: false,
        }
    }

    pub fn handle_time(&mut self, now: Instant) {
        self.used_s += now.since(self.now).as_secs_f64();
        self.now = now;
    }

    pub fn handle_travel(&mut self, metres: f64) {
        self.used_m += metres;
    }

    /// Speed over ground that the vehicle keeps, metres a second.
    pub fn speed_m_s(&self) -> f64 {
        self.policy.speed_m_s
    }

    /// The link received a frame of the surface.
    pub fn handle_received(&mut self, at: Instant) {
        self.last_received = self.last_received.max(at);
    }

    /// The vehicle is at a place, in metres east and north in the world frame, inside its fence or outside.
    pub fn handle_position(&mut self, at: Point, is_inside: bool) {
        if self.fence.is_breach(at, is_inside, self.policy.speed_m_s, self.now) {
            self.handle_breach(ModeReason::Fence);
        }
    }

    /// The vehicle is outside its fence or depth band.
    pub fn handle_breach(&mut self, why: ModeReason) {
        if self.latched == ModeReason::Survey {
            self.latched = why;
        }
    }

    /// The operator has answered a breach.
    pub fn clear_breach(&mut self) {
        self.latched = ModeReason::Survey;
    }

    /// Puts limits in force; distance and time count from zero.
    pub fn set_limits(&mut self, limits: Limits) {
        (self.limits, self.used_m, self.used_s, self.is_used_up) = (limits, 0.0, 0.0, false);
    }

    /// Whether the depth is outside its band.
    pub fn is_band_broken(&self, depth_m: f64) -> bool {
        self.limits.depth.is_some_and(|band| !band.contains(depth_m))
    }

    /// Whether the vehicle keeps these limits at its depth and altitude.
    pub fn is_able(&self, limits: &Limits, depth_m: f64) -> bool {
        limits.depth.is_none_or(|b| b.contains(depth_m))
            && limits.altitude.is_none_or(|b| b.contains(self.policy.altitude_m))
    }

    /// Metres that may still be travelled, the return path included.
    pub fn left_m(&self) -> f64 {
        self.left_of_distance().min(self.left_of_time())
    }

    fn left_of_distance(&self) -> f64 {
        self.limits.distance_m.map_or(f64::INFINITY, |m| f64::from(m) * (1.0 - RESERVE) - self.used_m)
    }

    fn left_of_time(&self) -> f64 {
        let left_s = |s: u32| f64::from(s) * (1.0 - RESERVE) - self.used_s;
        self.limits.time_s.map_or(f64::INFINITY, |s| left_s(s) * self.policy.speed_m_s)
    }

    /// The reason to report when the tighter of the two limits is used up.
    pub fn tighter(&self) -> ModeReason {
        if self.left_of_time() < self.left_of_distance() { ModeReason::Time } else { ModeReason::Distance }
    }

    /// The reaction that takes the place of the survey, if one is due. `home_m` is the length
    /// of the return path, metres.
    pub fn stop(&mut self, home_m: f64) -> Option<Stop> {
        let silence_s = self.limits.silence_s.map_or(self.policy.silence_s, f64::from);
        let on_silence = self.limits.on_silence.unwrap_or(self.policy.on_silence);
        let silent = self.now.since(self.last_received).as_secs_f64() > silence_s;
        if silent && on_silence == Reaction::Surface {
            // It stays at the surface when frames are received again, because ships may be above.
            self.handle_breach(ModeReason::Silence);
        }
        if self.order.abort {
            return Some((self.limits.on_abort.unwrap_or(self.policy.on_abort), ModeReason::Order));
        }
        match self.latched {
            ModeReason::Survey => {}
            ModeReason::Silence => return Some((Reaction::Surface, ModeReason::Silence)),
            why => return Some((self.limits.on_breach.unwrap_or(self.policy.on_breach), why)),
        }
        if silent {
            return Some((on_silence, ModeReason::Silence));
        }
        if self.order.hold {
            return Some((Reaction::Hold, ModeReason::Order));
        }
        let more_m = if self.is_used_up { SHORTER_M } else { 0.0 };
        self.is_used_up = self.left_m() <= (home_m + more_m).min(f64::MAX);
        self.is_used_up.then(|| (Reaction::Return, self.tighter()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(s)
    }

    #[test]
    fn a_return_that_becomes_a_little_shorter_goes_on() {
        let mut failsafe = Failsafe::new(FailsafePolicy::default(), at(0.0));
        let limits = Limits { distance_m: Some(100), ..Limits::default() };
        failsafe.set_limits(limits);
        failsafe.handle_travel(60.0);
        let is_returning = |failsafe: &mut Failsafe, home_m| failsafe.stop(home_m).is_some();
        assert!(!is_returning(&mut failsafe, 36.0) && is_returning(&mut failsafe, 37.0));
        assert!(is_returning(&mut failsafe, 35.0) && is_returning(&mut failsafe, 27.5));
        assert!(!is_returning(&mut failsafe, 20.0), "the operator has moved the return point");
        assert!(is_returning(&mut failsafe, 40.0));
        failsafe.set_limits(limits);
        assert!(!is_returning(&mut failsafe, 40.0));
    }

    #[test]
    fn silence_triggers_the_policy_until_the_surface_is_received() {
        let mut failsafe = Failsafe::new(FailsafePolicy::default(), at(0.0));
        failsafe.set_limits(Limits { silence_s: Some(60), on_silence: Some(Reaction::Hold), ..Limits::default() });
        failsafe.handle_time(at(60.0));
        assert_eq!(failsafe.stop(0.0), None);
        failsafe.handle_time(at(61.0));
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Hold, ModeReason::Silence)));
        failsafe.handle_received(at(61.0));
        assert_eq!(failsafe.stop(0.0), None);
    }

    #[test]
    fn a_vehicle_surfaced_by_silence_waits_for_an_order() {
        let mut failsafe = Failsafe::new(
            FailsafePolicy { silence_s: 60.0, on_silence: Reaction::Surface, ..FailsafePolicy::default() },
            at(0.0),
        );
        failsafe.handle_time(at(61.0));
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Surface, ModeReason::Silence)));
        failsafe.handle_received(at(62.0));
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Surface, ModeReason::Silence)));
        failsafe.clear_breach();
        assert_eq!(failsafe.stop(0.0), None);
    }

    #[test]
    fn an_abort_precedes_a_breach_and_a_breach_precedes_a_hold() {
        let mut failsafe = Failsafe::new(FailsafePolicy::default(), at(0.0));
        failsafe.order = Constraints { hold: true, abort: false };
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Hold, ModeReason::Order)));
        failsafe.handle_breach(ModeReason::Fence);
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Return, ModeReason::Fence)));
        failsafe.order.abort = true;
        assert_eq!(failsafe.stop(0.0), Some((Reaction::Surface, ModeReason::Order)));
    }

    #[test]
    fn distance_and_time_are_reserved_for_the_return_path() {
        let mut failsafe = Failsafe::new(FailsafePolicy::default(), at(0.0));
        failsafe.set_limits(Limits { distance_m: Some(1000), time_s: Some(1000), ..Limits::default() });
        assert_eq!(failsafe.tighter(), ModeReason::Time, "a thousand seconds are five hundred metres");
        failsafe.handle_travel(900.0);
        assert_eq!(failsafe.stop(80.0), Some((Reaction::Return, ModeReason::Distance)));
        assert_eq!(failsafe.stop(10.0), None);
        failsafe.handle_time(at(960.0));
        assert_eq!(failsafe.stop(10.0), Some((Reaction::Return, ModeReason::Time)));
    }
}
