//! The gain along the return path.

use super::PlanRequest;
use super::lattice::Node;

/// For each place, the shortest return path with the greatest gain.
#[derive(Debug)]
pub struct ReturnGains {
    /// The sum of the values of the blocks that the return path shows and the place itself does not.
    gains: Vec<f64>,
    /// The next place of the return path; the place itself where the path ends.
    next: Vec<Node>,
}

/// Difference in metres below which two paths count as equally long.
const SAME_M: f64 = 1e-6;

impl ReturnGains {
    /// Covers every place whose return path fits into the remaining distance.
    pub fn new(q: &PlanRequest<'_>) -> Self {
        let metres = &q.return_paths.metres;
        let mut nodes: Vec<Node> = (0..q.lattice.places()).filter(|&n| metres[n] <= q.left_m).collect();
        nodes.sort_by(|&a, &b| metres[a].total_cmp(&metres[b]).then(a.cmp(&b)));
        let mut back = Self { gains: vec![0.0; metres.len()], next: (0..metres.len()).collect() };
        for node in nodes {
            let here = q.values.shown(node);
            let mut best = f64::MIN;
            for (to, step) in q.lattice.around(node) {
                if (metres[to] + step - metres[node]).abs() > SAME_M {
                    continue;
                }
                let fresh = q.values.shown(to).into_iter().filter(|block| !here.contains(block));
                let gain = back.gains[to] + fresh.map(|block| f64::from(q.values.of(block))).sum::<f64>();
                if gain > best {
                    (best, back.gains[node], back.next[node]) = (gain, gain, to);
                }
            }
        }
        back
    }

    /// The gain along the return path from a place.
    pub fn gain(&self, node: Node) -> f64 {
        self.gains[node]
    }

    /// The places of the return path after a place.
    pub fn nodes(&self, node: Node) -> impl Iterator<Item = Node> + '_ {
        let next = |&at: &Node| Some(self.next[at]).filter(|&next| next != at);
        std::iter::successors(next(&node), move |at| next(at))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{BlockValues, Bounds, CellWindow, Interest, Knowledge, Lattice};
    use super::*;
    use scenecast_core::Area;
    use scenecast_protocol::directive::Utility;
    use scenecast_protocol::map::{Cell, LabelGrid};

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 14.0 };

    /// Cells of label 1 within 1.5 m of a place, on a floor of label 2.
    fn values(lattice: &Lattice, at: (f64, f64)) -> BlockValues {
        let cell = |x: i32, y: i32| {
            let (east, north) = (0.25 * (f64::from(x) + 0.5), 0.25 * (f64::from(y) + 0.5));
            (Cell::new(x, y), if (east - at.0).hypot(north - at.1) < 1.5 { 1 } else { 2 })
        };
        let map: LabelGrid = (0..56).flat_map(|y| (0..80).map(move |x| cell(x, y))).collect();
        let utility = Utility { weights: [(1, 100)].into_iter().collect(), ..Utility::default() };
        BlockValues::new(
            lattice,
            (&CellWindow::new(AREA, 0.25), (0.0, 0.0)),
            &map,
            &Knowledge::default(),
            Interest::in_labels(&utility),
        )
    }

    #[test]
    fn of_equally_short_return_paths_the_most_valuable_is_taken() {
        let lattice = Lattice::new(AREA, &[], 1.0, &Bounds::default());
        let node = |x, y| lattice.entry((x, y), &Bounds::default()).unwrap();
        let (from, home) = (node(16.0, 8.0), lattice.paths(node(2.0, 2.0)));
        for patch in [(9.0, 8.0), (9.0, 2.0), (8.0, 5.0)] {
            let values = values(&lattice, patch);
            let q = PlanRequest {
                lattice: &lattice,
                values: &values,
                from,
                return_paths: &home,
                left_m: home.metres[from],
            };
            let back = ReturnGains::new(&q);
            let path: Vec<Node> = back.nodes(from).collect();
            let nearest = path.iter().map(|&n| super::super::distance(lattice.place(n), patch));
            assert!(nearest.fold(f64::MAX, f64::min) < 1.1, "{patch:?}: {path:?}");
            assert!(back.gain(from) > 10.0);
            let metres = path.iter().try_fold((from, 0.0), |(at, gone), &to| {
                lattice.around(at).find(|(n, _)| *n == to).map(|(_, step)| (to, gone + step))
            });
            let (end, metres) = metres.expect("neighbours");
            assert_eq!((end, (metres - q.left_m).abs() < 1e-6), (node(2.0, 2.0), true));
        }
    }
}
