//! The best way over a horizon.

use super::lattice::Node;
use super::way_back::WayBack;
use super::{Planner, Question, greedy};

/// A beam search over ways of many steps: orienteering with a gain that each block gives once.
///
/// A way's score is its gain less what its metres would bring elsewhere; that rate is the best one that a search has found
/// (Dinkelbach's method for ratios). Near the end of what may be gone, ways are searched to their end at home, with all that
/// is shown on the way back.
#[derive(Debug)]
pub struct Horizon {
    pub steps: usize,
    /// Ways kept after each step.
    pub beam: usize,
    /// Ways kept that end at the same place.
    pub alike: usize,
    /// Searches, each with the rate of the last.
    pub rounds: usize,
    /// Horizons from the end at which all that is left is planned at once.
    pub closing: f64,
}

impl Default for Horizon {
    fn default() -> Self {
        Self { steps: 24, beam: 150, alike: 3, rounds: 2, closing: 3.0 }
    }
}

/// A way that ends at `node`; the ways are a tree.
#[derive(Debug, Clone, Copy)]
struct Way {
    node: Node,
    before: usize,
    gain: f64,
    metres: f64,
}

impl Planner for Horizon {
    fn plan(&mut self, q: &Question<'_>) -> Vec<Node> {
        let closing_m = self.closing * self.steps as f64 * q.lattice.step_m();
        if q.left_m <= closing_m && q.home.metres[q.from].is_finite() {
            return self.close(q);
        }
        let mut rate = 0.0;
        let mut best = Vec::new();
        let mut own = f64::MIN;
        for _ in 0..self.rounds {
            let (way, found) = self.search(q, rate);
            (best, own) = (way, found);
            if found <= rate {
                break;
            }
            rate = found;
        }
        // Where all around is seen, every way of the beam turns on the spot: the greedy one leads out.
        let (way, found) = greedy::best(q);
        if found > own { way } else { best }
    }
}

impl Horizon {
    /// The best way at a cost of `rate` a metre, and its own gain a metre.
    fn search(&self, q: &Question<'_>, rate: f64) -> (Vec<Node>, f64) {
        let (ways, last) = self.grow(q, self.steps, |w| w.gain - rate * w.metres);
        let end = ways[last];
        (nodes(&ways, last), if end.metres > 0.0 { end.gain / end.metres } else { 0.0 })
    }

    /// The best way for all that is left, the way home included.
    fn close(&self, q: &Question<'_>) -> Vec<Node> {
        let back = WayBack::new(q);
        let steps = (q.left_m / q.lattice.step_m()).ceil() as usize;
        let mut rate = 0.0;
        let mut best = (f64::MIN, Vec::new());
        for _ in 0..self.rounds {
            let in_all = |w: &Way| w.gain + back.gain(w.node);
            let (mut ways, _) = self.grow(q, steps, |w| in_all(w) - rate * (w.metres + q.home.metres[w.node]));
            let mut ends: Vec<usize> = (0..ways.len()).collect();
            ends.sort_by(|&a, &b| in_all(&ways[b]).total_cmp(&in_all(&ways[a])).then(a.cmp(&b)));
            for &end in ends.iter().take(self.beam) {
                let mut at = end;
                for node in back.nodes(ways[end].node) {
                    let gain = ways[at].gain + fresh(q, &ways, at, node);
                    ways.push(Way { node, before: at, gain, metres: ways[at].metres });
                    at = ways.len() - 1;
                }
                if ways[at].gain > best.0 {
                    best = (ways[at].gain, nodes(&ways, at));
                }
            }
            rate = best.0 / q.left_m.max(1e-9);
        }
        best.1
    }

    /// Ways of up to so many steps that may be gone, the best by `score` of each number of steps; and the best of the longest.
    fn grow(&self, q: &Question<'_>, steps: usize, score: impl Fn(&Way) -> f64) -> (Vec<Way>, usize) {
        let mut ways = vec![Way { node: q.from, before: 0, gain: 0.0, metres: 0.0 }];
        let mut beam = vec![0usize];
        let mut best = 0usize;
        for _ in 0..steps {
            let mut next: Vec<Way> = Vec::new();
            for &at in &beam {
                for (node, step) in q.lattice.around(ways[at].node) {
                    let metres = ways[at].metres + step;
                    if q.can_return(node, metres) {
                        let gain = ways[at].gain + fresh(q, &ways, at, node);
                        next.push(Way { node, before: at, gain, metres });
                    }
                }
            }
            if next.is_empty() {
                break;
            }
            next.sort_by(|a, b| score(b).total_cmp(&score(a)).then(a.node.cmp(&b.node)).then(a.before.cmp(&b.before)));
            self.thin(&mut next);
            beam = (ways.len()..ways.len() + next.len()).collect();
            best = ways.len();
            ways.extend(next);
        }
        (ways, best)
    }

    /// Keeps the first ways, and not too many that end at the same place.
    fn thin(&self, ways: &mut Vec<Way>) {
        let mut ends: std::collections::BTreeMap<Node, usize> = std::collections::BTreeMap::new();
        ways.retain(|w| {
            let n = ends.entry(w.node).or_default();
            *n += 1;
            *n <= self.alike
        });
        ways.truncate(self.beam);
    }
}

/// The places of a way, from the one after the start to its end.
fn nodes(ways: &[Way], end: usize) -> Vec<Node> {
    let mut nodes: Vec<Node> = back_to_start(ways, end).map(|w| w.node).collect();
    nodes.reverse();
    nodes
}

/// The way's places from its end to the one after the start.
fn back_to_start(ways: &[Way], end: usize) -> impl Iterator<Item = Way> + '_ {
    std::iter::successors(Some(end).filter(|&e| e > 0), |&at| Some(ways[at].before).filter(|&b| b > 0))
        .map(|at| ways[at])
}

/// Worth of the blocks that a place shows and no place of the way before it has shown.
fn fresh(q: &Question<'_>, ways: &[Way], at: usize, node: Node) -> f64 {
    let mut blocks = q.worth.shown(node).map(Some);
    for way in back_to_start(ways, at) {
        if way.node.abs_diff(node) <= 2 * q.lattice.size().0 {
            let shown = q.worth.shown(way.node);
            blocks.iter_mut().filter(|b| b.is_some_and(|b| shown.contains(&b))).for_each(|b| *b = None);
        }
    }
    blocks.into_iter().flatten().map(|b| f64::from(q.worth.of(b))).sum()
}
