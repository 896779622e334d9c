//! The planner that searches the best path over a horizon of many steps, and the gain along the return path.

use super::lattice::Node;
use super::{PlanRequest, Planner, lawnmower};

/// A beam search over long paths. It is an orienteering problem in which each block gives its gain once.
///
/// The score of a path is its gain minus the gain that its metres would bring elsewhere. That rate is the best one that
/// an earlier search has found (Dinkelbach's method for ratios). Near the end of the allowed distance, paths are
/// searched up to the return point, with everything that is shown along the return path.
#[derive(Debug)]
pub struct Horizon {
    pub steps: usize,
    /// Paths that are kept after each step.
    pub beam: usize,
    /// Paths that are kept of those that end at the same place.
    pub alike: usize,
    /// Searches; each takes the rate of the one before.
    pub rounds: usize,
    /// Number of horizons before the end of the allowed distance at which the rest is planned at once.
    pub closing: f64,
}

impl Default for Horizon {
    fn default() -> Self {
        Self { steps: 24, beam: 150, alike: 3, rounds: 2, closing: 3.0 }
    }
}

/// A path that ends at `node`. All paths form a tree.
#[derive(Debug, Clone, Copy)]
struct PathEnd {
    node: Node,
    before: usize,
    gain: f64,
    metres: f64,
}

impl Planner for Horizon {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        let closing_m = self.closing * self.steps as f64 * q.lattice.step_m();
        if q.left_m <= closing_m && q.return_paths.metres[q.from].is_finite() {
            return self.close(q);
        }
        let mut rate = 0.0;
        let mut best = Vec::new();
        let mut own = f64::MIN;
        for _ in 0..self.rounds {
            let (path, found) = self.search(q, rate);
            (best, own) = (path, found);
            if found <= rate {
                break;
            }
            rate = found;
        }
        // Where everything around is seen, every path of the beam turns on the spot; the greedy path leads out.
        let (path, found) = lawnmower::best_gain(q);
        if found > own { path } else { best }
    }
}

impl Horizon {
    /// The best path at a cost of `rate` a metre, and its gain a metre.
    fn search(&self, q: &PlanRequest<'_>, rate: f64) -> (Vec<Node>, f64) {
        let (paths, last) = self.grow(q, self.steps, |w| w.gain - rate * w.metres);
        let end = paths[last];
        (nodes(&paths, last), if end.metres > 0.0 { end.gain / end.metres } else { 0.0 })
    }

    /// The best path for the rest of the allowed distance, with the return path in it.
    fn close(&self, q: &PlanRequest<'_>) -> Vec<Node> {
        let back = ReturnGains::new(q);
        let steps = (q.left_m / q.lattice.step_m()).ceil() as usize;
        let mut rate = 0.0;
        let mut best = (f64::MIN, Vec::new());
        for _ in 0..self.rounds {
            let in_all = |w: &PathEnd| w.gain + back.gain(w.node);
            let (mut paths, _) = self.grow(q, steps, |w| in_all(w) - rate * (w.metres + q.return_paths.metres[w.node]));
            let mut ends: Vec<usize> = (0..paths.len()).collect();
            ends.sort_by(|&a, &b| in_all(&paths[b]).total_cmp(&in_all(&paths[a])).then(a.cmp(&b)));
            for &end in ends.iter().take(self.beam) {
                let mut at = end;
                for node in back.nodes(paths[end].node) {
                    let gain = paths[at].gain + fresh(q, &paths, at, node);
                    paths.push(PathEnd { node, before: at, gain, metres: paths[at].metres });
                    at = paths.len() - 1;
                }
                if paths[at].gain > best.0 {
                    best = (paths[at].gain, nodes(&paths, at));
                }
            }
            rate = best.0 / q.left_m.max(1e-9);
        }
        best.1
    }

    /// Grows allowed paths of up to `steps` steps and keeps the best by `score` at each length. Also returns
    /// the best of the longest.
    fn grow(&self, q: &PlanRequest<'_>, steps: usize, score: impl Fn(&PathEnd) -> f64) -> (Vec<PathEnd>, usize) {
        let mut paths = vec![PathEnd { node: q.from, before: 0, gain: 0.0, metres: 0.0 }];
        let mut beam = vec![0usize];
        let mut best = 0usize;
        for _ in 0..steps {
            let mut next: Vec<PathEnd> = Vec::new();
            for &at in &beam {
                for (node, step) in q.lattice.around(paths[at].node) {
                    let metres = paths[at].metres + step;
                    if q.can_return(node, metres) {
                        let gain = paths[at].gain + fresh(q, &paths, at, node);
                        next.push(PathEnd { node, before: at, gain, metres });
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            next.sort_by(|a, b| score(b).total_cmp(&score(a)).then(a.node.cmp(&b.node)).then(a.before.cmp(&b.before)));
            self.thin(&mut next);
            beam = (paths.len()..paths.len() + next.len()).collect();
            best = paths.len();
            paths.extend(next);
        }
        (paths, best)
    }

    /// Keeps the first paths, and a limited number of those that end at the same place.
    fn thin(&self, paths: &mut Vec<PathEnd>) {
        let mut ends: std::collections::BTreeMap<Node, usize> = std::collections::BTreeMap::new();
        paths.retain(|w| {
            let n = ends.entry(w.node).or_default();
            *n += 1;
            *n <= self.alike
        });
        paths.truncate(self.beam);
    }
}

/// The places of a path without its start.
fn nodes(paths: &[PathEnd], end: usize) -> Vec<Node> {
    let mut nodes: Vec<Node> = back_to_start(paths, end).map(|w| w.node).collect();
    nodes.reverse();
    nodes
}

/// The steps of a path from its end to the first one after the start.
fn back_to_start(paths: &[PathEnd], end: usize) -> impl Iterator<Item = PathEnd> + '_ {
    std::iter::successors(Some(end).filter(|&e| e > 0), |&at| Some(paths[at].before).filter(|&b| b > 0))
        .map(|at| paths[at])
}

/// The sum of the values of the blocks that a place shows and that no earlier place of the path has shown.
fn fresh(q: &PlanRequest<'_>, paths: &[PathEnd], at: usize, node: Node) -> f64 {
    let mut blocks = q.values.shown(node).map(Some);
    for path in back_to_start(paths, at) {
        if path.node.abs_diff(node) <= 2 * q.lattice.size().0 {
            let shown = q.values.shown(path.node);
            blocks.iter_mut().filter(|b| b.is_some_and(|b| shown.contains(&b))).for_each(|b| *b = None);
        }
    }
    blocks.into_iter().flatten().map(|b| f64::from(q.values.of(b))).sum()
}

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
