//! The survey area within the fence, the return path from each place of it, and the planner that is in use.

use crate::planning::{Bounds, Lattice, Node, Paths, Planner, Point, distance, legs, length_m, planner};
use scenecast_config::LegDirection;
use scenecast_core::Area;
use scenecast_protocol::directive::{Fence, PlannerKind};

/// A pass in the other direction is taken if it costs less than this part of the one that the area alone suggests.
const CLEARLY: f64 = 0.97;

/// The lattice over area and fence, in the world frame.
#[derive(Debug)]
pub(super) struct Grounds {
    area: Area,
    /// Metres around the centre of a frame that are visible at any heading.
    reach_m: f64,
    /// Distance between two places of the lattice, metres; legs are two of them apart.
    step_m: f64,
    clearance_m: f64,
    direction: LegDirection,
    bounds: Bounds,
    /// The first place of the survey. Without a return point the vehicle returns to it.
    start: Point,
    return_point: Option<Point>,
    lattice: Lattice,
    return_paths: Option<Paths>,
    /// Metres from the end of the return paths to the return point itself.
    last_leg_m: f64,
}

impl Grounds {
    pub(super) fn new(area: Area, (reach_m, step_m): (f64, f64), clearance_m: f64) -> Self {
        let bounds = Bounds::default();
        let lattice = Lattice::new(area.shrunk(reach_m), &[], step_m, &bounds);
        let start = lattice.place(0);
        let mut grounds = Self {
            area,
            reach_m,
            step_m,
            clearance_m,
            direction: LegDirection::Shortest,
            bounds,
            start,
            return_point: None,
            lattice,
            return_paths: None,
            last_leg_m: 0.0,
        };
        grounds.set_legs(LegDirection::Shortest);
        grounds
    }

    /// Lays out the lattice with legs in a direction, before any fence is in force.
    pub(super) fn set_legs(&mut self, direction: LegDirection) {
        self.direction = direction;
        let legs = self.legs_area(self.legs_run_north());
        self.start = (legs.west, legs.south);
        self.lay_out();
    }

    pub(super) fn area(&self) -> Area {
        self.area
    }

    pub(super) fn reach_m(&self) -> f64 {
        self.reach_m
    }

    pub(super) fn bounds(&self) -> &Bounds {
        &self.bounds
    }

    pub(super) fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    pub(super) fn return_paths(&self) -> Option<&Paths> {
        self.return_paths.as_ref()
    }

    pub(super) fn last_leg_m(&self) -> f64 {
        self.last_leg_m
    }

    /// The end of every return path.
    pub(super) fn return_place(&self) -> Point {
        self.return_point.unwrap_or(self.start)
    }

    /// Lays out the lattice within a fence; returns the last one.
    pub(super) fn set_fence(&mut self, fence: &Fence) -> Lattice {
        self.bounds = Bounds::new(fence, self.clearance_m);
        self.return_point = fence.return_point.map(|p| p.to_world().xy());
        self.lay_out()
    }

    fn lay_out(&mut self) -> Lattice {
        let lattice = self.best_lattice();
        let before = std::mem::replace(&mut self.lattice, lattice);
        let end = self.entry(self.return_place());
        self.return_paths = end.map(|n| self.lattice.paths(n));
        self.last_leg_m = end.map_or(0.0, |n| distance(self.return_place(), self.lattice.place(n)));
        before
    }

    /// The lattice in whose legs a pass is shorter: by the area, or as the fence and the areas to stay out of leave it.
    fn best_lattice(&self) -> Lattice {
        let legs_run_north = self.legs_run_north();
        let lattice = |legs_run_north| {
            let area = self.legs_area(legs_run_north);
            Lattice::with_legs(legs_run_north, area, &[self.return_place()], self.step_m, &self.bounds)
        };
        let by_area = lattice(legs_run_north);
        let is_free = self.bounds.outlines() == 0;
        if self.direction != LegDirection::Shortest || is_free {
            return by_area;
        }
        // A turn costs as much as one step of the lattice.
        let cost_m = |lattice: &Lattice| {
            let legs = self.legs_of(lattice);
            length_m(lattice, &legs) + legs.len() as f64 * self.step_m
        };
        let other = lattice(!legs_run_north);
        if cost_m(&other) < CLEARLY * cost_m(&by_area) { other } else { by_area }
    }

    /// The ends of all legs of a lattice, from the first place of the survey.
    fn legs_of(&self, lattice: &Lattice) -> Vec<Node> {
        lattice.entry(self.start, &self.bounds).map_or_else(Vec::new, |from| legs(lattice, from, |_| true))
    }

    /// The length of one pass of the survey, metres.
    pub(super) fn pass_m(&self) -> f64 {
        length_m(&self.lattice, &self.legs_of(&self.lattice))
    }

    /// Whether the legs run north: as configured, or where they are shorter in all by the area.
    fn legs_run_north(&self) -> bool {
        match self.direction {
            LegDirection::Shortest => {
                Lattice::legs_run_north(self.within_fence(self.area.shrunk(self.reach_m)), self.step_m)
            }
            LegDirection::EastWest => false,
            LegDirection::NorthSouth => true,
        }
    }

    /// The area that the legs are fitted to: from its edges the camera sees those of the survey area, as far as the fence allows.
    fn legs_area(&self, legs_run_north: bool) -> Area {
        let inner = self.within_fence(self.area.shrunk(self.reach_m));
        // The end of a leg counts as reached before the vehicle is there.
        let ends = self.area.shrunk((self.reach_m - self.arrival_m()).max(self.reach_m / 2.0));
        let (width_m, height_m) = inner.size_m();
        let legs = match legs_run_north {
            _ if width_m.max(height_m) <= 0.0 => inner,
            true => Area { south: ends.south, north: ends.north, ..inner },
            false => Area { west: ends.west, east: ends.east, ..inner },
        };
        self.within_fence(legs)
    }

    /// What the fence leaves of an area; all of it if that is nothing.
    fn within_fence(&self, area: Area) -> Area {
        self.bounds.extent().and_then(|fence| fence.common(&area)).unwrap_or(area)
    }

    /// The place at which a path from `from` enters the lattice.
    pub(super) fn entry(&self, from: Point) -> Option<Node> {
        self.lattice.entry(from, &self.bounds)
    }

    /// Whether the return path from a place fits into `left_m` after `gone_m` metres.
    pub(super) fn leaves_return(&self, node: Node, gone_m: f64, left_m: f64) -> bool {
        !left_m.is_finite() || self.return_paths.as_ref().is_some_and(|w| gone_m + w.metres[node] <= left_m)
    }

    /// The place at which a path enters the lattice, the place at which it leaves it, and the places after the first.
    pub(super) fn path(&self, from: Point, to: Point) -> Option<(Node, Node, Vec<Node>)> {
        let (at, end) = (self.entry(from)?, self.entry(to)?);
        Some((at, end, self.lattice.paths(at).to(end)))
    }

    /// Metres of the return path from a place; infinite if there is none.
    pub(super) fn return_path_m(&self, from: Point) -> f64 {
        let Some(at) = self.entry(from) else { return f64::INFINITY };
        let along = self.return_paths.as_ref().map_or(f64::INFINITY, |w| w.metres[at]);
        distance(from, self.lattice.place(at)) + along + self.last_leg_m
    }

    /// The distance in metres at which a waypoint counts as reached.
    pub(super) fn arrival_m(&self) -> f64 {
        0.5f64.min(self.clearance_m.max(0.1) / 2.0)
    }
}

#[derive(Debug)]
pub(super) struct PlannerChoice {
    configured: PlannerKind,
    chosen: Option<PlannerKind>,
    planner: Box<dyn Planner>,
    running: PlannerKind,
}

impl PlannerChoice {
    pub(super) fn new(configured: PlannerKind) -> Self {
        let running = PlannerKind::Lawnmower;
        Self { configured, chosen: None, planner: planner(running), running }
    }

    pub(super) fn choose(&mut self, chosen: Option<PlannerKind>) {
        self.chosen = chosen;
    }

    /// Selects the lawnmower until there is a utility, then the ordered or the configured planner. Returns
    /// whether the planner has changed.
    pub(super) fn follow(&mut self, has_utility: bool) -> bool {
        let wanted = if has_utility { self.chosen.unwrap_or(self.configured) } else { PlannerKind::Lawnmower };
        let changes = wanted != self.running;
        if changes {
            (self.planner, self.running) = (planner(wanted), wanted);
        }
        changes
    }

    /// Whether the plan depends on the map.
    pub(super) fn adapts(&self) -> bool {
        self.running != PlannerKind::Lawnmower
    }

    pub(super) fn planner(&self) -> &dyn Planner {
        &*self.planner
    }

    pub(super) fn planner_mut(&mut self) -> &mut dyn Planner {
        &mut *self.planner
    }
}

#[cfg(test)]
mod tests {
    use super::super::Footprint;
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::Polygon;

    #[test]
    fn legs_run_where_a_pass_is_shorter_or_as_configured() {
        let area = Area { west: 0.0, south: 0.0, east: 60.0, north: 40.0 };
        let mut grounds = Grounds::new(area, (2.0, 1.8), 1.0);
        let runs_north = |grounds: &Grounds| {
            let line = grounds.lattice().lines().remove(0);
            grounds.lattice().place(line[0]).0 == grounds.lattice().place(line[1]).0
        };
        assert!(!runs_north(&grounds));
        let (free_m, place) = (grounds.pass_m(), |x, y| DecimetrePoint::new(10 * x, 10 * y));
        // Long walls from the south to the north.
        let wall = |x| Polygon(vec![place(x, 3), place(x + 1, 3), place(x + 1, 37), place(x, 37)]);
        grounds.set_fence(&Fence { keep_outs: (1..10).map(|n| wall(6 * n)).collect(), ..Fence::default() });
        assert!(runs_north(&grounds));
        let fenced_m = grounds.pass_m();
        grounds.set_fence(&Fence::default());
        assert!(!runs_north(&grounds) && (grounds.pass_m() - free_m).abs() < 1e-6);
        for (direction, north) in [(LegDirection::EastWest, false), (LegDirection::NorthSouth, true)] {
            let mut grounds = Grounds::new(area, (2.0, 1.8), 1.0);
            grounds.set_legs(direction);
            assert_eq!(runs_north(&grounds), north);
            grounds.set_fence(&Fence { keep_outs: (1..10).map(|n| wall(6 * n)).collect(), ..Fence::default() });
            assert_eq!(runs_north(&grounds), north);
            assert!(north || grounds.pass_m() > 1.03 * fenced_m, "{} {fenced_m}", grounds.pass_m());
        }
    }

    #[test]
    fn legs_overlap_by_the_configured_part_of_a_frame() {
        let legs_m = |across, along, leg_overlap| 2.0 * Footprint { across, along, leg_overlap }.lattice_step();
        assert!((legs_m(6.4, 4.8, 0.3) - 4.32).abs() < 1e-9, "nine tenths of the shorter side");
        assert!((legs_m(4.8, 4.8, 0.3) - 0.7 * 4.8).abs() < 1e-9);
        assert!((legs_m(3.0, 4.8, 0.5) - 0.5 * 3.0).abs() < 1e-9);
    }
}
