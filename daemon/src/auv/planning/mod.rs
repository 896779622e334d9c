//! Which way to go: places, what they are worth, and the planners that choose among them.

mod bounds;
mod expect;
mod greedy;
mod horizon;
mod lattice;
mod lawnmower;
mod worth;

pub use bounds::{Area, Bounds, Point, distance};
pub use expect::{Expectation, Seen};
pub use greedy::Greedy;
pub use horizon::Horizon;
pub use lattice::{Lattice, Node, Ways};
pub use lawnmower::Lawnmower;
pub use worth::{Knowledge, Shown, Window, Worth};

use scenecast_protocol::directive::PlannerKind;

/// Where the vehicle is, what is left to it, and what there is to gain.
#[derive(Debug)]
pub struct Question<'a> {
    /// Places and ways that are allowed.
    pub lattice: &'a Lattice,
    /// What is to be gained.
    pub worth: &'a Worth,
    /// Where the way begins.
    pub from: Node,
    /// Ways from the place where it must be able to end.
    pub home: &'a Ways,
    /// Metres that may be gone from `from`, the way home included; infinite if there is no limit.
    pub left_m: f64,
}

impl Question<'_> {
    /// Whether the way home from `node` can still be gone after `gone_m` metres.
    pub fn can_return(&self, node: Node, gone_m: f64) -> bool {
        // A way that begins where no way home is known may go on: it is lost either way.
        !self.left_m.is_finite() || gone_m + self.home.metres[node] <= self.left_m + 1e-6
    }
}

/// Chooses a way.
///
/// The answer's places are neighbours on the lattice, the first next to [`Question::from`], and the way home from each is
/// within what is left. Empty: there is nothing to gain, or nothing left. The same questions in the same order get the same
/// answers.
pub trait Planner: std::fmt::Debug + Send {
    /// The way to go next.
    fn plan(&mut self, question: &Question<'_>) -> Vec<Node>;

    /// The lattice has changed: places have other numbers.
    fn handle_change(&mut self) {}
}

/// The planner of a kind.
pub fn planner(kind: PlannerKind) -> Box<dyn Planner> {
    match kind {
        PlannerKind::Lawnmower => Box::new(Lawnmower::default()),
        PlannerKind::Greedy => Box::new(Greedy),
        PlannerKind::Horizon => Box::new(Horizon::default()),
    }
}
