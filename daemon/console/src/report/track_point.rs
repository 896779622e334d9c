//! A place of a path.

use super::unix_s;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;

/// No vehicle is faster, m/s.
pub(super) const MAX_M_S: f64 = 3.0;
/// A reported place, metres in the world frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackPoint {
    pub(super) at_s: f64,
    pub(super) east_m: f64,
    pub(super) north_m: f64,
    pub(super) depth_m: f64,
    pub(super) sigma_m: f64,
}

/// The places of a path without those that a program began with before something measured one: a few, and then a jump.
pub(super) fn measured(mut path: Vec<TrackPoint>, mission_speed: f64) -> Vec<TrackPoint> {
    const FEW: usize = 3;
    let pairs = path.iter().zip(path.iter().skip(1)).take(FEW);
    let jump = pairs.enumerate().rfind(|(_, (a, b))| a.jumps_to(b, mission_speed));
    path.drain(..jump.map_or(0, |(n, _)| n + 1));
    path
}

impl TrackPoint {
    /// Whether no vehicle is so fast as it would have been from here to there. Times are of the wall clock.
    pub(super) fn jumps_to(&self, next: &Self, mission_speed: f64) -> bool {
        self.is_too_far(next, (next.at_s - self.at_s) * mission_speed, MAX_M_S)
    }

    /// Whether it is farther to another place than a vehicle of this speed gets in a mission time.
    pub(super) fn is_too_far(&self, next: &Self, time_s: f64, max_m_s: f64) -> bool {
        const JUMP_M: f64 = 5.0;
        let step_m = self.distance_m(next);
        step_m >= JUMP_M && step_m > max_m_s * time_s
    }

    pub(super) fn distance_m(&self, other: &Self) -> f64 {
        (other.east_m - self.east_m).hypot(other.north_m - self.north_m)
    }

    /// The place and the time a part of the way to another one.
    pub(super) fn towards(&self, other: &Self, part: f64) -> Self {
        let between = |from: f64, to: f64| from + (to - from) * part;
        Self {
            at_s: between(self.at_s, other.at_s),
            east_m: between(self.east_m, other.east_m),
            north_m: between(self.north_m, other.north_m),
            ..*self
        }
    }

    pub(super) fn is_known(&self) -> bool {
        [self.east_m, self.north_m].iter().all(|m| m.is_finite())
    }

    pub(super) fn of(message: &PoseWithCovarianceStamped) -> Self {
        let position = &message.pose.pose.position;
        Self {
            at_s: unix_s(&message.header.stamp),
            east_m: position.x,
            north_m: position.y,
            depth_m: -position.z,
            sigma_m: message.pose.covariance.first().map_or(f64::NAN, |variance| variance.sqrt()),
        }
    }
}
