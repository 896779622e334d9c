//! The best gain a metre, again and again.

use super::lattice::{Node, Paths};
use super::{PlanRequest, Planner};

/// Goes to the place with the greatest gain a metre of path, what is seen on the path included.
#[derive(Debug)]
pub struct Greedy;

impl Planner for Greedy {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        best(q).0
    }
}

/// The path with the best gain a metre, and that rate.
pub(super) fn best(q: &PlanRequest<'_>) -> (Vec<Node>, f64) {
    let paths = q.lattice.paths(q.from);
    let mut mark = vec![usize::MAX; q.values.blocks()];
    let mut best = (f64::MIN, None);
    for node in (0..q.lattice.places()).filter(|&n| n != q.from && paths.metres[n].is_finite()) {
        if !q.can_return(node, paths.metres[node]) {
            continue;
        }
        // To turn and settle costs as much as half a camera's width.
        let rate = gain_on_way(q, &paths, node, &mut mark) / (paths.metres[node] + q.lattice.step_m());
        if rate > best.0 {
            best = (rate, Some(node));
        }
    }
    let path = best.1.map(|node| paths.to(node)).unwrap_or_default();
    (path.into_iter().take_while(|&n| q.can_return(n, paths.metres[n])).collect(), best.0)
}

/// BlockValues of every block that is shown on the path to a place, each once; `mark` says by which call a block was counted.
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
