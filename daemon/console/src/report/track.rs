//! The path of a vehicle, by its own record or by what it has reported.

use super::dive::DiveVehicle;
use super::words;
use scenecast_messages::geometry_msgs::PoseWithCovarianceStamped;

/// A reported place, metres in the world frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackPoint {
    pub(super) at_s: f64,
    pub(super) east_m: f64,
    pub(super) north_m: f64,
    pub(super) depth_m: f64,
    pub(super) sigma_m: f64,
}

impl TrackPoint {
    fn distance_m(&self, other: &Self) -> f64 {
        (other.east_m - self.east_m).hypot(other.north_m - self.north_m)
    }

    pub(super) fn is_known(&self) -> bool {
        [self.east_m, self.north_m].iter().all(|m| m.is_finite())
    }

    pub(super) fn of(message: &PoseWithCovarianceStamped) -> Self {
        let position = &message.pose.pose.position;
        Self {
            at_s: words::unix_s(&message.header.stamp),
            east_m: position.x,
            north_m: position.y,
            depth_m: -position.z,
            sigma_m: message.pose.covariance.first().map_or(f64::NAN, |variance| variance.sqrt()),
        }
    }
}

impl DiveVehicle {
    /// The places of its own record, or else those that it has reported.
    pub(super) fn path(&self) -> &[TrackPoint] {
        if self.own.track.len() > 1 { &self.own.track } else { &self.track }
    }

    /// The parts of its path between jumps: where its program began again with another place, or no vehicle is so fast.
    pub(super) fn legs(&self) -> impl Iterator<Item = &[TrackPoint]> {
        const JUMP_M: f64 = 5.0;
        const MAX_M_S: f64 = 3.0;
        let restarts = || self.own.runs_s.iter().skip(1).map(|(began_s, _)| *began_s);
        self.path().chunk_by(move |a, b| {
            let (step_m, time_s) = (a.distance_m(b), (b.at_s - a.at_s) * self.mission_speed);
            let began_between = restarts().any(|began_s| a.at_s < began_s && b.at_s >= began_s);
            step_m < 1.0 || !began_between && (step_m < JUMP_M || step_m <= MAX_M_S * time_s)
        })
    }

    /// The uncertainty of its position at a moment, seconds since 1970; `None` if no place of a minute about it is known.
    pub(super) fn sigma_m(&self, at_s: f64) -> Option<f64> {
        let near = self.path().iter().filter(|point| (point.at_s - at_s).abs() < 60.0 && point.sigma_m.is_finite());
        near.min_by(|a, b| (a.at_s - at_s).abs().total_cmp(&(b.at_s - at_s).abs())).map(|point| point.sigma_m)
    }

    /// Its speed while it moved, m/s, where its own record tells it. Times are of the wall clock, which the mission may be ahead of.
    pub(super) fn speed_m_s(&self) -> Option<f64> {
        const LEAST_M_S: f64 = 0.05;
        if self.own.track.len() < 2 {
            return None;
        }
        let steps = self.steps().map(|(a, b)| (a.distance_m(b), (b.at_s - a.at_s) * self.mission_speed));
        let moving = steps.filter(|(m, s)| *s > 0.0 && m / s >= LEAST_M_S);
        let (m, s) = moving.fold((0.0, 0.0), |sum, step| (sum.0 + step.0, sum.1 + step.1));
        (s > 0.0).then(|| m / s)
    }

    /// Length of its path, metres: at least so far, where only reports tell it.
    pub(super) fn distance_m(&self) -> f64 {
        self.steps().map(|(a, b)| a.distance_m(b)).sum()
    }

    /// The places after each other on its legs.
    fn steps(&self) -> impl Iterator<Item = (&TrackPoint, &TrackPoint)> {
        self.legs().flat_map(|leg| leg.iter().zip(leg.iter().skip(1)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::dive::OwnRecord;

    /// A vehicle that was at these places east of the origin, each a second of the clock after the one before.
    fn vehicle(east_m: &[f64], runs_s: &[(f64, f64)]) -> DiveVehicle {
        let place = |(n, east_m): (usize, &f64)| TrackPoint {
            at_s: n as f64,
            east_m: *east_m,
            north_m: 0.0,
            depth_m: 5.0,
            sigma_m: 1.0,
        };
        let track = east_m.iter().enumerate().map(place).collect();
        let mut vehicle = DiveVehicle::default();
        vehicle.own = OwnRecord { track, runs_s: runs_s.to_vec(), ..OwnRecord::default() };
        vehicle
    }

    #[test]
    fn jumps_are_no_part_of_the_path() {
        let told = |mut vehicle: DiveVehicle, mission_speed: f64| {
            vehicle.mission_speed = mission_speed;
            (vehicle.legs().count(), vehicle.distance_m(), vehicle.speed_m_s())
        };
        assert_eq!(told(vehicle(&[0.0, 1.0, 2.0, 30.0, 31.0], &[]), 1.0), (2, 3.0, Some(1.0)));
        assert_eq!(told(vehicle(&[0.0, 10.0, 20.0], &[]), 10.0), (1, 20.0, Some(1.0)), "ten times as fast");
        let runs = [(0.0, 1.0), (1.5, 3.0)];
        assert_eq!(told(vehicle(&[0.0, 1.0, 3.0, 4.0], &runs), 1.0), (2, 2.0, Some(1.0)), "its program began again");
        assert_eq!(told(vehicle(&[0.0, 0.0], &[]), 1.0), (1, 0.0, None));
        assert_eq!(told(vehicle(&[], &[]), 1.0), (0, 0.0, None));
    }
}
