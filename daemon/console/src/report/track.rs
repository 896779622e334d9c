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
    fn jumps_to(&self, next: &Self, mission_speed: f64) -> bool {
        const JUMP_M: f64 = 5.0;
        const MAX_M_S: f64 = 3.0;
        let (step_m, time_s) = (self.distance_m(next), (next.at_s - self.at_s) * mission_speed);
        step_m >= JUMP_M && step_m > MAX_M_S * time_s
    }

    pub(super) fn distance_m(&self, other: &Self) -> f64 {
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
        let is_own = self.own.track.len() > 1;
        let own = self.own.runs_s.iter().skip(1).map(|(began_s, _)| *began_s);
        let restarts: Vec<f64> = if is_own { own.collect() } else { self.restarts_s.clone() };
        self.path().chunk_by(move |a, b| {
            let began_between = restarts.iter().any(|began_s| a.at_s < *began_s && b.at_s >= *began_s);
            a.distance_m(b) < 1.0 || !began_between && !a.jumps_to(b, self.mission_speed)
        })
    }

    /// The places before and after each of these jumps.
    pub(super) fn jumps(&self) -> impl Iterator<Item = (&TrackPoint, &TrackPoint)> {
        self.legs().zip(self.legs().skip(1)).filter_map(|(before, after)| before.last().zip(after.first()))
    }

    /// The uncertainty of its position at a moment, seconds since 1970; `None` if no place of a minute about it is known.
    pub(super) fn sigma_m(&self, at_s: f64) -> Option<f64> {
        let near = self.path().iter().filter(|point| (point.at_s - at_s).abs() < 60.0 && point.sigma_m.is_finite());
        near.min_by(|a, b| (a.at_s - at_s).abs().total_cmp(&(b.at_s - at_s).abs())).map(|point| point.sigma_m)
    }

    /// Whether something measured the uncertainty of its place, which stays as it began otherwise.
    pub(super) fn measures_sigma(&self) -> bool {
        const FEW: usize = 9;
        let sigmas = self.path().iter().map(|point| point.sigma_m).filter(|sigma_m| sigma_m.is_finite());
        let (least_m, most_m) =
            sigmas.fold((f64::INFINITY, 0.0), |(least, most): (f64, f64), m| (least.min(m), most.max(m)));
        self.own.track.len() <= FEW || most_m - least_m >= 0.005
    }

    /// Its speed while it moved, m/s, where its own record tells it. Times are of the wall clock, which the mission may be ahead of.
    pub(super) fn speed_m_s(&self) -> Option<f64> {
        const LEAST_M_S: f64 = 0.05;
        // A record may have each place more than once.
        const SPAN_S: f64 = 10.0;
        if self.own.track.len() < 2 {
            return None;
        }
        let (mut moved, mut span, mut total_s) = ((0.0, 0.0), (0.0, 0.0), 0.0);
        for (a, b) in self.steps() {
            let step_s = (b.at_s - a.at_s) * self.mission_speed;
            total_s += step_s;
            span = (span.0 + a.distance_m(b), span.1 + step_s);
            if span.1 >= SPAN_S {
                if span.0 / span.1 >= LEAST_M_S {
                    moved = (moved.0 + span.0, moved.1 + span.1);
                }
                span = (0.0, 0.0);
            }
        }
        // A path may be shorter than a span.
        let (m, s) = if total_s >= SPAN_S { moved } else { span };
        (s > 0.0 && m / s >= LEAST_M_S).then(|| m / s)
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
    fn the_places_that_a_program_began_with_are_no_part_of_the_path() {
        let left = |east_m: &[f64]| -> Vec<f64> {
            measured(vehicle(east_m, &[]).own.track, 1.0).iter().map(|point| point.east_m).collect()
        };
        assert_eq!(left(&[0.0, 0.0, 20.0, 21.0]), [20.0, 21.0]);
        assert_eq!(left(&[0.0, 1.0, 2.0, 3.0, 4.0, 20.0]).len(), 6, "a jump under way");
        assert_eq!(left(&[0.0]), [0.0]);
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
