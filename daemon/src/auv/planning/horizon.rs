//! The best way over a horizon.

use super::lattice::Node;
use super::{Planner, Question, greedy};

/// A beam search over ways of many steps: orienteering with a gain that each block gives once.
///
/// A way's score is its gain less what its metres would bring elsewhere; that rate is the best one that a search has found
/// (Dinkelbach's method for ratios). Where all that is left fits the horizon, metres cost nothing.
#[derive(Debug)]
pub struct Horizon {
    /// Steps ahead.
    pub steps: usize,
    /// Ways kept after each step.
    pub beam: usize,
    /// Ways kept that end at the same place.
    pub alike: usize,
    /// Searches, each with the rate of the last.
    pub rounds: usize,
}

impl Default for Horizon {
    fn default() -> Self {
        Self { steps: 24, beam: 150, alike: 3, rounds: 2 }
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
        let horizon_m = self.steps as f64 * q.lattice.step_m();
        let mut rate = 0.0;
        let mut best = Vec::new();
        let mut own = f64::MIN;
        for _ in 0..self.rounds {
            let (way, found) = self.search(q, rate);
            (best, own) = (way, found);
            if q.left_m <= horizon_m || found <= rate {
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
        let mut ways = vec![Way { node: q.from, before: 0, gain: 0.0, metres: 0.0 }];
        let mut beam = vec![0usize];
        let mut best = 0usize;
        for _ in 0..self.steps {
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
            let score = |w: &Way| w.gain - rate * w.metres;
            next.sort_by(|a, b| score(b).total_cmp(&score(a)).then(a.node.cmp(&b.node)).then(a.before.cmp(&b.before)));
            self.thin(&mut next);
            beam = (ways.len()..ways.len() + next.len()).collect();
            best = ways.len();
            ways.extend(next);
        }
        let end = ways[best];
        let way = back_to_start(&ways, best).map(|w| w.node).collect::<Vec<_>>();
        (way.into_iter().rev().collect(), if end.metres > 0.0 { end.gain / end.metres } else { 0.0 })
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
