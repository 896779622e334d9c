//! Where to go next.

mod ahead;
mod choice;
mod grounds;

pub use ahead::PathAhead;

use choice::PlannerChoice;
use grounds::Grounds;

use super::planning::{BlockValues, Bounds, CellWindow, Knowledge, Node, PlanRequest, Point, distance};
use scenecast_core::Area;
use scenecast_protocol::directive::{Fence, PlannerKind, Utility};
use scenecast_protocol::map::{Cell, LabelGrid};
use std::collections::VecDeque;

/// What the camera sees, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    pub across: f64,
    pub along: f64,
}

impl Footprint {
    /// Metres from the middle that are seen at any heading.
    fn reach(&self) -> f64 {
        self.across.min(self.along) / 2.0
    }
}

/// What the vehicle is to do next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    Go(Point),
    /// What is left of distance or time is the path home.
    LimitReached,
    /// It is where it was to go.
    Arrived,
    /// Arrived is nowhere that it may go.
    NoPath,
}

/// Chooses waypoints: a lawnmower until the operator has said what matters, then by the planner that is set.
///
/// Places are of the world, as fence and area are: when a fix moves the map, neither they nor the lattice move with it. Only
/// cells are of the map's frame.
#[derive(Debug)]
pub struct Steering {
    grounds: Grounds,
    choice: PlannerChoice,
    window: CellWindow,
    known: Knowledge,
    /// East and north of the map's frame in the world, metres.
    map_origin: Point,
    plan: VecDeque<Node>,
    /// The version of the map that the plan is for.
    planned_for: u64,
}

/// Steps to one waypoint while the path may change with the map: with two, `horizon` collects 2 % less, for each step shows
/// something new.
const STEPS_AHEAD: usize = 1;

impl Steering {
    /// Steers within `area`; cells have edges of `cell_m` metres. The vehicle stays `clearance_m` clear of every outline.
    pub fn new(area: Area, footprint: Footprint, cell_m: f64, configured: PlannerKind, clearance_m: f64) -> Self {
        let mut steering = Self {
            grounds: Grounds::new(area, footprint.reach(), clearance_m),
            choice: PlannerChoice::new(configured),
            window: CellWindow::new(area, cell_m),
            known: Knowledge::default(),
            map_origin: (0.0, 0.0),
            plan: VecDeque::new(),
            planned_for: 0,
        };
        steering.choice.planner_mut().handle_change();
        steering
    }

    /// Where the survey begins, metres.
    pub fn start(&self) -> Point {
        self.grounds.lattice().place(0)
    }

    /// Where the vehicle goes on its return.
    pub fn return_place(&self) -> Point {
        self.grounds.return_place()
    }

    pub fn bounds(&self) -> &Bounds {
        self.grounds.bounds()
    }

    /// A fix has moved the map to there in the world: paths are planned anew, from where the vehicle now believes to be.
    pub fn set_placement(&mut self, east_m: f64, north_m: f64) {
        if self.map_origin != (east_m, north_m) {
            self.map_origin = (east_m, north_m);
            self.window = CellWindow::new(self.grounds.area().moved(-east_m, -north_m), self.window.cell_m);
            self.plan.clear();
        }
    }

    /// Where the map's frame lies in the world.
    pub fn map_origin(&self) -> Point {
        self.map_origin
    }

    /// Puts a fence that was checked in force.
    pub fn set_fence(&mut self, fence: &Fence) {
        self.grounds.set_fence(fence);
        self.choice.planner_mut().handle_change();
        self.plan.clear();
    }

    /// The operator's choice of a planner; `None`: as configured.
    pub fn set_planner(&mut self, chosen: Option<PlannerKind>) {
        self.choice.choose(chosen);
        self.plan.clear();
    }

    /// Forgets the path that was planned.
    pub fn replan(&mut self) {
        self.plan.clear();
    }

    /// The camera saw the sea floor around `at`, of the map's frame.
    pub fn handle_view(&mut self, at: Point) {
        let reach = self.grounds.reach_m();
        // Cells whose middle was in sight.
        let cells = |middle: f64| {
            let edge = |metres: f64| metres / self.window.cell_m - 0.5;
            edge(middle - reach).ceil() as i32..=edge(middle + reach).floor() as i32
        };
        for (y, x) in cells(at.1).flat_map(|y| cells(at.0).map(move |x| (y, x))) {
            self.known.look(Cell::new(x, y));
        }
    }

    /// How badly the scene model explains a cell.
    pub fn handle_perplexity(&mut self, cell: Cell, perplexity: f32) {
        self.known.set_perplexity(cell, perplexity);
    }

    /// The next waypoint from `from`, of which version `version` of the map is known, with `left_m` metres to go in all.
    pub fn next(&mut self, from: Point, map: (&LabelGrid, u64), utility: Option<&Utility>, left_m: f64) -> Course {
        if self.choice.follow(utility.is_some()) {
            self.plan.clear();
        }
        let left_m = left_m - self.grounds.last_leg_m();
        let Some(at) = self.grounds.entry(from) else { return Course::NoPath };
        let approach = distance(from, self.grounds.lattice().place(at));
        let adapts = self.choice.adapts();
        let changed = adapts && self.planned_for != map.1;
        if self.plan.front() == Some(&at) {
            self.plan.pop_front();
        }
        let is_next = |n: &Node| self.grounds.lattice().around(at).any(|(to, _)| to == *n);
        let follows = self.plan.front().is_some_and(is_next);
        if changed || !follows || !self.can_go(at, &self.plan, left_m - approach) {
            self.planned_for = map.1;
            self.plan = self.make_plan(at, map.0, utility, left_m - approach).into();
        }
        self.waypoint(from, at, if adapts { STEPS_AHEAD } else { usize::MAX }, left_m)
    }

    fn make_plan(&mut self, from: Node, map: &LabelGrid, utility: Option<&Utility>, left_m: f64) -> Vec<Node> {
        let Some(return_paths) = self.grounds.return_paths() else { return Vec::new() };
        let none = Utility::default();
        let values = BlockValues::new(
            self.grounds.lattice(),
            (&self.window, self.map_origin),
            map,
            &self.known,
            utility.unwrap_or(&none),
        );
        let request = PlanRequest { lattice: self.grounds.lattice(), values: &values, from, return_paths, left_m };
        self.choice.planner_mut().plan(&request)
    }

    /// Whether the first place of a plan still leaves the path home.
    fn can_go(&self, from: Node, plan: &VecDeque<Node>, left_m: f64) -> bool {
        let Some(return_paths) = self.grounds.return_paths() else { return false };
        let first = plan.front().and_then(|&to| self.grounds.lattice().around(from).find(|(n, _)| *n == to));
        first.is_some_and(|(n, step)| !left_m.is_finite() || step + return_paths.metres[n] <= left_m)
    }

    /// The last place that lies straight ahead, at most `most` steps away.
    fn waypoint(&mut self, from: Point, at: Node, most: usize, left_m: f64) -> Course {
        let Some(&first) = self.plan.front() else {
            return self.without_plan(at, left_m);
        };
        let entry = self.grounds.lattice().place(at);
        if distance(from, entry) > self.grounds.lattice().step_m()
            || !self.grounds.bounds().allows_leg(from, self.grounds.lattice().place(first))
        {
            return Course::Go(entry);
        }
        let step = first as isize - at as isize;
        let mut ahead = at;
        let mut count = 0;
        while let Some(&next) = self.plan.front() {
            let is_straight = next as isize - ahead as isize == step;
            let far = (self.grounds.lattice().place(next), from);
            if count >= most || !is_straight || (count > 0 && !self.grounds.bounds().allows_leg(far.1, far.0)) {
                break;
            }
            if count > 0 && !self.grounds.leaves_return(next, distance(far.0, far.1), left_m) {
                break;
            }
            ahead = next;
            count += 1;
            self.plan.pop_front();
        }
        // It is popped when it is reached, so that the rest of the plan follows it.
        self.plan.push_front(ahead);
        Course::Go(self.grounds.lattice().place(ahead))
    }

    /// The course where the planner has no waypoint.
    fn without_plan(&self, at: Node, left_m: f64) -> Course {
        let has_return = self.grounds.return_paths().is_some_and(|paths| paths.metres[at].is_finite());
        match (left_m.is_finite(), has_return) {
            (true, _) => Course::LimitReached,
            (false, true) => Course::Arrived,
            (false, false) => Course::NoPath,
        }
    }

    /// The next waypoint on the path home.
    pub fn next_return(&mut self, from: Point) -> Course {
        self.plan.clear();
        let home = self.return_place();
        if distance(from, home) <= self.arrival_m() {
            return Course::Arrived;
        }
        let Some((at, end, path)) = self.grounds.return_path(from) else { return Course::NoPath };
        if at != end && path.is_empty() {
            return Course::NoPath;
        }
        let entry = self.grounds.lattice().place(at);
        match path.first().map(|&n| self.grounds.lattice().place(n)) {
            None if distance(from, entry) > self.arrival_m() => Course::Go(entry),
            None if self.grounds.bounds().allows_exit(home, entry) => Course::Go(home),
            None => Course::Arrived,
            Some(next) if self.grounds.bounds().allows_leg(from, next) => Course::Go(next),
            Some(_) => Course::Go(entry),
        }
    }

    /// Metres of the return path from a place, infinite if there is none.
    pub fn return_path_m(&self, from: Point) -> f64 {
        self.grounds.return_path_m(from)
    }

    /// Metres from a waypoint at which it counts as reached.
    pub fn arrival_m(&self) -> f64 {
        self.grounds.arrival_m()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 12.0 };
    const FOOTPRINT: Footprint = Footprint { across: 4.0, along: 3.0 };

    fn steering(kind: PlannerKind) -> Steering {
        Steering::new(AREA, FOOTPRINT, 0.25, kind, 1.0)
    }

    /// Drives to waypoint after waypoint; the places that it came to.
    fn drive(steering: &mut Steering, map: &LabelGrid, utility: Option<&Utility>, legs: usize) -> Vec<Point> {
        let mut at = steering.start();
        let mut track = vec![at];
        for version in 0..legs {
            let Course::Go(to) = steering.next(at, (map, version as u64), utility, f64::INFINITY) else { break };
            at = to;
            track.push(at);
            steering.handle_view(at);
        }
        track
    }

    #[test]
    fn the_lawnmower_covers_the_area_and_stays_inside_it() {
        let legs = drive(&mut steering(PlannerKind::Horizon), &LabelGrid::default(), None, 20);
        assert!(legs.iter().all(|&(x, y)| (0.0..=20.0).contains(&x) && (0.0..=12.0).contains(&y)), "{legs:?}");
        assert!(legs.iter().any(|l| l.1 > 9.0) && legs.iter().any(|l| l.1 < 2.0), "{legs:?}");
    }

    #[test]
    fn a_favoured_label_draws_the_vehicle_to_it() {
        let mut map = LabelGrid::default();
        for y in 0..48 {
            for x in 0..80 {
                map.set(Cell::new(x, y), if x > 60 && y > 30 { 2 } else { 1 });
            }
        }
        let weights = [(2, 100), (1, -5)].into_iter().collect();
        let utility = Utility { weights, ..Utility::default() };
        for kind in [PlannerKind::Greedy, PlannerKind::Horizon] {
            let track = drive(&mut steering(kind), &map, Some(&utility), 12);
            assert!(track.iter().any(|to| to.0 > 14.0 && to.1 > 7.0), "{kind:?}: {track:?}");
        }
    }
}
