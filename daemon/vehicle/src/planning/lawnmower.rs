//! The planner that covers the whole area in parallel legs.

use super::lattice::Node;
use super::{PlanRequest, Planner};

/// East-west legs from the south, each one camera width from the last. After the last leg it
/// begins again from the north.
#[derive(Debug, Default)]
pub struct Lawnmower {
    /// Places still to visit, the next one last.
    coming: Vec<Node>,
}

impl Planner for Lawnmower {
    fn plan(&mut self, q: &PlanRequest<'_>) -> Vec<Node> {
        if self.coming.is_empty() {
            self.coming = legs(q);
            // Begins at the nearer end.
            let paths = q.lattice.paths(q.from);
            let metres = |node: Option<&Node>| node.map_or(f64::INFINITY, |&n| paths.metres[n]);
            if metres(self.coming.first()) > metres(self.coming.last()) {
                // The order stays, because the list is taken from its end.
            } else {
                self.coming.reverse();
            }
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

    fn handle_change(&mut self) {
        self.coming.clear();
    }
}

/// The ends of the open stretches of every other row, in alternating direction.
fn legs(q: &PlanRequest<'_>) -> Vec<Node> {
    let (columns, rows) = q.lattice.size();
    let mut legs = Vec::new();
    for (leg, row) in (0..rows).step_by(2).enumerate() {
        let is_open = |n: &Node| q.lattice.is_open(*n) && q.return_paths.metres[*n].is_finite();
        let mut stretch: Vec<Node> = (row * columns..(row + 1) * columns).filter(is_open).collect();
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
