//! The planned path after the waypoint, in the form that is reported.

use super::Steering;
use crate::planning::{Point, distance};
use scenecast_protocol::wire::PlannedPath;

/// A path, reduced to its corners.
struct Corners {
    start: Point,
    places: Vec<Point>,
    metres: f64,
}

impl Corners {
    fn new(start: Point) -> Self {
        Self { start, places: Vec::new(), metres: 0.0 }
    }

    fn end(&self) -> Point {
        self.places.last().copied().unwrap_or(self.start)
    }

    /// Adds a straight leg. A place in the middle of a straight stretch is no corner.
    fn go(&mut self, to: Point) {
        let (end, leg) = (self.end(), distance(self.end(), to));
        if leg < 1e-6 {
            return;
        }
        self.metres += leg;
        let before = self.places.iter().rev().nth(1).copied().unwrap_or(self.start);
        match self.places.last_mut() {
            Some(last) if is_straight(before, end, to) => *last = to,
            _ => self.places.push(to),
        }
    }

    /// Whether the report has no room for more corners.
    fn is_full(&self) -> bool {
        self.places.len() > PlannedPath::MAX_POINTS
    }

    fn finish(mut self) -> PathAhead {
        let continues = self.is_full();
        self.places.truncate(PlannedPath::MAX_POINTS);
        PathAhead { points: self.places, continues }
    }
}

fn is_straight(a: Point, b: Point, c: Point) -> bool {
    let ((x, y), (u, v)) = ((b.0 - a.0, b.1 - a.1), (c.0 - b.0, c.1 - b.1));
    x * u + y * v > 0.0 && (x * v - y * u).abs() < 1e-3 * x.hypot(y) * u.hypot(v)
}

/// The planned path after a waypoint, in the world frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PathAhead {
    /// Each further waypoint: metres east and north.
    pub points: Vec<Point>,
    /// Whether the plan has more waypoints than these.
    pub continues: bool,
}

impl Steering {
    /// The plan after the last waypoint of [`Self::next`], from which `left_m` metres may be travelled.
    pub fn path_after(&self, waypoint: Point, left_m: f64) -> PathAhead {
        let left_m = left_m - self.grounds.last_leg_m();
        let mut path = Corners::new(waypoint);
        self.plan.iter().for_each(|&node| path.go(self.grounds.lattice().place(node)));
        let Some(&(mut end)) = self.plan.back() else { return path.finish() };
        for goal in self.choice.planner().beyond() {
            if path.is_full() {
                break;
            }
            let straight = self.grounds.lattice().straight(end, goal);
            for node in straight.unwrap_or_else(|| self.grounds.lattice().paths(end).to(goal)) {
                let place = self.grounds.lattice().place(node);
                if !self.grounds.leaves_return(node, path.metres + distance(path.end(), place), left_m) {
                    return path.finish();
                }
                path.go(place);
                end = node;
            }
        }
        path.finish()
    }

    /// The return path after one of its waypoints.
    pub fn path_after_return(&self, waypoint: Point) -> PathAhead {
        self.path_to(waypoint, self.return_place())
    }

    /// The path to the destination after one of its waypoints.
    pub fn path_after_detour(&self, waypoint: Point) -> PathAhead {
        self.destination.map_or_else(PathAhead::default, |to| self.path_to(waypoint, to))
    }

    fn path_to(&self, waypoint: Point, to: Point) -> PathAhead {
        let mut path = Corners::new(waypoint);
        if waypoint == to {
            return path.finish();
        }
        if let Some((_, end, nodes)) = self.grounds.path(waypoint, to) {
            nodes.into_iter().for_each(|node| path.go(self.grounds.lattice().place(node)));
            if self.grounds.bounds().allows_exit(to, self.grounds.lattice().place(end)) {
                path.go(to);
            }
        }
        path.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Course, Footprint};
    use scenecast_core::Area;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Fence, PlannerKind, Polygon, Utility};
    use scenecast_protocol::map::{Cell, LabelGrid};

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 12.0 };
    const FOOTPRINT: Footprint = Footprint { across: 4.0, along: 4.0, leg_overlap: 0.0 };

    fn steering(kind: PlannerKind) -> Steering {
        Steering::new(AREA, FOOTPRINT, 0.25, kind, 1.0)
    }

    /// The first waypoint, and the planned path after it.
    fn first(steering: &mut Steering, map: &LabelGrid, utility: Option<&Utility>, left_m: f64) -> (Point, PathAhead) {
        let from = steering.start();
        let Course::Go(to) = steering.next(from, (map, 1), utility, left_m) else { panic!("nowhere to go") };
        (to, steering.path_after(to, left_m - distance(from, to)))
    }

    #[test]
    fn a_path_is_reported_by_its_corners() {
        let mut path = Corners::new((0.0, 0.0));
        for to in [(0.0, 0.0), (1.8, 0.0), (3.6, 0.0), (5.4, 1.8), (7.2, 3.6), (7.2, 3.6), (5.4, 1.8)] {
            path.go(to);
        }
        let folded = [(3.6, 0.0), (7.2, 3.6), (5.4, 1.8)];
        assert_eq!(path.finish(), PathAhead { points: folded.to_vec(), continues: false });
        let stairs = |steps: i32| {
            let mut path = Corners::new((0.0, 0.0));
            (1..=steps).for_each(|i| path.go((f64::from(i / 2), f64::from((i + 1) / 2))));
            path.finish()
        };
        assert_eq!((stairs(7).points.len(), stairs(7).continues), (7, false));
        assert_eq!((stairs(8).points, stairs(8).continues), (stairs(7).points, true));
    }

    #[test]
    fn the_lawnmower_reports_the_legs_that_it_takes() {
        let mut steering = steering(PlannerKind::Horizon);
        let (mut at, planned) = first(&mut steering, &LabelGrid::default(), None, f64::INFINITY);
        assert_eq!((planned.points.len(), planned.continues), (4, false));
        for place in planned.points {
            let Course::Go(to) = steering.next(at, (&LabelGrid::default(), 1), None, f64::INFINITY) else { panic!() };
            assert!(distance(to, place) < 1e-9, "{to:?} instead of {place:?}");
            at = to;
        }
    }

    #[test]
    fn no_reported_leg_prevents_the_return() {
        let metres = |left_m: f64| {
            let mut steering = steering(PlannerKind::Lawnmower);
            let (to, planned) = first(&mut steering, &LabelGrid::default(), None, left_m);
            let path: Vec<Point> = [steering.start(), to].into_iter().chain(planned.points).collect();
            let gone: f64 = path.windows(2).map(|w| distance(w[0], w[1])).sum();
            gone + distance(path[path.len() - 1], steering.return_place())
        };
        assert!(metres(f64::INFINITY) > 60.0);
        for left_m in [10.0, 25.0, 40.0, 55.0] {
            assert!(metres(left_m) <= left_m && metres(left_m) > left_m - 8.0, "{} of {left_m}", metres(left_m));
        }
    }

    #[test]
    fn the_reported_path_follows_each_new_plan() {
        let label = |x: i32, y: i32, east: bool| if (x > 40) == east && y > 10 { 2 } else { 1 };
        let map = |east: bool| -> LabelGrid {
            (0..48 * 80).map(|i| (i % 80, i / 80)).map(|(x, y)| (Cell::new(x, y), label(x, y, east))).collect()
        };
        let utility = Utility { weights: [(2, 100), (1, -5)].into(), ..Utility::default() };
        let mut steering = steering(PlannerKind::Horizon);
        let (to, planned) = first(&mut steering, &map(true), Some(&utility), f64::INFINITY);
        assert!(!planned.points.is_empty());
        let Course::Go(next) = steering.next(to, (&map(true), 1), Some(&utility), f64::INFINITY) else { panic!() };
        assert!(
            planned.points[0] == next || is_straight(to, next, planned.points[0]),
            "{next:?} is on no leg of {planned:?}"
        );
        let Course::Go(west) = steering.next(to, (&map(false), 2), Some(&utility), f64::INFINITY) else { panic!() };
        assert_ne!(steering.path_after(west, f64::INFINITY), planned);
    }

    #[test]
    fn the_reported_return_path_avoids_keep_outs() {
        let place = |x, y| DecimetrePoint::new(10 * x, 10 * y);
        let wall = Polygon(vec![place(9, -5), place(11, -5), place(11, 8), place(9, 8)]);
        let mut steering = steering(PlannerKind::Lawnmower);
        let return_point = Some(DecimetrePoint::new(31, 33));
        steering.set_fence(&Fence { keep_outs: vec![wall], return_point, ..Fence::default() });
        let Course::Go(to) = steering.next_return((17.0, 3.0)) else { panic!("no path") };
        let planned = steering.path_after_return(to);
        assert_eq!((planned.points.last(), planned.continues), (Some(&(3.1, 3.3)), false));
        assert!(planned.points.iter().any(|p| p.1 > 8.0), "{planned:?}");
        let path: Vec<Point> = std::iter::once(to).chain(planned.points).collect();
        assert!(path.windows(2).all(|w| steering.bounds().allows_leg(w[0], w[1])));
    }
}
