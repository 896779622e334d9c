//! An adaptive survey goes on to new places: it does not turn on the spot while its plan leads far away.

use super::{Course, Footprint, Steering};
use crate::planning::{Point, distance};
use scenecast_core::Area;
use scenecast_protocol::directive::{AtEnd, PlannerKind, Utility};
use scenecast_protocol::map::{Cell, LabelGrid};

const CELLS: (i32, i32) = (104, 72);
const CELL_M: f64 = 0.25;
const FOOTPRINT: Footprint = Footprint { across: 6.4, along: 4.8, leg_overlap: 0.0 };

/// The labels that the vehicle sees around a place.
fn look(truth: &[u8], at: Point, map: &mut LabelGrid) {
    let reach = FOOTPRINT.along / 2.0;
    let cells = |middle: f64, count: i32| {
        let edge = |metres: f64| (metres / CELL_M - 0.5).clamp(0.0, f64::from(count - 1));
        edge(middle - reach).ceil() as i32..=edge(middle + reach).floor() as i32
    };
    for y in cells(at.1, CELLS.1) {
        for x in cells(at.0, CELLS.0) {
            map.set(Cell::new(x, y), 1 + truth[(y * CELLS.0 + x) as usize]);
        }
    }
}

/// The part of a survey that follows the utility.
struct Survey {
    track: Vec<Point>,
    /// The share of the area that was seen.
    seen: f64,
    /// The survey ended by itself.
    is_over: bool,
}

/// Surveys five legs by the lawnmower, then by a utility that favours the rarest label, until the survey ends by itself
/// or has 200 legs.
fn survey(kind: PlannerKind, at_end: AtEnd, exploration: i8, seed: u64) -> Survey {
    const LAWNMOWER_LEGS: u64 = 5;
    const MAX_LEGS: u64 = 200;
    let truth = scenecast_worlds::patches(seed, CELLS.0 as u32, CELLS.1 as u32, 8, 8).truth;
    let area = Area { west: 0.0, south: 0.0, east: f64::from(CELLS.0) * CELL_M, north: f64::from(CELLS.1) * CELL_M };
    let mut steering = Steering::new(area, FOOTPRINT, CELL_M, kind, 1.0).with_end(at_end);
    let (mut at, mut map, mut track) = (steering.start(), LabelGrid::default(), Vec::new());
    let mut is_over = false;
    for leg in 0..MAX_LEGS {
        let mut counts = [0u32; 256];
        map.iter().for_each(|(_, label)| counts[usize::from(label)] += 1);
        let rarest = (1..=8u8).filter(|&l| counts[usize::from(l)] > 0).min_by_key(|&l| counts[usize::from(l)]);
        let utility = (leg >= LAWNMOWER_LEGS).then(|| Utility {
            exploration,
            weights: [(rarest.unwrap_or(1), 80)].into(),
            ..Utility::default()
        });
        let Course::Go(to) = steering.next(at, (&map, leg), utility.as_ref(), f64::INFINITY) else {
            is_over = true;
            break;
        };
        let steps = (distance(at, to) / 1.0).ceil().max(1.0);
        for i in 1..=steps as usize {
            let share = i as f64 / steps;
            let seen = (at.0 + (to.0 - at.0) * share, at.1 + (to.1 - at.1) * share);
            look(&truth, seen, &mut map);
            steering.handle_view(seen);
        }
        at = to;
        if leg >= LAWNMOWER_LEGS {
            track.push(at);
        }
    }
    let cells = f64::from(CELLS.0 * CELLS.1);
    Survey { track, seen: map.iter().count() as f64 / cells, is_over }
}

/// The most places in a row within 2.5 m of the first of them, a little more than a step of the lattice.
fn longest_stay(track: &[Point]) -> usize {
    let stay = |from: usize| track[from..].iter().take_while(|p| distance(**p, track[from]) < 2.5).count();
    (0..track.len()).map(stay).max().unwrap_or(0)
}

#[test]
fn an_adaptive_survey_never_turns_on_the_spot() {
    for kind in [PlannerKind::Greedy, PlannerKind::Horizon] {
        // All seeds in `.ci/full`.
        let seeds = if std::env::var_os("SCENECAST_FULL").is_some() { 8 } else { 3 };
        for seed in 1..=seeds {
            for at_end in AtEnd::ALL {
                let Survey { track, is_over, .. } = survey(kind, at_end, 0, seed);
                // At 0.5 m/s less than a minute.
                assert!(longest_stay(&track) <= 12, "{kind:?}, {at_end:?}, seed {seed}: {track:?}");
                if at_end != AtEnd::Repeat {
                    assert!(is_over, "{kind:?}, {at_end:?}, seed {seed}: {track:?}");
                }
            }
        }
    }
}

#[test]
fn a_survey_explores_before_it_ends_unless_an_order_forbids_it() {
    for seed in 1..=4 {
        let seen = |at_end, exploration| survey(PlannerKind::Horizon, at_end, exploration, seed).seen;
        let explored = seen(AtEnd::Explore, 0);
        let (forbidden, held) = (seen(AtEnd::Explore, -10), seen(AtEnd::Hold, 0));
        assert!(explored > 0.9, "seed {seed}: {explored}");
        assert!(forbidden <= explored && held <= explored, "seed {seed}: {forbidden}, {held}");
    }
}

#[test]
fn a_survey_that_repeats_explores_before_it_looks_again() {
    let mut repeats = 0;
    for seed in 1..=4 {
        let once = survey(PlannerKind::Horizon, AtEnd::Explore, 0, seed);
        let repeated = survey(PlannerKind::Horizon, AtEnd::Repeat, 0, seed);
        let common = once.track.iter().zip(&repeated.track).take_while(|(a, b)| a == b).count();
        assert_eq!(common, once.track.len(), "seed {seed}: both are the same until the first survey ends");
        let (before, later) = repeated.track.split_at(common);
        let is_old = |p: &Point| before.iter().any(|q| distance(*p, *q) < 0.1);
        repeats += usize::from(later.iter().any(is_old));
        assert!(repeated.seen >= once.seen, "seed {seed}");
    }
    assert!(repeats >= 3, "{repeats} of 4 surveys look again; a label of a few cells pays no look");
}
