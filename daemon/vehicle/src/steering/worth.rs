//! The worth of a planned path: whether a new plan is better than the present one, and whether one pays at all.

use crate::planning::{BlockValues, Interest, Node, PlanRequest, distance};

/// The gain a metre of a new plan, divided by that of the present one, from which the new one replaces it, if it turns back,
/// and in rounds of repeated looks, where a place keeps much of its value after a look. Without such margins two goals of
/// like worth take the vehicle to and fro, because each step changes the map. A margin for all new plans costs the horizon
/// planner a tenth of its gain.
const TURN_BACK: f64 = 1.3;
const IN_ROUNDS: f64 = 1.15;
/// The mean value of a cell, divided by the largest weight, from which a look at it pays: a fifth look at a favoured label
/// does, and a sixth one does not.
const PAYS: f64 = 0.02;

/// The least gain a metre of a plan that replaces the present one, in gains a metre of that. `before` is the place that the
/// vehicle comes from.
pub(super) fn margin(plan: &[Node], before: Option<Node>, is_in_rounds: bool) -> f64 {
    let turns_back = before.is_some() && plan.first().copied() == before;
    let margin = if turns_back { TURN_BACK } else { 1.0 };
    if is_in_rounds { IN_ROUNDS.max(margin) } else { margin }
}

/// Whether the present plan is kept although another one was made from the same place.
pub(super) fn keeps(q: &PlanRequest<'_>, present: &[Node], other: &[Node], margin: f64) -> bool {
    let rate = gain_a_metre(q, present);
    rate > 0.0 && gain_a_metre(q, other) < margin * rate
}

/// Whether a path shows a block of which the cells are worth another look.
pub(super) fn pays(q: &PlanRequest<'_>, path: &[Node], interest: Interest<'_>, cells_in_block: f64) -> bool {
    let values = path.iter().flat_map(|&node| q.values.shown(node)).map(|block| f64::from(q.values.of(block)));
    values.fold(0.0, f64::max) > PAYS * interest.largest_weight() * cells_in_block
}

/// What a path gains: the values of the blocks that it shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    pub whole: f64,
    /// The part of it on seen floor.
    pub on_seen: f64,
}

/// The values of all blocks that a path shows, each once.
pub(super) fn gain(values: &BlockValues, path: &[Node]) -> Gain {
    let mut blocks: Vec<usize> = path.iter().flat_map(|&node| values.shown(node)).collect();
    blocks.sort_unstable();
    blocks.dedup();
    let sum = |value: fn(&BlockValues, usize) -> f32| blocks.iter().map(|&block| f64::from(value(values, block))).sum();
    Gain { whole: sum(BlockValues::of), on_seen: sum(BlockValues::of_seen) }
}

/// The gain of a path for each of its metres.
fn gain_a_metre(q: &PlanRequest<'_>, path: &[Node]) -> f64 {
    let places = std::iter::once(&q.from).chain(path);
    let metres: f64 = places.zip(path).map(|(&a, &b)| distance(q.lattice.place(a), q.lattice.place(b))).sum();
    // A stop and a turn cost as much as one step of the lattice.
    gain(q.values, path).whole / (metres + q.lattice.step_m())
}
