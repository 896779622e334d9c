//! The planners: the value of each part of the sea floor, the lattice, and the choice of a path over it.

mod bounds;
mod expect;
mod horizon;
mod lattice;
mod lawnmower;
mod legs;
mod value;

pub use bounds::{Bounds, Point, distance};
pub use expect::{Expectation, SeenLabels};
pub use horizon::Horizon;
pub use lattice::{Lattice, Node, Paths};
pub use lawnmower::{Greedy, Lawnmower};
pub use legs::{legs, length_m};
pub use value::{BlockValues, CellWindow, Interest, Knowledge, ShownBlocks};

use scenecast_protocol::directive::PlannerKind;

/// The situation that a planner is given.
#[derive(Debug)]
pub struct PlanRequest<'a> {
    pub lattice: &'a Lattice,
    /// The value of the next look at each block.
    pub values: &'a BlockValues,
    pub from: Node,
    /// The paths from the place where the survey must be able to end.
    pub return_paths: &'a Paths,
    /// Metres that may still be travelled from `from`, the return path included; infinite without a limit.
    pub left_m: f64,
}

impl PlanRequest<'_> {
    /// Whether the return path from `node` is still allowed after `gone_m` metres.
    pub fn can_return(&self, node: Node, gone_m: f64) -> bool {
        // Without a limit, a place without a return path is allowed too: the vehicle is cut off in either case.
        !self.left_m.is_finite() || gone_m + self.return_paths.metres[node] <= self.left_m + 1e-6
    }
}

/// Chooses a path.
///
/// The places of a plan are neighbours on the lattice, the first one next to [`PlanRequest::from`], and the return path
/// from each fits into the remaining distance. An empty plan means that there is no gain, or no distance left. The same
/// requests in the same order get the same plans.
pub trait Planner: std::fmt::Debug + Send {
    /// The next places of the path.
    fn plan(&mut self, request: &PlanRequest<'_>) -> Vec<Node>;

    /// The places to visit after the last plan, the next one first, each by the shortest path. Empty where the
    /// planner decides only on arrival.
    fn beyond(&self) -> Vec<Node> {
        Vec::new()
    }

    /// The vehicle leaves its path at a place, and will come back to it.
    fn handle_leave(&mut self, _at: Node, _lattice: &Lattice) {}

    /// The lattice has changed, and with it the numbers of the places. `before` is the last one.
    fn handle_change(&mut self, _before: &Lattice) {}
}

pub fn planner(kind: PlannerKind) -> Box<dyn Planner> {
    match kind {
        PlannerKind::Lawnmower => Box::new(Lawnmower::default()),
        PlannerKind::Greedy => Box::new(Greedy),
        PlannerKind::Horizon => Box::new(Horizon::default()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use scenecast_core::Area;
    use scenecast_protocol::coordinates::DecimetrePoint;
    use scenecast_protocol::directive::{Fence, Polygon, Utility};
    use scenecast_protocol::map::{Cell, LabelGrid};

    const AREA: Area = Area { west: 0.0, south: 0.0, east: 20.0, north: 14.0 };

    /// The plan on a patchy map with a keep-out, and whether each of its places is allowed.
    fn ask(kind: PlannerKind, corner: (i32, i32), start: usize, left_m: f64, weights: (i8, i8)) -> (Vec<Node>, bool) {
        let place = |x: i32, y: i32| DecimetrePoint::new(10 * x, 10 * y);
        let (x, y) = corner;
        let keep_out = Polygon(vec![place(x, y), place(x + 4, y + 1), place(x + 2, y + 5)]);
        let bounds = Bounds::new(&Fence { keep_outs: vec![keep_out], ..Fence::default() }, 0.5);
        let lattice = Lattice::new(AREA, &[], 0.9, &bounds);
        let seen = (0..40).flat_map(|y| (0..50).map(move |x| (x, y)));
        let map: LabelGrid = seen.map(|(x, y)| (Cell::new(x, y), ((x / 9 + y / 7) % 3 + 1) as u8)).collect();
        let weights = [(1, weights.0), (2, weights.1)].into_iter().collect();
        let utility = Utility { exploration: 5, weights, ..Utility::default() };
        let values = BlockValues::new(
            &lattice,
            (&CellWindow::new(AREA, 0.25), (0.0, 0.0)),
            &map,
            &Knowledge::default(),
            Interest::in_labels(&utility),
        );
        let open: Vec<Node> = (0..lattice.places()).filter(|&n| lattice.is_open(n)).collect();
        let (from, home) = (open[start % open.len()], lattice.paths(open[(start / 7) % open.len()]));
        let request = PlanRequest { lattice: &lattice, values: &values, from, return_paths: &home, left_m };
        let path = planner(kind).plan(&request);
        let (mut at, mut gone_m, mut is_allowed) = (from, 0.0, true);
        for &node in &path {
            let step = lattice.around(at).find(|(n, _)| *n == node).map_or(f64::INFINITY, |(_, step)| step);
            (at, gone_m) = (node, gone_m + step);
            is_allowed &= bounds.allows(lattice.place(node)) && gone_m + home.metres[node] <= left_m + 1e-6;
        }
        (path, is_allowed)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn every_plan_is_allowed_leaves_a_return_path_and_repeats(
            corner in (1i32..15, 1i32..8), start in 0usize..100_000, left_m in 0.0f64..80.0,
            weights in (-100i8..=100, -100i8..=100),
        ) {
            for kind in PlannerKind::ALL {
                let (path, is_allowed) = ask(kind, corner, start, left_m, weights);
                prop_assert!(is_allowed, "{kind:?}: {path:?}");
                prop_assert_eq!(&path, &ask(kind, corner, start, left_m, weights).0);
            }
        }
    }

    #[test]
    fn every_planner_moves_while_distance_is_left() {
        for kind in PlannerKind::ALL {
            assert!(!ask(kind, (8, 4), 200, 80.0, (100, 0)).0.is_empty(), "{kind:?}");
        }
    }
}
