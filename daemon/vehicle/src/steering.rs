//! The choice of waypoints.

mod ahead;
mod grounds;
mod to_place;

pub use ahead::{Alternative, PathAhead};

use grounds::{Grounds, PlannerChoice};
use to_place::Views;

use super::planning::{BlockValues, Bounds, CellWindow, Interest, Knowledge, Node, PlanRequest, Point, distance};
use scenecast_config::LegDirection;
use scenecast_core::Area;
use scenecast_protocol::directive::{Areas, AtEnd, Fence, PlannerKind, Utility, WeightedArea};
use scenecast_protocol::map::{Cell, LabelGrid};
use scenecast_protocol::wire::Intent;
use std::collections::{BTreeMap, VecDeque};

/// The extent of a camera frame on the sea floor, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    pub across: f64,
    pub along: f64,
    /// The least part of a frame's width across the track by which frames of neighbouring legs overlap, 0..=0.9.
    pub leg_overlap: f64,
}

impl Footprint {
    /// Metres around the centre that are visible at any heading.
    pub fn reach(&self) -> f64 {
        self.across.min(self.along) / 2.0
    }

    /// The largest distance between two places of a lattice of which every other row is a leg, metres. Views at any heading
    /// overlap by a tenth.
    fn lattice_step(&self) -> f64 {
        (0.9 * self.reach()).min((1.0 - self.leg_overlap) * self.across / 2.0)
    }
}

/// The next step of the vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    Go(Point),
    /// The rest of the distance or time is needed for the return path.
    LimitReached,
    /// The vehicle is at its goal, or its plan is complete.
    Arrived,
    /// There is no allowed path to any goal.
    NoPath,
}

/// Chooses waypoints: by a lawnmower until the operator has sent a utility, then by the planner in force.
///
/// Places are points of the world frame, as fence and area are, so that neither they nor the lattice move when a fix
/// moves the map. Only cells belong to the map frame.
#[derive(Debug)]
pub struct Steering {
    grounds: Grounds,
    choice: PlannerChoice,
    /// The end of the survey: as configured, and as ordered.
    at_end: (AtEnd, Option<AtEnd>),
    areas: Vec<WeightedArea>,
    /// The weights of labels and the areas for which the looks are counted.
    counted: (BTreeMap<u8, i8>, Vec<WeightedArea>),
    /// The place to which the operator has ordered the vehicle.
    destination: Option<Point>,
    window: CellWindow,
    known: Knowledge,
    /// The origin of the map frame in the world frame: metres east and north.
    map_origin: Point,
    plan: VecDeque<Node>,
    track: LatticeTrack,
    views: Views,
    /// The version of the map for which the plan was made.
    planned_for: u64,
    /// The purpose of an adaptive plan.
    intent: Option<Intent>,
    /// An adaptive plan found nothing that pays.
    is_complete: bool,
}

/// The last two places of the lattice that the vehicle was at.
#[derive(Debug, Default)]
struct LatticeTrack {
    here: Option<Node>,
    before: Option<Node>,
    /// The vehicle goes to a place beside its survey.
    is_away: bool,
}

impl LatticeTrack {
    fn handle_place(&mut self, at: Node) {
        if self.here != Some(at) {
            self.before = self.here.replace(at);
        }
    }
}

/// The weight of unseen cells, in hundredths, once no look at a label pays any more.
const EXPLORATION: i8 = 10;

/// Steps up to one waypoint where the plan depends on the map. With two, `horizon` collects 2 % less, because
/// each step shows new cells.
const STEPS_AHEAD: usize = 1;

impl Steering {
    /// Steers within `area`. Cells have edges of `cell_m` metres, and the vehicle keeps
    /// `clearance_m` metres from every outline.
    pub fn new(area: Area, footprint: Footprint, cell_m: f64, configured: PlannerKind, clearance_m: f64) -> Self {
        Self {
            grounds: Grounds::new(area, (footprint.reach(), footprint.lattice_step()), clearance_m),
            choice: PlannerChoice::new(configured),
            at_end: (AtEnd::Explore, None),
            areas: Vec::new(),
            counted: Default::default(),
            destination: None,
            window: CellWindow::new(area, cell_m),
            known: Knowledge::default(),
            map_origin: (0.0, 0.0),
            plan: VecDeque::new(),
            track: LatticeTrack::default(),
            views: Views::default(),
            planned_for: 0,
            intent: None,
            is_complete: false,
        }
    }

    /// The same with another configured end of the survey than [`AtEnd::Explore`].
    pub fn with_end(mut self, configured: AtEnd) -> Self {
        self.at_end.0 = configured;
        self
    }

    /// The same with legs in a configured direction.
    pub fn with_legs(mut self, direction: LegDirection) -> Self {
        self.grounds.set_legs(direction);
        self
    }

    /// The length of one pass of the survey, metres.
    pub fn pass_m(&self) -> f64 {
        self.grounds.pass_m()
    }

    /// The first place of the survey.
    pub fn start(&self) -> Point {
        self.grounds.lattice().place(0)
    }

    /// The end of the return path.
    pub fn return_place(&self) -> Point {
        self.grounds.return_place()
    }

    pub fn bounds(&self) -> &Bounds {
        self.grounds.bounds()
    }

    /// A fix has moved the origin of the map frame. The path is planned again from the new position.
    pub fn set_placement(&mut self, east_m: f64, north_m: f64) {
        if self.map_origin != (east_m, north_m) {
            self.map_origin = (east_m, north_m);
            self.window = CellWindow::new(self.grounds.area().moved(-east_m, -north_m), self.window.cell_m);
            self.replan();
        }
    }

    /// The origin of the map frame in the world frame, metres.
    pub fn map_origin(&self) -> Point {
        self.map_origin
    }

    /// Puts a fence in force that was checked.
    pub fn set_fence(&mut self, fence: &Fence) {
        let before = self.grounds.set_fence(fence);
        self.choice.planner_mut().handle_change(&before);
        self.track = LatticeTrack::default();
        self.replan();
    }

    /// Sets the planner and the end of the survey that the operator ordered; `None`: the configured one.
    pub fn set_choices(&mut self, planner: Option<PlannerKind>, at_end: Option<AtEnd>) {
        self.choice.choose(planner);
        self.at_end.1 = at_end;
        self.replan();
    }

    /// The weight that the areas give a place of the world frame.
    pub fn weight_of_place(&self, place: Point) -> f64 {
        f64::from(Interest { utility: &Utility::default(), areas: &self.areas }.weight_of_place(place))
    }

    /// Puts weighted areas in force that were checked.
    pub fn set_areas(&mut self, areas: Areas) {
        self.areas = areas.0;
        self.replan();
    }

    /// The purpose of the plan; `None` if no adaptive planner steers, or nothing pays any more.
    pub fn intent(&self) -> Option<Intent> {
        if self.has_destination() { Some(Intent::Destination) } else { self.intent }
    }

    /// Drops the plan, so that the next waypoint follows a new one.
    pub fn replan(&mut self) {
        self.plan.clear();
        self.intent = None;
        self.is_complete = false;
    }

    /// The camera saw the sea floor around `at`, a point of the map frame. A cell gets a look
    /// for each step of the lattice along the track, whatever the rate of the frames.
    pub fn handle_view(&mut self, at: Point) {
        let reach = self.grounds.reach_m();
        let step_m = self.grounds.lattice().step_m();
        let track_steps = self.views.handle_view(at) / step_m;
        for cell in self.window.cells_around(at, reach) {
            self.known.look(cell, track_steps);
        }
        if self.views.take_turn_on_the_spot(step_m) {
            self.exhaust_around(at);
        }
    }

    /// What is left to gain around a place, in the map frame, does not keep the vehicle there. This includes cells that it
    /// has not seen: from where it stops, up to half a metre short of its waypoints, it cannot see them.
    fn exhaust_around(&mut self, at: Point) {
        let metres = self.grounds.reach_m() + self.grounds.lattice().step_m() + self.window.cell_m / 2.0;
        for cell in self.window.cells_around(at, metres) {
            self.known.exhaust(cell);
        }
    }

    /// Takes the scene model's perplexity of a cell.
    pub fn handle_perplexity(&mut self, cell: Cell, perplexity: f32) {
        self.known.set_perplexity(cell, perplexity);
    }

    /// The next waypoint from `from`. `map` is the label map with its version, `left_m` the distance that may
    /// still be travelled in metres.
    pub fn next(&mut self, from: Point, map: (&LabelGrid, u64), utility: Option<&Utility>, left_m: f64) -> Course {
        if self.choice.follow(utility.is_some() || !self.areas.is_empty()) {
            self.replan();
        }
        self.handle_interest(map.0, utility);
        let left_m = left_m - self.grounds.last_leg_m();
        let Some(at) = self.grounds.entry(from) else { return Course::NoPath };
        self.track.is_away = false;
        let approach = distance(from, self.grounds.lattice().place(at));
        self.track.handle_place(at);
        let adapts = self.choice.adapts();
        let changed = adapts && self.planned_for != map.1;
        if self.plan.front() == Some(&at) {
            self.plan.pop_front();
        }
        let is_next = |n: &Node| self.grounds.lattice().around(at).any(|(to, _)| to == *n);
        let follows = self.plan.front().is_some_and(is_next);
        let is_usable = follows && self.can_go(at, &self.plan, left_m - approach);
        let is_settled = self.is_complete && !changed;
        if (changed || !is_usable) && !is_settled {
            self.planned_for = map.1;
            let present = if is_usable { std::mem::take(&mut self.plan).into() } else { Vec::new() };
            let utility = utility.cloned().unwrap_or_default();
            let (plan, intent) = self.make_plan(at, map.0, &utility, left_m - approach, present);
            self.is_complete = adapts && plan.is_empty();
            self.intent = intent;
            self.plan = plan.into();
        }
        self.waypoint(from, at, if adapts { STEPS_AHEAD } else { usize::MAX }, left_m)
    }

    /// A plan from a place, or the rest of the `present` one, if that is as good, and its purpose. Where no look pays any
    /// more, the survey explores or repeats its looks, as ordered; an adaptive plan is empty if that does not pay either.
    fn make_plan(
        &mut self,
        from: Node,
        map: &LabelGrid,
        utility: &Utility,
        left_m: f64,
        present: Vec<Node>,
    ) -> (Vec<Node>, Option<Intent>) {
        let at_end = self.at_end.1.unwrap_or(self.at_end.0);
        let found = self.paying_plan(from, map, utility, left_m, &present, at_end != AtEnd::Hold);
        let repeats = at_end == AtEnd::Repeat && self.choice.adapts() && found.0.is_empty();
        let begins = repeats && self.views.begin_round(self.grounds.lattice().step_m());
        let interest = Interest { utility, areas: &self.areas };
        if begins && self.known.forget_looks((&self.window, self.map_origin), map, interest) {
            self.known.begin_round();
            // The next round begins elsewhere.
            self.views.last().into_iter().for_each(|at| self.exhaust_around(at));
            return self.paying_plan(from, map, utility, left_m, &present, false);
        }
        found
    }

    /// Counts the looks at what the operator favours more than before from now on: he asks to see it, whatever was passed over
    /// before he asked.
    fn handle_interest(&mut self, map: &LabelGrid, utility: Option<&Utility>) {
        let weights = utility.map(|utility| &utility.weights);
        if weights.map_or(self.counted.0.is_empty(), |weights| *weights == self.counted.0)
            && self.areas == self.counted.1
        {
            return;
        }
        let now = (weights.cloned().unwrap_or_default(), self.areas.clone());
        let before = std::mem::replace(&mut self.counted, now.clone());
        let is_raised = |(label, weight): &(u8, i8)| *weight > before.0.get(label).copied().unwrap_or(0).max(0);
        let raised = Utility { weights: now.0.into_iter().filter(is_raised).collect(), ..Utility::default() };
        let areas: Vec<WeightedArea> = now.1.into_iter().filter(|area| !before.1.contains(area)).collect();
        let interest = Interest { utility: &raised, areas: &areas };
        self.known.forget_looks((&self.window, self.map_origin), map, interest);
        self.replan();
    }

    /// The plan that pays by the operator's interest or, if `may_explore`, by exploration; empty if none does.
    fn paying_plan(
        &mut self,
        from: Node,
        map: &LabelGrid,
        utility: &Utility,
        left_m: f64,
        present: &[Node],
        may_explore: bool,
    ) -> (Vec<Node>, Option<Intent>) {
        let Some(return_paths) = self.grounds.return_paths() else { return (Vec::new(), None) };
        let (lattice, adapts) = (self.grounds.lattice(), self.choice.adapts());
        // A negative weight is the operator's order not to explore.
        let explores = may_explore && (0..EXPLORATION).contains(&utility.exploration);
        let exploring = explores.then(|| Utility { exploration: EXPLORATION, ..utility.clone() });
        let value = |interest: Interest<'_>| {
            BlockValues::new(lattice, (&self.window, self.map_origin), map, &self.known, interest)
        };
        for utility in std::iter::once(utility).chain(&exploring) {
            let interest = Interest { utility, areas: &self.areas };
            let values = value(interest);
            let request = PlanRequest { lattice, values: &values, from, return_paths, left_m };
            let plan = self.choice.planner_mut().plan(&request);
            if !adapts {
                return (plan, None);
            }
            let margin = ahead::margin(&plan, self.track.before, self.known.repeats());
            let plan = if ahead::keeps(&request, present, &plan, margin) { present.to_vec() } else { plan };
            if ahead::pays(&request, &plan, interest, (lattice.step_m() / self.window.cell_m).powi(2)) {
                let intent = ahead::purpose(interest, |part| ahead::gain(&value(part), &plan));
                return (plan, intent);
            }
        }
        (Vec::new(), None)
    }

    /// Whether the first place of a plan leaves enough distance for the return path.
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
        // The place stays in the plan until it is reached, so that the rest of the plan follows it.
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

    /// Metres of the return path from a place; infinite if there is none.
    pub fn return_path_m(&self, from: Point) -> f64 {
        self.grounds.return_path_m(from)
    }

    /// The distance in metres at which a waypoint counts as reached.
    pub fn arrival_m(&self) -> f64 {
        self.grounds.arrival_m()
    }
}

#[cfg(test)]
mod settling_tests;
#[cfg(test)]
mod tests;
