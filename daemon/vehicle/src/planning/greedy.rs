//! The planner that always takes the best gain a metre.

use super::lattice::{Node, Paths};
use super::{PlanRequest, Planner};

/// Goes to the place with the greatest gain for each metre of path. The gain includes everything that
/// is seen along the path.
#[derive(Debug)]
pub struct Greedy;

impl Planner for Greedy {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        best(q).0
    }
}

/// The path with the best gain a metre, and this rate.
pub(super) fn best(q: &PlanRequest<'_>) -> (Vec<Node>, f64) {
    let paths = q.lattice.paths(q.from);
    let mut mark = vec![usize::MAX; q.values.blocks()];
    let mut best = (f64::MIN, None);
    for node in (0..q.lattice.places()).filter(|&n| n != q.from && paths.metres[n].is_finite()) {
        if !q.can_return(node, paths.metres[node]) {
            continue;
        }
        // A stop and a turn cost as much as one step of the lattice.
        let rate = gain_on_way(q, &paths, node, &mut mark) / (paths.metres[node] + q.lattice.step_m());
        if rate > best.0 {
            best = (rate, Some(node));
        }
    }
    let path = best.1.map(|node| paths.to(node)).unwrap_or_default();
    (path.into_iter().take_while(|&n| q.can_return(n, paths.metres[n])).collect(), best.0)
}

/// The sum of the values of all blocks that are shown along the path to a place, each block once. `mark` holds the
/// place by which a block was counted last.
fn gain_on_way(q: &PlanRequest<'_>, paths: &Paths, to: Node, mark: &mut [usize]) -> f64 {
    let mut gain = 0.0;
    for node in paths.to(to) {
        for block in q.values.shown(node) {
            if mark[block] != to {
                mark[block] = to;
                gain += f64::from(q.values.of(block));
            }
        }
    }
    gain
}
