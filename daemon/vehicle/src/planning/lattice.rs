//! The planning lattice: places, and the shortest paths between them.

use super::bounds::{Bounds, Point, distance};
use scenecast_core::Area;
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::ops::Range;

const MAX_SIDE: usize = 192;
/// Steps to the eight places around, in the order of the bits of a move mask.
const MOVES: [(i32, i32); 8] = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// A square lattice of places that the vehicle may be at. Neighbours are joined where the straight
/// line between them is allowed.
#[derive(Debug, Clone)]
pub struct Lattice {
    origin: Point,
    step_m: f64,
    columns: usize,
    rows: usize,
    /// The columns and the rows over the area itself.
    area: (Range<usize>, Range<usize>),
    /// Allowed moves from each place, one bit for each direction. 0: the vehicle may not be there.
    moves: Vec<u8>,
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
    /// Places over `area` and the points `beyond` it, `step_m` apart, or farther where there would be more than 192
    /// in a row or column.
    pub fn new(area: Area, beyond: &[Point], step_m: f64, bounds: &Bounds) -> Self {
        let fold = |least: f64, most: f64, of: fn(&Point) -> f64| {
            beyond.iter().map(of).fold((least, most), |(l, m), v| (l.min(v), m.max(v)))
        };
        let (west, east) = fold(area.west, area.east, |p| p.0);
        let (south, north) = fold(area.south, area.north, |p| p.1);
        let step_m = step_m.max((east - west).max(north - south) / (MAX_SIDE - 2) as f64).max(1e-3);
        // Places beyond the area lie a whole number of steps from its corner.
        let before = |from: f64, to: f64| ((to - from) / step_m - 1e-9).ceil().max(0.0);
        let origin = (area.west - before(west, area.west) * step_m, area.south - before(south, area.south) * step_m);
        let count = |from: f64, to: f64| ((to - from) / step_m + 1e-9).floor() as usize + 1;
        let (columns, rows) = (count(origin.0, east), count(origin.1, north));
        let over = |first: f64, count: usize| (first as usize)..(first as usize + count);
        let area = (
            over(before(west, area.west), count(area.west, area.east)),
            over(before(south, area.south), count(area.south, area.north)),
        );
        let mut lattice = Self { origin, step_m, columns, rows, area, moves: vec![0; columns * rows] };
        let open: Vec<bool> = (0..columns * rows).map(|n| bounds.allows(lattice.place(n))).collect();
        for node in 0..columns * rows {
            let allowed = (0..MOVES.len()).filter(|&m| {
                let to = lattice.moved(node, m);
                to.is_some_and(|to| open[to] && bounds.allows_leg(lattice.place(node), lattice.place(to)))
            });
            lattice.moves[node] = if open[node] { allowed.fold(0, |mask, m| mask | 1 << m) } else { 0 };
        }
        lattice
    }

    /// Distance in metres between neighbouring places of a row.
    pub fn step_m(&self) -> f64 {
        self.step_m
    }

    /// The number of columns and of rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.rows)
    }

    /// The places of each row over the area, from the south, without those beyond it.
    pub fn area_rows(&self) -> impl Iterator<Item = Range<Node>> + '_ {
        let (columns, rows) = self.area.clone();
        rows.map(move |row| row * self.columns + columns.start..row * self.columns + columns.end)
    }

    pub fn places(&self) -> usize {
        self.moves.len()
    }

    pub fn place(&self, node: Node) -> Point {
        let (column, row) = (node % self.columns, node / self.columns);
        (self.origin.0 + column as f64 * self.step_m, self.origin.1 + row as f64 * self.step_m)
    }

    /// Whether the vehicle can leave a place, and may hence be there.
    pub fn is_open(&self, node: Node) -> bool {
        self.moves[node] != 0
    }

    fn moved(&self, node: Node, m: usize) -> Option<Node> {
        let (dx, dy) = MOVES[m];
        let column = (node % self.columns).checked_add_signed(dx as isize)?;
        let row = (node / self.columns).checked_add_signed(dy as isize)?;
        (column < self.columns && row < self.rows).then_some(row * self.columns + column)
    }

    /// The neighbours that can be reached from a place, each with its distance in metres.
    pub fn around(&self, node: Node) -> impl Iterator<Item = (Node, f64)> + '_ {
        let mask = self.moves[node];
        (0..MOVES.len()).filter(move |m| mask & 1 << m != 0).filter_map(move |m| {
            let length = if m % 2 == 0 { self.step_m } else { self.step_m * std::f64::consts::SQRT_2 };
            Some((self.moved(node, m)?, length))
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
        let near_m = 6.0 * self.step_m;
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
        let (x, y) = (steps(from % self.columns, to % self.columns), steps(from / self.columns, to / self.columns));
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
        let mut paths = Paths { metres: vec![f64::INFINITY; self.places()], before: vec![from; self.places()] };
        paths.metres[from] = 0.0;
        // Keys in whole micrometres have a total order, and ties are broken by the place, so that the tree is the same
        // on every machine.
        let key = |metres: f64| (metres * 1e6) as u64;
        let mut queue = BinaryHeap::from([Reverse((0u64, from))]);
        while let Some(Reverse((length, node))) = queue.pop() {
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
    fn a_far_return_point_is_on_the_lattice_too() {
        let lattice = Lattice::new(AREA, &[(-35.0, 5.0)], 1.0, &Bounds::default());
        let home = lattice.entry((-35.0, 5.0), &Bounds::default()).unwrap();
        assert!(distance(lattice.place(home), (-35.0, 5.0)) < 1.0);
        let huge = Lattice::new(AREA, &[(-35_000.0, 5.0)], 1.0, &Bounds::default());
        assert!(huge.places() <= MAX_SIDE * MAX_SIDE);
    }
}
