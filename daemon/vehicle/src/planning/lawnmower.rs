//! The planner that covers the whole area in parallel legs.

use super::bounds::{Point, distance};
use super::lattice::{Lattice, Node};
use super::{PlanRequest, Planner};

/// East-west legs from the south, each one camera width from the last. After the last leg it
/// begins again from the north. After a change of the lattice it resumes at the leg that it was on.
#[derive(Debug, Default)]
pub struct Lawnmower {
    /// Places still to visit, the next one last.
    coming: Vec<Node>,
    /// Whether the legs begin in the north.
    is_southward: bool,
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
            self.is_southward = metres(legs.first()) > metres(legs.last());
        }
        if !self.is_southward {
            legs.reverse();
        }
        let Some(next) = resume else { return legs };
        let half = q.lattice.step_m() / 2.0;
        let is_next = |n: &Node| distance(q.lattice.place(*n), next) < half;
        let is_later = |n: &Node| match self.is_southward {
            true => q.lattice.place(*n).1 < next.1 + half,
            false => q.lattice.place(*n).1 > next.1 - half,
        };
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

/// The ends of the open stretches of every other row of the area, in alternating direction.
fn legs(q: &PlanRequest<'_>) -> Vec<Node> {
    let mut legs = Vec::new();
    for (leg, row) in q.lattice.area_rows().step_by(2).enumerate() {
        let is_open = |n: &Node| q.lattice.is_open(*n) && q.return_paths.metres[*n].is_finite();
        let mut stretch: Vec<Node> = row.filter(is_open).collect();
        if leg % 2 == 1 {
            stretch.reverse();
        }
        let inner = |i: usize| {
            let joined =
                |j: Option<usize>| j.and_then(|j| stretch.get(j)).is_some_and(|&n| stretch[i].abs_diff(n) == 1);
            joined(i.checked_sub(1)) && joined(Some(i + 1))
        };
        legs.extend((0..stretch.len()).filter(|&i| !inner(i)).map(|i| stretch[i]));
    }
    legs
}
