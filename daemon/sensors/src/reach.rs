//! Places that no vehicle can reach from those before.

use crate::Stamp;

/// Faster than this is no vehicle, metres a second.
const FASTEST_M_S: f64 = 20.0;

/// A step at once that is no jump, metres.
const STEP_M: f64 = 5.0;

/// Places elsewhere that follow each other for so many seconds are right.
const PERSISTS_S: f64 = 1.0;

/// So many places elsewhere that follow each other are right where times are in whole seconds, or all the same.
const PERSISTS: usize = 10;

/// How exact the times of places are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Times {
    /// As a sensor gives them.
    Exact,
    /// As people write them, perhaps in whole seconds.
    Coarse,
}

/// A time, and metres east and north.
type Place = (Stamp, [f64; 2]);

impl Times {
    /// Whether a vehicle can come from a place to a later one.
    fn lead((before, from): Place, (later, to): Place, inexact_s: f64) -> bool {
        let moved_m = (to[0] - from[0]).hypot(to[1] - from[1]);
        moved_m <= STEP_M + FASTEST_M_S * (later.seconds_since(before) + inexact_s)
    }

    fn inexact_s(self) -> f64 {
        match self {
            Self::Exact => 0.0,
            Self::Coarse => 1.0,
        }
    }

    /// Whether so many places for so many seconds are right.
    fn persist(self, count: usize, lasted_s: f64) -> bool {
        lasted_s >= PERSISTS_S || (self == Self::Coarse && count >= PERSISTS)
    }
}

/// Separates what no vehicle can reach from what comes before, unless it stays, from the rest: returns the rest, and what is left out.
/// All is in order of time, and `place` gives the place of each.
pub fn reachable<T>(
    all: impl IntoIterator<Item = T>,
    times: Times,
    place: impl Fn(&T) -> (Stamp, [f64; 2]),
) -> (Vec<T>, Vec<T>) {
    let leads_to = |from: &T, to: &T| Times::lead(place(from), place(to), times.inexact_s());
    let (mut kept, mut left_out): (Vec<T>, Vec<T>) = Default::default();
    // What follows each other, and what is kept does not lead to.
    let mut elsewhere: Vec<T> = Vec::new();
    for next in all {
        if kept.last().is_none_or(|last| leads_to(last, &next)) {
            left_out.append(&mut elsewhere);
            kept.push(next);
            continue;
        }
        if elsewhere.last().is_some_and(|last| !leads_to(last, &next)) {
            left_out.append(&mut elsewhere);
        }
        elsewhere.push(next);
        let lasted_s = |(first, last): (&T, &T)| place(last).0.seconds_since(place(first).0);
        let lasted_s = elsewhere.first().zip(elsewhere.last()).map_or(0.0, lasted_s);
        if times.persist(elsewhere.len(), lasted_s) {
            // A single place before was wrong itself.
            if kept.len() == 1 {
                left_out.splice(..0, kept.drain(..));
            }
            kept.append(&mut elsewhere);
        }
    }
    left_out.append(&mut elsewhere);
    (kept, left_out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The places east that are kept and left out, of rows with a time in seconds.
    fn split(rows: &[(f64, f64)], times: Times) -> (Vec<f64>, Vec<f64>) {
        let place = |(t_s, x_m): &(f64, f64)| (Stamp::from_nanos((t_s * 1e9) as i64), [*x_m, 0.0]);
        let (kept, left_out) = reachable(rows.iter().copied(), times, place);
        let east = |rows: Vec<(f64, f64)>| rows.into_iter().map(|(_, x_m)| x_m).collect();
        (east(kept), east(left_out))
    }

    #[test]
    fn places_in_one_second_may_be_apart_if_times_are_coarse() {
        let rows = [(0.0, 0.0), (0.0, 9.0), (0.0, 400.0), (1.0, 18.0)];
        assert_eq!(split(&rows, Times::Coarse), (vec![0.0, 9.0, 18.0], vec![400.0]));
        assert_eq!(split(&rows, Times::Exact), (vec![0.0, 18.0], vec![9.0, 400.0]));
    }

    #[test]
    fn places_that_go_on_count_although_time_stands_still() {
        let rows: Vec<(f64, f64)> = (0..100).map(|i| (0.0, 9.0 * f64::from(i % 50))).collect();
        assert_eq!(split(&rows, Times::Coarse).1, [0.0; 0]);
    }

    #[test]
    fn a_first_place_that_was_wrong_is_the_first_left_out() {
        let rows = [(0.0, 400.0), (1.0, 900.0), (2.0, 1.0), (3.0, 2.0), (4.0, 3.0)];
        assert_eq!(split(&rows, Times::Coarse), (vec![1.0, 2.0, 3.0], vec![400.0, 900.0]));
    }
}
