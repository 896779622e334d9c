//! The planners without a horizon: parallel legs over the whole area, and always the best gain a metre.

use super::bounds::{Point, distance, to_segment};
use super::lattice::{Lattice, Node, Paths};
use super::legs::legs;
use super::{PlanRequest, Planner};

/// Parallel legs over the area, part by part. After the last leg it begins again from there. What was flown of a pass is not flown
/// again after a change of the lattice.
#[derive(Debug, Default)]
pub struct Lawnmower {
    /// The ends of legs still to visit, the next one last.
    coming: Vec<Node>,
    /// The end that was visited last.
    begun: Option<Node>,
    /// The place from which the vehicle left its leg.
    left: Option<Node>,
    /// What was flown of this pass.
    flown: Vec<(Point, Point)>,
    change: Option<Change>,
}

/// What a change of the lattice interrupted: the leg, and the place from which the vehicle had left it.
#[derive(Debug, Default)]
struct Change {
    leg: Option<(Point, Point)>,
    left: Option<Point>,
}

impl Lawnmower {
    /// The ends of all legs, the first one last; after a change of the lattice, those of what was not flown yet.
    fn lay_out(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        let change = self.change.take();
        if let Some(Change { leg: Some((from, to)), left }) = &change {
            let here = left.unwrap_or_else(|| q.lattice.place(q.from));
            self.flown.extend(as_far_as((*from, *to), here, q.lattice.step_m()).map(|end| (*from, end)));
        }
        if change.is_none() {
            self.flown.clear();
        }
        let mut legs = self.unflown(q);
        if legs.is_empty() && !self.flown.is_empty() {
            self.flown.clear();
            legs = self.unflown(q);
        }
        legs.reverse();
        legs
    }

    fn unflown(&self, q: &PlanRequest<'_>) -> Vec<Node> {
        let half = q.lattice.step_m() / 2.0;
        let is_flown = |node| self.flown.iter().any(|leg| to_segment(q.lattice.place(node), leg.0, leg.1) < half);
        // The rest of a leg begins where the vehicle is.
        let is_left = |node| node == q.from || !is_flown(node);
        let legs = legs(q.lattice, q.from, |node| q.return_paths.metres[node].is_finite() && is_left(node));
        if legs == [q.from] { Vec::new() } else { legs }
    }

    /// The leg that the vehicle is on, if it is not between two of them.
    fn leg(&self, lattice: &Lattice) -> Option<(Point, Point)> {
        let (from, to) = (lattice.place(self.begun?), lattice.place(*self.coming.last()?));
        ((lattice.along_legs(to) - lattice.along_legs(from)).abs() + 1e-6 > distance(from, to)).then_some((from, to))
    }

    fn handle_arrival(&mut self, lattice: &Lattice) {
        self.flown.extend(self.leg(lattice));
        (self.begun, self.left) = (self.coming.pop(), None);
    }
}

/// The end of the part of a leg that was flown by a vehicle that is `here`; `None` if that is not on the leg.
fn as_far_as((from, to): (Point, Point), here: Point, near_m: f64) -> Option<Point> {
    let (x, y) = (to.0 - from.0, to.1 - from.1);
    let share = ((here.0 - from.0) * x + (here.1 - from.1) * y) / (x * x + y * y).max(1e-9);
    let end = (from.0 + share * x, from.1 + share * y);
    ((0.0..=1.0).contains(&share) && distance(here, end) <= near_m).then_some(end)
}

impl Planner for Lawnmower {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        if self.coming.is_empty() {
            self.coming = self.lay_out(q);
        }
        while let Some(&next) = self.coming.last() {
            if next == q.from {
                self.handle_arrival(q.lattice);
                continue;
            }
            if let Some(left) = self.left.take().filter(|&left| left != q.from && left != next) {
                self.coming.push(left);
                continue;
            }
            let paths = q.lattice.paths(q.from);
            let mut path = paths.to(next);
            if path.is_empty() {
                self.coming.pop();
                self.begun = None;
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

    fn handle_leave(&mut self, at: Node, lattice: &Lattice) {
        let is_on_it =
            self.leg(lattice).is_some_and(|leg| as_far_as(leg, lattice.place(at), lattice.step_m()).is_some());
        self.left = Some(at).filter(|_| is_on_it);
    }

    fn handle_change(&mut self, before: &Lattice) {
        let leg = self.leg(before);
        // Of several changes before the next plan, the first one knows the leg.
        self.change.get_or_insert_default();
        if let Some(change) = self.change.as_mut().filter(|_| leg.is_some()) {
            (change.leg, change.left) = (leg, self.left.map(|left| before.place(left)));
        }
        (self.begun, self.left) = (None, None);
        self.coming.clear();
    }
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
