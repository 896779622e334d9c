//! The best gain a metre, again and again.

use super::lattice::{Node, Ways};
use super::{Planner, Question};

/// Goes to the place with the greatest gain a metre of way, what is seen on the way included.
#[derive(Debug)]
pub struct Greedy;

impl Planner for Greedy {
    fn plan(&mut self, q: &Question<'_>) -> Vec<Node> {
        best(q).0
    }
}

/// The way with the best gain a metre, and that rate.
pub(super) fn best(q: &Question<'_>) -> (Vec<Node>, f64) {
    let ways = q.lattice.ways(q.from);
    let mut mark = vec![usize::MAX; q.worth.blocks()];
    let mut best = (f64::MIN, None);
    for node in (0..q.lattice.places()).filter(|&n| n != q.from && ways.metres[n].is_finite()) {
        if !q.can_return(node, ways.metres[node]) {
            continue;
        }
        // To turn and settle costs as much as half a camera's width.
        let rate = gain_on_way(q, &ways, node, &mut mark) / (ways.metres[node] + q.lattice.step_m());
        if rate > best.0 {
            best = (rate, Some(node));
        }
    }
    let way = best.1.map(|node| ways.to(node)).unwrap_or_default();
    (way.into_iter().take_while(|&n| q.can_return(n, ways.metres[n])).collect(), best.0)
}

/// Worth of every block that is shown on the way to a place, each once; `mark` says by which call a block was counted.
fn gain_on_way(q: &Question<'_>, ways: &Ways, to: Node, mark: &mut [usize]) -> f64 {
    let mut gain = 0.0;
    for node in ways.to(to) {
        for block in q.worth.shown(node) {
            if mark[block] != to {
                mark[block] = to;
                gain += f64::from(q.worth.of(block));
            }
        }
    }
    gain
}
