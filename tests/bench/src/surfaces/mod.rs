//! Three surfaces with one key and one vehicle: hand-overs, crashes and orders in random schedules.

mod command;
mod orders;
mod waters;

#[cfg(test)]
mod tests;

pub(crate) use command::SurfacesBench;

use crate::link_ends::EndsSetup;
use scenecast_protocol::directive::{Constraints, Limits, Slot, Utility};
use scenecast_protocol::mac::Access;
use serde::Serialize;
use std::time::Duration;
use waters::{SURFACES, Waters};

pub const ACCESSES: [Access; 4] =
    [Access::Shared, Access::ModemOwned { pool_frames: 8 }, Access::FullDuplex, Access::Polled];
/// Steps of a schedule, with a pause after each.
const STEPS: u32 = 60;
/// How long each surface has the vehicle for itself at the end of a schedule.
const ALONE: Duration = Duration::from_secs(500);
/// After this long, a hold that is not applied counts as late.
const HOLD_LIMIT: Duration = Duration::from_secs(8);

/// What came of one schedule.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct ScheduleFigures {
    pub orders: usize,
    pub applied: usize,
    /// Orders that were applied after newer ones of their kind.
    pub regressions: Vec<String>,
    /// Orders that had no end when the schedule was over.
    pub open: Vec<String>,
}

/// Runs the schedule of a seed; then each surface has the vehicle for itself for a while.
pub fn run_schedule(seed: u64) -> ScheduleFigures {
    let mut waters = Waters::new(seed, setup(seed));
    for step in 1..=STEPS {
        act(&mut waters, step);
        let pause = [1, 5, 20, 60, 150][waters.rng.below(5)];
        waters.run(Duration::from_secs(pause));
    }
    waters.loss = 0.0;
    for surface in 0..SURFACES {
        waters.is_away = [true; SURFACES];
        waters.is_away[surface] = false;
        waters.run(ALONE);
    }
    let pending = |surface: usize| {
        let orders = waters.progress(surface).into_iter().filter(|order| order.status.is_pending());
        orders.map(move |order| format!("surface {}: {order:?}", surface + 1))
    };
    let [orders, applied] = waters.orders.counts;
    ScheduleFigures {
        orders,
        applied,
        regressions: waters
            .orders
            .regressions
            .iter()
            .map(|[newer, older]| format!("{older:?} after {newer:?}"))
            .collect(),
        open: (0..SURFACES).flat_map(pending).collect(),
    }
}

/// Seconds from the order of a second surface at 1 km, which another one keeps out, until the vehicle holds.
pub fn hold_of_second_s(seed: u64) -> Option<f64> {
    let mut waters = Waters::held_by_first(seed, setup(seed));
    waters.is_away = [false, false, true];
    waters.run(Duration::from_secs(60 + seed % 20));
    waters.hold(1);
    let given = waters.now;
    while waters.orders.applied.is_empty() {
        if waters.now.since(given) > HOLD_LIMIT {
            return None;
        }
        waters.run(Duration::from_millis(100));
    }
    Some(waters.now.since(given).as_secs_f64())
}

fn setup(seed: u64) -> EndsSetup {
    EndsSetup::new(ACCESSES[seed as usize % ACCESSES.len()]).keyed(true, true)
}

fn act(waters: &mut Waters, step: u32) {
    let surface = waters.rng.below(SURFACES);
    let constraints = |hold, abort| Slot::Constraints(Constraints { hold, abort });
    match waters.rng.below(16) {
        0..3 => waters.give(surface, limits(step)),
        3 => waters.give(surface, Slot::Utility(Utility { curiosity: step as i8, ..Utility::default() })),
        4 => waters.hold(surface),
        5 => waters.give(surface, constraints(false, false)),
        6 => waters.give(surface, constraints(false, true)),
        7..10 => waters.is_away[surface] ^= true,
        10 => waters.take_over(surface),
        11 => waters.restart_surface(surface),
        12 => waters.restart_vehicle(true),
        13 => {
            let keeps_memory = waters.rng.bernoulli(0.7);
            waters.restart_vehicle(keeps_memory);
        }
        14 => waters.loss = [0.0, 0.1, 0.3][waters.rng.below(3)],
        _ => waters.confirm(surface),
    }
}

fn limits(time_s: u32) -> Slot {
    Slot::Limits(Limits { time_s: Some(time_s), ..Limits::default() })
}
