//! The path of a vehicle, by its own record or by what it has reported.

use super::dive::DiveVehicle;
use super::track_point::{MAX_M_S, TrackPoint};

/// A record may have each place more than once, so speeds are those of such mission times, seconds.
const SPAN_S: f64 = 10.0;
/// A slower vehicle stands, m/s.
const LEAST_M_S: f64 = 0.05;
/// Reports have the time at which they came in, which may be so much later than that of their place, seconds of the mission.
const LATE_S: f64 = 10.0;

impl DiveVehicle {
    /// Whether its own record has its path.
    pub(super) fn has_own_path(&self) -> bool {
        self.own.track.len() > 1
    }

    /// The places of its own record, or else those that it has reported.
    pub(super) fn path(&self) -> &[TrackPoint] {
        if self.has_own_path() { &self.own.track } else { &self.track }
    }

    /// The parts of its path between jumps: where its program began again with another place, or where it would have had to be faster
    /// than it ever was.
    pub(super) fn legs(&self) -> impl Iterator<Item = &[TrackPoint]> {
        const DOUBT: f64 = 1.5;
        let max_m_s = self.fastest_m_s().map_or(MAX_M_S, |m_s| m_s * DOUBT);
        let mut since_s = f64::NAN;
        // Asks for each pair once, in order.
        self.path().chunk_by(move |a, b| {
            // While nothing measures its place, a record repeats the last one.
            let is_repeated = a.distance_m(b) == 0.0;
            let from_s = if since_s.is_nan() { a.at_s } else { since_s };
            since_s = if is_repeated { from_s } else { f64::NAN };
            let late_s = if self.has_own_path() { 0.0 } else { LATE_S };
            let is_too_far = || a.is_too_far(b, (b.at_s - from_s) * self.mission_speed + late_s, max_m_s);
            a.distance_m(b) < 1.0 || !self.began_between(a, b) && !is_too_far()
        })
    }

    /// Whether its program began again between two of its places.
    pub(super) fn began_between(&self, a: &TrackPoint, b: &TrackPoint) -> bool {
        let is_between = |began_s: &f64| a.at_s < *began_s && b.at_s >= *began_s;
        match self.has_own_path() {
            true => self.own.runs_s.iter().skip(1).any(|(began_s, _)| is_between(began_s)),
            false => self.restarts_s.iter().any(is_between),
        }
    }

    /// The highest mean speed over ten seconds of the mission, m/s; `None` if it did not move for so long.
    fn fastest_m_s(&self) -> Option<f64> {
        let pairs = self.path().iter().zip(self.path().iter().skip(1));
        let steps = pairs.filter(|(a, b)| !self.began_between(a, b) && !a.jumps_to(b, self.mission_speed));
        self.spans(steps).map(|(m, s)| m / s).filter(|m_s| *m_s >= LEAST_M_S).reduce(f64::max)
    }

    /// The length and the mission time of each ten seconds of some steps.
    fn spans<'a>(
        &self,
        steps: impl Iterator<Item = (&'a TrackPoint, &'a TrackPoint)>,
    ) -> impl Iterator<Item = (f64, f64)> {
        let mut span = (0.0, 0.0);
        steps.filter_map(move |(a, b)| {
            span = (span.0 + a.distance_m(b), span.1 + (b.at_s - a.at_s) * self.mission_speed);
            (span.1 >= SPAN_S).then(|| std::mem::take(&mut span))
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

    /// Its speed while it moved, m/s: at least so much, where only reports tell it. Times are of the wall clock, which the mission may be ahead of.
    pub(super) fn speed_m_s(&self) -> Option<f64> {
        let add = |sum: (f64, f64), (m, s): (f64, f64)| (sum.0 + m, sum.1 + s);
        let step = |(a, b): (&TrackPoint, &TrackPoint)| (a.distance_m(b), (b.at_s - a.at_s) * self.mission_speed);
        let whole = self.steps().map(step).fold((0.0, 0.0), add);
        let moved = self.spans(self.steps()).filter(|(m, s)| m / s >= LEAST_M_S).fold((0.0, 0.0), add);
        // A path may be shorter than a span.
        let (m, s) = if whole.1 >= SPAN_S { moved } else { whole };
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
    use super::super::track_point::measured;
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
        let own = OwnRecord { track, runs_s: runs_s.to_vec(), ..OwnRecord::default() };
        DiveVehicle { own, ..DiveVehicle::default() }
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
    fn a_step_that_its_speed_allows_is_no_jump() {
        let legs = |east_m: Vec<f64>| {
            let mut vehicle = vehicle(&east_m, &[]);
            vehicle.mission_speed = 1.0;
            vehicle.legs().count()
        };
        let way = || (0..30).map(|n| f64::from(n) * 0.5);
        assert_eq!(legs(way().chain([20.5]).collect()), 2, "6 m in a second at 0.5 m/s");
        let unmeasured = way().chain(std::iter::repeat_n(14.5, 10)).chain([20.5]);
        assert_eq!(legs(unmeasured.collect()), 1, "6 m in the 11 s since its place was measured");
    }

    #[test]
    fn a_late_report_is_no_jump() {
        let mut vehicle = vehicle(&(0..30).map(|n| f64::from(n) * 0.5).chain([22.5]).collect::<Vec<_>>(), &[]);
        vehicle.mission_speed = 1.0;
        assert_eq!(vehicle.legs().count(), 2, "by its own record");
        vehicle.track = std::mem::take(&mut vehicle.own.track);
        assert_eq!((vehicle.legs().count(), vehicle.distance_m()), (1, 22.5), "8 m in a second, by reports");
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
