//! The planners without a horizon: parallel legs over the whole area, and always the best gain a metre.

use super::bounds::{Point, distance};
use super::lattice::{Lattice, Node, Paths};
use super::{PlanRequest, Planner};

/// Parallel legs over the area from one side to the other. After the last leg it begins again from there. After a change of the
/// lattice it resumes at the leg that it was on.
#[derive(Debug, Default)]
pub struct Lawnmower {
    /// Places still to visit, the next one last.
    coming: Vec<Node>,
    /// Whether the legs begin in the north or east.
    is_backward: bool,
    /// The next place before the lattice changed.
    resume: Option<Point>,
}

impl Lawnmower {
    /// The places of all legs, the first one last; after a change of the lattice, those that were not visited yet.
    fn lay_out(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        let mut legs = legs(q);
        let resume = self.resume.take();
        if resume.is_none() {
            // Begins at the nearer end.
            let paths = q.lattice.paths(q.from);
            let metres = |node: Option<&Node>| node.map_or(f64::INFINITY, |&n| paths.metres[n]);
            self.is_backward = metres(legs.first()) > metres(legs.last());
        }
        if !self.is_backward {
            legs.reverse();
        }
        let Some(next) = resume else { return legs };
        let half = q.lattice.step_m() / 2.0;
        let is_next = |n: &Node| distance(q.lattice.place(*n), next) < half;
        let ahead = |n: &Node| q.lattice.across_legs(q.lattice.place(*n)) - q.lattice.across_legs(next);
        let is_later = |n: &Node| if self.is_backward { ahead(n) < half } else { ahead(n) > -half };
        if let Some(at) = legs.iter().rposition(is_next).or_else(|| legs.iter().rposition(is_later)) {
            legs.truncate(at + 1);
        }
        legs
    }
}

impl Planner for Lawnmower {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        if self.coming.is_empty() {
            self.coming = self.lay_out(q);
        }
        while let Some(&next) = self.coming.last() {
            if next == q.from {
                self.coming.pop();
                continue;
            }
            let paths = q.lattice.paths(q.from);
            let mut path = paths.to(next);
            if path.is_empty() {
                self.coming.pop();
                continue;
            }
            path.truncate(path.iter().take_while(|&&n| q.can_return(n, paths.metres[n])).count());
            return path;
        }
        Vec::new()
    }

    fn beyond(&self) -> Vec<Node> {
        self.coming.iter().rev().copied().collect()
    }

    fn handle_change(&mut self, before: &Lattice) {
        if let Some(&next) = self.coming.last() {
            self.resume = Some(before.place(next));
        }
        self.coming.clear();
    }
}

/// The ends of the open stretches of every other line of the area, in alternating direction.
fn legs(q: &PlanRequest<'_>) -> Vec<Node> {
    let mut legs = Vec::new();
    for (leg, line) in q.lattice.lines().into_iter().step_by(2).enumerate() {
        let is_open = |n: &Node| q.lattice.is_open(*n) && q.return_paths.metres[*n].is_finite();
        let next = line.get(1).map_or(1, |second| second - line[0]);
        let mut stretch: Vec<Node> = line.into_iter().filter(is_open).collect();
        if leg % 2 == 1 {
            stretch.reverse();
        }
        let inner = |i: usize| {
            let joined =
                |j: Option<usize>| j.and_then(|j| stretch.get(j)).is_some_and(|&n| stretch[i].abs_diff(n) == next);
            joined(i.checked_sub(1)) && joined(Some(i + 1))
        };
        legs.extend((0..stretch.len()).filter(|&i| !inner(i)).map(|i| stretch[i]));
    }
    legs
}

/// Goes to the place with the greatest gain for each metre of path. The gain includes everything that
/// is seen along the path.
#[derive(Debug)]
pub struct Greedy;

impl Planner for Greedy {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        best_gain(q).0
    }
}

/// The path with the best gain a metre, and this rate.
pub(super) fn best_gain(q: &PlanRequest<'_>) -> (Vec<Node>, f64) {
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
