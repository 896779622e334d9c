//! The planned path after the waypoint: as it is reported, its purpose, and whether a new plan is better than the present one.

use super::Steering;
use crate::planning::{BlockValues, Interest, Lattice, Node, PlanRequest, Point, distance};
use scenecast_protocol::directive::{Utility, WeightedArea};
use scenecast_protocol::map::LabelGrid;
use scenecast_protocol::wire::{Intent, PlannedPath};

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

/// The nearest floor that is known to be of a favoured label and worth a look, as a goal beside the plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Metres east and north in the world frame, and the length of the path to it.
    pub at: Point,
    pub metres: f64,
    /// The expected gain of a metre of the path to it, and of a metre of the plan: square metres of weight 1.
    pub gain_a_metre: f64,
    pub of_plan: f64,
}

impl Steering {
    /// The nearest known floor of a favoured label from `from`, beside the plan of the last [`Self::next`]; `None` if there is none, or
    /// the vehicle is there.
    pub fn alternative(&self, from: Point, map: &LabelGrid, utility: &Utility) -> Option<Alternative> {
        let (lattice, from) = (self.grounds.lattice(), self.grounds.entry(from)?);
        let values = |utility, areas| {
            let frame = (&self.window, self.map_origin);
            BlockValues::new(lattice, frame, map, &self.known, Interest { utility, areas })
        };
        let weights =
            utility.weights.iter().filter(|(_, weight)| **weight > 0).map(|(&label, &weight)| (label, weight));
        let favoured = Utility { weights: weights.collect(), epoch: utility.epoch, ..Utility::default() };
        let cells_in_block = (lattice.step_m() / self.window.cell_m).powi(2);
        let noticed = NOTICED * Interest::in_labels(&favoured).largest_weight() * cells_in_block;
        let known = values(&favoured, &[]);
        let is_there = |node: Node| known.shown(node).iter().any(|&block| f64::from(known.of_seen(block)) > noticed);
        let paths = lattice.paths(from);
        let reached = (0..lattice.places()).filter(|&node| paths.metres[node].is_finite() && is_there(node));
        let nearest = reached.min_by(|&a, &b| paths.metres[a].total_cmp(&paths.metres[b]))?;
        let all = values(utility, &self.areas);
        let plan: Vec<Node> = self.plan.iter().copied().collect();
        let gain_of = |path: &[Node]| gain_a_metre(lattice, &all, from, path) * self.window.cell_m.powi(2);
        (nearest != from).then(|| Alternative {
            at: lattice.place(nearest),
            metres: paths.metres[nearest],
            gain_a_metre: gain_of(&paths.to(nearest)),
            of_plan: gain_of(&plan),
        })
    }

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

/// Labels that a purpose can name: those with the largest weights, since each costs a valuation of the map.
const MAX_LABELS: usize = 4;

/// The part of `interest` with the greatest `gain`; `None` if no part gains anything.
pub(super) fn purpose(interest: Interest<'_>, gain: impl Fn(Interest<'_>) -> Gain) -> Option<Intent> {
    let parts = parts(interest);
    let gain_of = |(_, utility, areas): &Part<'_>| gain(Interest { utility, areas });
    if let [only] = &parts[..] {
        return Some(after_looks(only.0, || gain_of(only)));
    }
    let gains: Vec<Gain> = parts.iter().map(gain_of).collect();
    let best = (0..parts.len()).max_by(|&a, &b| gains[a].whole.total_cmp(&gains[b].whole).then(b.cmp(&a)))?;
    (gains[best].whole > 0.0).then(|| after_looks(parts[best].0, || gains[best]))
}

/// The intent in view of the looks so far: a label is revisited if more than half of what it gains is on seen floor.
fn after_looks(intent: Intent, gain: impl FnOnce() -> Gain) -> Intent {
    let Intent::Label(label) = intent else { return intent };
    let Gain { whole, on_seen } = gain();
    if on_seen > 0.5 * whole { Intent::LabelAgain(label) } else { intent }
}

/// A part of an interest, as an interest of its own.
type Part<'a> = (Intent, Utility, &'a [WeightedArea]);

/// The parts with a positive weight.
fn parts<'a>(Interest { utility, areas }: Interest<'a>) -> Vec<Part<'a>> {
    const NOWHERE: &[WeightedArea] = &[];
    let none = Utility { epoch: utility.epoch, ..Utility::default() };
    let mut labels: Vec<(u8, i8)> = utility.weights.iter().map(|(&l, &w)| (l, w)).filter(|&(_, w)| w > 0).collect();
    labels.sort_by_key(|&(label, weight)| (std::cmp::Reverse(weight), label));
    labels.truncate(MAX_LABELS);
    let of_label = |(label, weight)| {
        (Intent::Label(label), Utility { weights: [(label, weight)].into(), ..none.clone() }, NOWHERE)
    };
    let mut parts: Vec<_> = labels.into_iter().map(of_label).collect();
    if utility.exploration > 0 {
        parts.push((Intent::Unseen, Utility { exploration: utility.exploration, ..none.clone() }, NOWHERE));
    }
    if utility.curiosity > 0 {
        parts.push((Intent::Curiosity, Utility { curiosity: utility.curiosity, ..none.clone() }, NOWHERE));
    }
    let favoured = (1..).zip(areas.chunks(1)).filter(|(_, area)| area.iter().all(|area| area.weight > 0));
    parts.extend(favoured.map(|(number, area)| (Intent::Area(number), none.clone(), area)));
    parts
}

/// The gain a metre of a new plan, divided by that of the present one, from which the new one replaces it, if it turns back,
/// and in rounds of repeated looks, where a place keeps much of its value after a look. Without such margins two goals of
/// like worth take the vehicle to and fro, because each step changes the map. A margin for all new plans costs the horizon
/// planner a tenth of its gain.
const TURN_BACK: f64 = 1.3;
const IN_ROUNDS: f64 = 1.15;
/// The part of a block's cells, each of the largest weight and not looked at, from which floor is known to be of a favoured label.
const NOTICED: f64 = 0.15;
/// The mean value of a cell, divided by the largest weight, from which a look at it pays: a fifth look at a favoured label
/// does, and a sixth one does not.
const PAYS: f64 = 0.02;

/// The least gain a metre of a plan that replaces the present one, in gains a metre of that. `before` is the place that the
/// vehicle comes from.
pub(super) fn margin(plan: &[Node], before: Option<Node>, is_in_rounds: bool) -> f64 {
    let turns_back = before.is_some() && plan.first().copied() == before;
    let margin = if turns_back { TURN_BACK } else { 1.0 };
    if is_in_rounds { IN_ROUNDS.max(margin) } else { margin }
}

/// Whether the present plan is kept although another one was made from the same place.
pub(super) fn keeps(q: &PlanRequest<'_>, present: &[Node], other: &[Node], margin: f64) -> bool {
    let rate = gain_a_metre(q.lattice, q.values, q.from, present);
    rate > 0.0 && gain_a_metre(q.lattice, q.values, q.from, other) < margin * rate
}

/// Whether a path shows a block of which the cells are worth another look.
pub(super) fn pays(q: &PlanRequest<'_>, path: &[Node], interest: Interest<'_>, cells_in_block: f64) -> bool {
    let values = path.iter().flat_map(|&node| q.values.shown(node)).map(|block| f64::from(q.values.of(block)));
    values.fold(0.0, f64::max) > PAYS * interest.largest_weight() * cells_in_block
}

/// What a path gains: the values of the blocks that it shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    pub whole: f64,
    /// The part of it on seen floor.
    pub on_seen: f64,
}

/// The values of all blocks that a path shows, each once.
pub(super) fn gain(values: &BlockValues, path: &[Node]) -> Gain {
    let mut blocks: Vec<usize> = path.iter().flat_map(|&node| values.shown(node)).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let sum = |value: fn(&BlockValues, usize) -> f32| blocks.iter().map(|&block| f64::from(value(values, block))).sum();
    Gain { whole: sum(BlockValues::of), on_seen: sum(BlockValues::of_seen) }
}

/// The gain of a path for each of its metres.
fn gain_a_metre(lattice: &Lattice, values: &BlockValues, from: Node, path: &[Node]) -> f64 {
    let places = std::iter::once(&from).chain(path);
    let metres: f64 = places.zip(path).map(|(&a, &b)| distance(lattice.place(a), lattice.place(b))).sum();
    // A stop and a turn cost as much as one step of the lattice.
    gain(values, path).whole / (metres + lattice.step_m())
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
        assert_eq!((planned.points.len(), planned.continues), (7, true));
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

    #[test]
    fn the_part_that_gains_most_is_the_purpose() {
        let utility = Utility { exploration: 10, weights: [(3, 80), (5, -20), (7, 40)].into(), ..Utility::default() };
        let weigh = |by: [f64; 4]| {
            move |Interest { utility, areas }: Interest<'_>| {
                let labels = by[0] * utility.weight(3) + by[1] * utility.weight(7);
                let whole = labels + by[2] * f64::from(utility.exploration) / 100.0 + by[3] * areas.len() as f64;
                Gain { whole, on_seen: 0.0 }
            }
        };
        let in_labels = Interest::in_labels(&utility);
        assert_eq!(purpose(in_labels, weigh([1.0, 1.0, 1.0, 9.0])), Some(Intent::Label(3)));
        assert_eq!(purpose(in_labels, weigh([1.0, 3.0, 1.0, 9.0])), Some(Intent::Label(7)));
        assert_eq!(purpose(in_labels, weigh([1.0, 1.0, 20.0, 9.0])), Some(Intent::Unseen));
        assert_eq!(purpose(in_labels, weigh([0.0; 4])), None);
        let areas = [-50, 60].map(|weight| WeightedArea { outline: Polygon::default(), weight });
        let in_places = Interest { areas: &areas, ..in_labels };
        assert_eq!(purpose(in_places, weigh([1.0, 1.0, 1.0, 9.0])), Some(Intent::Area(2)));
        let again = |intent, on_seen| after_looks(intent, || Gain { whole: 1.0, on_seen });
        assert_eq!(again(Intent::Label(3), 0.4), Intent::Label(3));
        assert_eq!(again(Intent::Label(3), 0.6), Intent::LabelAgain(3));
        assert_eq!(again(Intent::Unseen, 1.0), Intent::Unseen);
        let only = Utility { curiosity: 5, ..Utility::default() };
        let unreachable = |_: Interest<'_>| unreachable!("one part needs no gain");
        assert_eq!(purpose(Interest::in_labels(&only), unreachable), Some(Intent::Curiosity));
        assert_eq!(purpose(Interest::in_labels(&Utility::default()), |_| Gain { whole: 1.0, on_seen: 0.0 }), None);
    }
}
