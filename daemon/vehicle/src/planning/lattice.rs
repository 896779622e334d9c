//! The planning lattice: places, and the shortest paths between them.

use super::bounds::{Bounds, Point, distance};
use scenecast_core::Area;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

const MAX_SIDE: usize = 192;
/// Steps to the eight places around, in the order of the bits of a move mask.
const MOVES: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// A lattice of places that the vehicle may be at. Neighbours are joined where the straight line between them is allowed.
///
/// Its columns and rows are evenly spaced so that the first and the last over the area lie on its edges, and so does the last
/// one of every other line, the legs of a survey. Legs run in the direction in which the path with its turns is shorter.
#[derive(Debug, Clone)]
pub struct Lattice {
    columns: Axis,
    rows: Axis,
    legs_run_north: bool,
    /// Allowed moves from each place, one bit for each direction. 0: the vehicle may not be there, unless it is the only place.
    moves: Vec<u8>,
    /// Whether there is one place, and the vehicle may be there.
    is_one_place: bool,
}

/// The columns from west to east, or the rows from south to north.
#[derive(Debug, Clone)]
struct Axis {
    first_m: f64,
    step_m: f64,
    count: usize,
    /// Those over the area itself.
    area: Range<usize>,
}

impl Axis {
    /// Lines over an area `from..to` in so many equal steps, and as far `beyond` it as that reaches.
    fn new((from, to): (f64, f64), beyond: (f64, f64), step_m: f64, steps: usize) -> Self {
        let (least, most) = (from.min(beyond.0), to.max(beyond.1));
        let fitted_m = if steps > 0 { (to - from) / steps as f64 } else { step_m };
        // A place far beyond a small area would take too many lines.
        let is_fitted = most - least <= (MAX_SIDE - 2) as f64 * fitted_m;
        let step_m = if is_fitted { fitted_m } else { step_m };
        let over = if is_fitted { steps } else { ((to - from) / step_m + 1e-9).floor() as usize };
        // Lines beyond the area lie whole steps from its edge.
        let before = ((from - least) / step_m - 1e-9).ceil().max(0.0);
        let first_m = from - before * step_m;
        let count = ((most - first_m) / step_m + 1e-9).floor() as usize + 1;
        let before = before as usize;
        Self { first_m, step_m, count: count.max(before + over + 1), area: before..before + over + 1 }
    }

    fn place(&self, index: usize) -> f64 {
        self.first_m + index as f64 * self.step_m
    }
}

/// Equal steps over a length of which every other line is a leg, at most two of `step_m` from the next.
fn steps_across(length_m: f64, step_m: f64) -> usize {
    2 * steps_along(length_m, 2.0 * step_m)
}

/// Equal steps over a length, of at most `step_m`.
fn steps_along(length_m: f64, step_m: f64) -> usize {
    (length_m / step_m - 1e-9).ceil().max(0.0) as usize
}

/// The index of a place: row times columns plus column.
pub type Node = usize;

/// The shortest paths from one place to all others.
#[derive(Debug, Clone)]
pub struct Paths {
    /// Metres to each place; infinite if no path leads there.
    pub metres: Vec<f64>,
    before: Vec<Node>,
}

impl Lattice {
    /// Places over `area` and the points `beyond` it, at most `step_m` apart in a row or column, or farther where there would be
    /// more than 192.
    pub fn new(area: Area, beyond: &[Point], step_m: f64, bounds: &Bounds) -> Self {
        Self::with_legs(Self::legs_run_north(area, step_m), area, beyond, step_m, bounds)
    }

    /// The same with legs in a chosen direction.
    pub fn with_legs(legs_run_north: bool, area: Area, beyond: &[Point], step_m: f64, bounds: &Bounds) -> Self {
        let span = |from: f64, to: f64, of: fn(&Point) -> f64| {
            beyond.iter().map(of).fold((from, to), |(least, most), v| (least.min(v), most.max(v)))
        };
        let (across, up) = (span(area.west, area.east, |p| p.0), span(area.south, area.north, |p| p.1));
        let step_m = step_m.max((across.1 - across.0).max(up.1 - up.0) / (MAX_SIDE - 2) as f64).max(1e-3);
        let (width_m, height_m) = area.size_m();
        let (steps_x, steps_y) = match legs_run_north {
            true => (steps_across(width_m, step_m), steps_along(height_m, step_m)),
            false => (steps_along(width_m, step_m), steps_across(height_m, step_m)),
        };
        let columns = Axis::new((area.west, area.east), across, step_m, steps_x);
        let rows = Axis::new((area.south, area.north), up, step_m, steps_y);
        let places = columns.count * rows.count;
        let mut lattice = Self { columns, rows, legs_run_north, moves: vec![0; places], is_one_place: false };
        let open: Vec<bool> = (0..places).map(|n| bounds.allows(lattice.place(n))).collect();
        lattice.is_one_place = open == [true];
        for node in 0..places {
            let allowed = (0..MOVES.len()).filter(|&m| {
                let to = lattice.moved(node, m);
                to.is_some_and(|to| open[to] && bounds.allows_leg(lattice.place(node), lattice.place(to)))
            });
            lattice.moves[node] = if open[node] { allowed.fold(0, |mask, m| mask | 1 << m) } else { 0 };
        }
        lattice
    }

    /// Whether the path along legs over an area, at most two of `step_m` apart, takes less from south to north than from west to east.
    pub fn legs_run_north(area: Area, step_m: f64) -> bool {
        let cost_m = |long: f64, wide: f64| {
            let legs = (steps_across(wide, step_m) / 2 + 1) as f64;
            // A turn costs as much as one step of the lattice, and there are two between legs.
            legs * long + wide + 2.0 * (legs - 1.0) * step_m
        };
        let (width_m, height_m) = area.size_m();
        cost_m(height_m, width_m) + 1e-6 < cost_m(width_m, height_m)
    }

    /// Mean distance in metres between neighbouring places of a row and of a column: a block between four places has its square.
    pub fn step_m(&self) -> f64 {
        let (x, y) = self.steps_m();
        (x * y).sqrt()
    }

    /// Distance in metres between neighbouring places of a row, and of a column.
    pub fn steps_m(&self) -> (f64, f64) {
        (self.columns.step_m, self.rows.step_m)
    }

    /// The number of columns and of rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns.count, self.rows.count)
    }

    /// The places of each line along a leg over the area, without those beyond it: rows from the south, or columns from the west.
    pub fn lines(&self) -> Vec<Vec<Node>> {
        let node = |column: usize, row: usize| row * self.columns.count + column;
        let (columns, rows) = (self.columns.area.clone(), self.rows.area.clone());
        match self.legs_run_north {
            true => columns.map(|column| rows.clone().map(|row| node(column, row)).collect()).collect(),
            false => rows.map(|row| columns.clone().map(|column| node(column, row)).collect()).collect(),
        }
    }

    /// How far a place lies along the legs, metres of the world frame.
    pub fn along_legs(&self, (east_m, north_m): Point) -> f64 {
        if self.legs_run_north { north_m } else { east_m }
    }

    pub fn places(&self) -> usize {
        self.moves.len()
    }

    pub fn place(&self, node: Node) -> Point {
        let (column, row) = (node % self.columns.count, node / self.columns.count);
        (self.columns.place(column), self.rows.place(row))
    }

    /// Whether the vehicle may be at a place: it can leave it, or there is no other.
    pub fn is_open(&self, node: Node) -> bool {
        self.moves[node] != 0 || self.is_one_place
    }

    fn moved(&self, node: Node, m: usize) -> Option<Node> {
        let (dx, dy) = MOVES[m];
        let (columns, rows) = self.size();
        let column = (node % columns).checked_add_signed(dx as isize)?;
        let row = (node / columns).checked_add_signed(dy as isize)?;
        (column < columns && row < rows).then_some(row * columns + column)
    }

    /// The neighbours that can be reached from a place, each with its distance in metres.
    pub fn around(&self, node: Node) -> impl Iterator<Item = (Node, f64)> + '_ {
        let (mask, (x, y)) = (self.moves[node], self.steps_m());
        (0..MOVES.len()).filter(move |m| mask & 1 << m != 0).filter_map(move |m| {
            let (dx, dy) = MOVES[m];
            Some((self.moved(node, m)?, (f64::from(dx) * x).hypot(f64::from(dy) * y)))
        })
    }

    /// The place at which a path from anywhere begins: the nearest one that a straight line reaches. From outside the
    /// bounds it is the nearest of all.
    pub fn entry(&self, from: Point, bounds: &Bounds) -> Option<Node> {
        let open = || (0..self.places()).filter(|&n| self.is_open(n));
        let nearest = |nodes: &mut dyn Iterator<Item = Node>| {
            nodes.min_by(|&a, &b| distance(from, self.place(a)).total_cmp(&distance(from, self.place(b))))
        };
        if !bounds.holds(from) {
            return nearest(&mut open());
        }
        let near_m = 6.0 * self.step_m();
        let first_reached = |mut nodes: Vec<Node>| {
            nodes.sort_by(|&a, &b| distance(from, self.place(a)).total_cmp(&distance(from, self.place(b))));
            nodes.into_iter().find(|&n| bounds.allows_exit(from, self.place(n)))
        };
        let near = open().filter(|&n| distance(from, self.place(n)) <= near_m).collect();
        // A vehicle far from all places comes back from a destination.
        first_reached(near).or_else(|| first_reached(open().collect()))
    }

    /// The places from the one after `from` up to `to`, if `to` lies in one of the eight directions
    /// and every step is allowed.
    pub fn straight(&self, from: Node, to: Node) -> Option<Vec<Node>> {
        let steps = |a: usize, b: usize| b as i32 - a as i32;
        let columns = self.columns.count;
        let (x, y) = (steps(from % columns, to % columns), steps(from / columns, to / columns));
        let m = MOVES.iter().position(|&step| step == (x.signum(), y.signum()))?;
        let count = x.abs().max(y.abs());
        let mut path = Vec::with_capacity(count as usize);
        for _ in 0..count {
            let at = path.last().copied().unwrap_or(from);
            let next = self.moved(at, m).filter(|_| self.moves[at] & 1 << m != 0)?;
            path.push(next);
        }
        (path.last() == Some(&to)).then_some(path)
    }

    /// Shortest paths from a place to all others.
    pub fn paths(&self, from: Node) -> Paths {
        self.paths_up_to(from, None)
    }

    /// The same as far as they are needed for the path to one place.
    pub fn paths_up_to(&self, from: Node, end: Option<Node>) -> Paths {
        let mut paths = Paths { metres: vec![f64::INFINITY; self.places()], before: vec![from; self.places()] };
        paths.metres[from] = 0.0;
        // Keys in whole micrometres have a total order, and ties are broken by the place, so that the tree is the same
        // on every machine.
        let key = |metres: f64| (metres * 1e6) as u64;
        let mut queue = BinaryHeap::from([Reverse((0u64, from))]);
        while let Some(Reverse((length, node))) = queue.pop() {
            if Some(node) == end {
                break;
            }
            if length > key(paths.metres[node]) {
                continue;
            }
            for (to, step) in self.around(node) {
                let metres = paths.metres[node] + step;
                if metres + 1e-6 < paths.metres[to] {
                    (paths.metres[to], paths.before[to]) = (metres, node);
                    queue.push(Reverse((key(metres), to)));
                }
            }
        }
        paths
    }
}

impl Paths {
    /// The places from the one after the start to `to`. Empty if no path leads there, or if `to` is the start.
    pub fn to(&self, to: Node) -> Vec<Node> {
        let mut path = Vec::new();
        let mut node = to;
        while self.metres[to].is_finite() && self.before[node] != node {
            path.push(node);
            node = self.before[node];
        }
        path.reverse();
        path
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Fence, Polygon};

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 10.0 };

    /// A wall from the southern edge to two metres before the northern edge.
    fn walled() -> (Bounds, Lattice) {
        let place = |x, y| DecimetrePoint::new(10 * x, 10 * y);
        let wall = Polygon(vec![place(9, -1), place(11, -1), place(11, 8), place(9, 8)]);
        let bounds = Bounds::new(&Fence { keep_outs: vec![wall], ..Fence::default() }, 0.5);
        let lattice = Lattice::new(AREA, &[], 1.0, &bounds);
        (bounds, lattice)
    }

    #[test]
    fn paths_avoid_keep_outs() {
        let (bounds, lattice) = walled();
        let from = lattice.entry((5.0, 2.2), &bounds).unwrap();
        let to = lattice.entry((15.0, 2.0), &bounds).unwrap();
        let paths = lattice.paths(from);
        assert!(paths.metres[to] > 14.0, "{}", paths.metres[to]);
        let path = paths.to(to);
        assert_eq!(path.last(), Some(&to));
        let mut at = lattice.place(from);
        for node in path {
            assert!(bounds.allows_leg(at, lattice.place(node)));
            at = lattice.place(node);
        }
    }

    #[test]
    fn straight_paths_are_shortest_and_cross_no_outline() {
        let (_, lattice) = walled();
        let (columns, _) = lattice.size();
        let mut straight = 0;
        for from in [0, 2 * columns + 5, 9 * columns, 5 * columns + 15] {
            let paths = lattice.paths(from);
            for to in 0..lattice.places() {
                let Some(path) = lattice.straight(from, to) else { continue };
                assert_eq!(path, paths.to(to), "{from} to {to}");
                straight += 1;
            }
        }
        assert!(straight > 100);
        assert_eq!(lattice.straight(2 * columns + 5, 2 * columns + 15), None, "the wall");
    }

    #[test]
    fn first_and_last_legs_lie_on_the_edges_of_any_area() {
        for tenths in (1..4000).step_by(7) {
            let (width, height) = (f64::from(tenths) / 10.0, f64::from(4001 - tenths) / 90.0);
            let area = Area { west: 3.0, south: -7.0, east: 3.0 + width, north: -7.0 + height };
            let lattice = Lattice::new(area, &[], 2.16, &Bounds::default());
            let legs: Vec<Vec<Node>> = lattice.lines().into_iter().step_by(2).collect();
            let ends = [legs.first().unwrap(), legs.last().unwrap()].map(|leg| [leg[0], *leg.last().unwrap()]);
            let [[a, b], [c, d]] = ends.map(|leg| leg.map(|node| lattice.place(node)));
            let is_near = |p: Point, q: Point| distance(p, q) < 1e-6;
            assert!(is_near(a, (3.0, -7.0)) && is_near(d, (area.east, area.north)), "{width} x {height}: {a:?} {d:?}");
            let corners = [(area.east, area.south), (area.west, area.north)];
            assert!(corners.iter().all(|&corner| is_near(b, corner) || is_near(c, corner)), "{b:?} {c:?}");
            let (x, y) = lattice.steps_m();
            assert!(x.max(y) <= 2.16 + 1e-6, "{width} x {height}: {x} {y}");
        }
    }

    #[test]
    fn legs_run_along_a_narrow_area() {
        let legs = |width: f64, height: f64| {
            let area = Area { west: 0.0, south: 0.0, east: width, north: height };
            Lattice::new(area, &[], 2.0, &Bounds::default()).lines().len().div_ceil(2)
        };
        assert_eq!((legs(40.0, 7.0), legs(7.0, 40.0)), (3, 3));
    }

    #[test]
    fn a_far_return_point_is_on_the_lattice_too() {
        let lattice = Lattice::new(AREA, &[(-35.0, 5.0)], 1.0, &Bounds::default());
        let home = lattice.entry((-35.0, 5.0), &Bounds::default()).unwrap();
        assert!(distance(lattice.place(home), (-35.0, 5.0)) < 1.0);
        let huge = Lattice::new(AREA, &[(-35_000.0, 5.0)], 1.0, &Bounds::default());
        assert!(huge.places() <= MAX_SIDE * MAX_SIDE);
    }
}
