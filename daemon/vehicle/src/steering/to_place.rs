//! Courses to a place, and the track of the camera with its rounds of looks along it.

use super::{Course, Steering};
use crate::planning::{Point, distance};
use scenecast_protocol::coordinates::DecimetrePoint;

impl Steering {
    /// Orders the vehicle to a place of the world frame before it resumes its survey; `None` withdraws the order.
    pub fn set_destination(&mut self, place: Option<DecimetrePoint>) {
        self.destination = place.map(|place| place.to_world().xy());
        self.replan();
    }

    /// Whether the vehicle has yet to go to a destination.
    pub fn has_destination(&self) -> bool {
        self.destination.is_some()
    }

    /// The next waypoint of the return path.
    pub fn next_return(&mut self, from: Point) -> Course {
        self.leave_survey(from);
        self.replan();
        self.course_to(from, self.return_place())
    }

    /// Tells the planner where the survey is left, once.
    fn leave_survey(&mut self, from: Point) {
        if !std::mem::replace(&mut self.track.is_away, true)
            && let Some(at) = self.grounds.entry(from)
        {
            self.choice.planner_mut().handle_leave(at, self.grounds.lattice());
        }
    }

    /// The next waypoint on the path to the destination, or [`Course::LimitReached`] if path and return path take more than
    /// `left_m` metres; `None` without a destination. It is dropped when the vehicle has arrived or the limit is reached, or
    /// if no allowed path leads there any more.
    pub fn next_detour(&mut self, from: Point, left_m: f64) -> Option<Course> {
        let to = self.destination?;
        self.leave_survey(from);
        self.replan();
        let course = match self.detour(from, to) {
            Course::Go(_) if self.detour_m(from, to) > left_m => Some(Course::LimitReached),
            Course::Go(next) => Some(Course::Go(next)),
            _ => None,
        };
        if !matches!(course, Some(Course::Go(_))) {
            self.destination = None;
        }
        course
    }

    /// Whether an allowed path of at most `left_m` metres leads to a place of the world frame and back to the return place.
    pub fn can_reach(&self, from: Point, place: DecimetrePoint, left_m: f64) -> bool {
        let to = place.to_world().xy();
        let is_open = self.bounds().allows(to) && matches!(self.detour(from, to), Course::Go(_) | Course::Arrived);
        is_open && (!left_m.is_finite() || self.detour_m(from, to) <= left_m)
    }

    /// Metres of the path to a place and of the return path from there.
    fn detour_m(&self, from: Point, to: Point) -> f64 {
        let there_m = match self.bounds().allows_leg(from, to) {
            true => distance(from, to),
            false => self.grounds.path(from, to).map_or(f64::INFINITY, |(at, _, nodes)| {
                let places = std::iter::once(at).chain(nodes).map(|node| self.grounds.lattice().place(node));
                let (end, metres) = places.fold((from, 0.0), |(last, metres), p| (p, metres + distance(last, p)));
                metres + distance(end, to)
            }),
        };
        there_m + self.return_path_m(to)
    }

    fn detour(&self, from: Point, to: Point) -> Course {
        let is_straight = distance(from, to) > self.arrival_m() && self.bounds().allows_leg(from, to);
        if is_straight { Course::Go(to) } else { self.course_to(from, to) }
    }

    /// The next waypoint on the path to a place.
    fn course_to(&self, from: Point, to: Point) -> Course {
        if distance(from, to) <= self.arrival_m() {
            return Course::Arrived;
        }
        let Some((at, end, path)) = self.grounds.path(from, to) else { return Course::NoPath };
        if at != end && path.is_empty() {
            return Course::NoPath;
        }
        let entry = self.grounds.lattice().place(at);
        match path.first().map(|&n| self.grounds.lattice().place(n)) {
            None if distance(from, entry) > self.arrival_m() => Course::Go(entry),
            None if self.grounds.bounds().allows_exit(to, entry) => Course::Go(to),
            None => Course::Arrived,
            Some(next) if self.grounds.bounds().allows_leg(from, next) => Course::Go(next),
            Some(_) => Course::Go(entry),
        }
    }
}

/// The shortest round that is flown again, in steps of the lattice. A shorter one would be a turn on the spot.
const MIN_ROUND: f64 = 12.0;

/// A track of this length within a circle is a turn on the spot, in steps of the lattice.
const SPOT_TRACK: f64 = 4.0;
/// The radius of the circle, in steps of the lattice: all eight neighbours of a place lie in it.
const SPOT_RADIUS: f64 = 1.5;

/// The views of a survey.
#[derive(Debug, Default)]
pub(super) struct Views {
    last: Option<Point>,
    track_m: f64,
    /// The middle of the circle that the vehicle has not left, and the length of the track when it came there.
    spot: Option<(Point, f64)>,
    /// The length of the track where the present round began; `None` before the first repeated round.
    round_from_m: Option<f64>,
}

impl Views {
    /// Takes a view around `at`, and returns the length of the track so far, metres.
    pub(super) fn handle_view(&mut self, at: Point) -> f64 {
        self.track_m += self.last.replace(at).map_or(0.0, |before| distance(before, at));
        self.track_m
    }

    /// The place of the last view, a point of the map frame.
    pub(super) fn last(&self) -> Option<Point> {
        self.last
    }

    /// Whether the vehicle has turned on the spot; then it begins to count again.
    pub(super) fn take_turn_on_the_spot(&mut self, step_m: f64) -> bool {
        let Some(at) = self.last else { return false };
        let has_left = self.spot.is_none_or(|(middle, _)| distance(middle, at) > SPOT_RADIUS * step_m);
        let turned = !has_left && self.spot.is_some_and(|(_, from)| self.track_m - from >= SPOT_TRACK * step_m);
        if has_left || turned {
            self.spot = Some((at, self.track_m));
        }
        turned
    }

    /// Begins another round of looks, unless the present one was too short to be flown again.
    pub(super) fn begin_round(&mut self, step_m: f64) -> bool {
        let is_long = self.round_from_m.is_none_or(|from| self.track_m - from >= MIN_ROUND * step_m);
        if is_long {
            self.round_from_m = Some(self.track_m);
        }
        is_long
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Footprint;
    use scenecast_core::Area;
    use scenecast_protocol::directive::{Fence, PlannerKind, Polygon};
    use scenecast_protocol::map::LabelGrid;
    use scenecast_protocol::wire::Intent;

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 12.0 };

    fn point(east_m: i32, north_m: i32) -> DecimetrePoint {
        DecimetrePoint::new(10 * east_m, 10 * north_m)
    }

    fn steering(keep_outs: Vec<Polygon>) -> Steering {
        let footprint = Footprint { across: 4.0, along: 3.0, leg_overlap: 0.0 };
        let mut steering = Steering::new(AREA, footprint, 0.25, PlannerKind::Horizon, 1.0);
        steering.set_fence(&Fence { keep_outs, ..Fence::default() });
        steering
    }

    /// The waypoints to the destination, of which the first is the start.
    fn detour(steering: &mut Steering) -> Vec<Point> {
        let mut track = vec![steering.start()];
        while let Some(Course::Go(to)) = steering.next_detour(track[track.len() - 1], f64::INFINITY) {
            assert_eq!(steering.intent(), Some(Intent::Destination));
            track.push(to);
            assert!(track.len() < 100, "{track:?}");
        }
        track
    }

    #[test]
    fn a_destination_is_reached_in_a_straight_line_if_allowed() {
        for place in [point(15, 10), point(-60, 40)] {
            let mut steering = steering(Vec::new());
            assert!(steering.can_reach(steering.start(), place, f64::INFINITY));
            assert!(!steering.can_reach(steering.start(), place, 20.0));
            steering.set_destination(Some(place));
            assert_eq!(detour(&mut steering), [steering.start(), place.to_world().xy()]);
            assert!(!steering.has_destination());
            let course = steering.next(place.to_world().xy(), (&LabelGrid::default(), 1), None, f64::INFINITY);
            assert!(matches!(course, Course::Go(_)), "it resumes the survey: {course:?}");
        }
    }

    #[test]
    fn the_path_to_a_destination_avoids_keep_outs() {
        let wall = Polygon(vec![point(9, -5), point(11, -5), point(11, 7), point(9, 7)]);
        let mut steering = steering(vec![wall.clone()]);
        steering.set_destination(Some(point(17, 3)));
        let track = detour(&mut steering);
        assert_eq!(track.last(), Some(&(17.0, 3.0)));
        assert!(track.windows(2).all(|leg| steering.bounds().allows_leg(leg[0], leg[1])), "{track:?}");
        assert!(!steering.can_reach(steering.start(), point(10, 3), f64::INFINITY), "in the keep-out");
        let shut = Polygon(vec![point(9, -90), point(11, -90), point(11, 90), point(9, 90)]);
        let mut cut_off = self::steering(vec![shut]);
        assert!(!cut_off.can_reach(cut_off.start(), point(17, 3), f64::INFINITY), "beyond the keep-out");
        cut_off.set_destination(Some(point(17, 3)));
        assert_eq!(detour(&mut cut_off).len(), 1, "a destination that is cut off is dropped");
        assert!(!cut_off.has_destination());
    }

    #[test]
    fn a_destination_beyond_the_limit_is_dropped() {
        let mut steering = steering(Vec::new());
        steering.set_destination(Some(point(17, 3)));
        assert_eq!(steering.next_detour(steering.start(), 25.0), Some(Course::LimitReached));
        assert!(!steering.has_destination());
        steering.set_destination(Some(point(17, 3)));
        assert_eq!(steering.next_detour(steering.start(), 40.0), Some(Course::Go((17.0, 3.0))));
    }

    #[test]
    fn back_and_forth_is_a_turn_on_the_spot_and_a_long_leg_is_not() {
        let turns = |to_m: f64| {
            let mut views = Views::default();
            let place = |i: u32| (to_m / 2.0 * (1.0 - (f64::from(i) * 0.5 / to_m * std::f64::consts::PI).cos()), 0.0);
            (0..200).any(|i| {
                views.handle_view(place(i));
                views.take_turn_on_the_spot(2.0)
            })
        };
        assert!(turns(2.0) && !turns(6.0));
    }

    #[test]
    fn a_round_that_is_a_turn_on_the_spot_is_not_begun_again() {
        let mut views = Views::default();
        assert!(views.begin_round(2.0), "the survey so far counts as a round");
        assert!(!views.begin_round(2.0));
        (0..=30).for_each(|i| {
            views.handle_view((f64::from(i), 0.0));
        });
        assert!(views.begin_round(2.0));
    }
}
