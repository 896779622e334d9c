//! The track of the camera, and the rounds of looks along it.

use crate::planning::{Point, distance};

/// The shortest round that is flown again, in steps of the lattice. A shorter one would be a turn on the spot.
const MIN_ROUND: f64 = 12.0;

/// A track of this length within a circle is a turn on the spot, in steps of the lattice.
const SPOT_TRACK: f64 = 4.0;
/// The radius of the circle, in steps of the lattice: all eight neighbours of a place lie in it.
const SPOT_RADIUS: f64 = 1.5;

/// The views of a survey.
#[derive(Debug, Default)]
pub(super) struct Views {
    last: Option<Point>,
    track_m: f64,
    /// The middle of the circle that the vehicle has not left, and the length of the track when it came there.
    spot: Option<(Point, f64)>,
    /// The length of the track where the present round began; `None` before the first repeated round.
    round_from_m: Option<f64>,
}

impl Views {
    /// Takes a view around `at`, and returns the length of the track so far, metres.
    pub(super) fn handle_view(&mut self, at: Point) -> f64 {
        self.track_m += self.last.replace(at).map_or(0.0, |before| distance(before, at));
        self.track_m
    }

    /// The place of the last view, a point of the map frame.
    pub(super) fn last(&self) -> Option<Point> {
        self.last
    }

    /// Whether the vehicle has turned on the spot; then it begins to count again.
    pub(super) fn take_turn_on_the_spot(&mut self, step_m: f64) -> bool {
        let Some(at) = self.last else { return false };
        let has_left = self.spot.is_none_or(|(middle, _)| distance(middle, at) > SPOT_RADIUS * step_m);
        let turned = !has_left && self.spot.is_some_and(|(_, from)| self.track_m - from >= SPOT_TRACK * step_m);
        if has_left || turned {
            self.spot = Some((at, self.track_m));
        }
        turned
    }

    /// Begins another round of looks, unless the present one was too short to be flown again.
    pub(super) fn begin_round(&mut self, step_m: f64) -> bool {
        let is_long = self.round_from_m.is_none_or(|from| self.track_m - from >= MIN_ROUND * step_m);
        if is_long {
            self.round_from_m = Some(self.track_m);
        }
        is_long
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn back_and_forth_is_a_turn_on_the_spot_and_a_long_leg_is_not() {
        let turns = |to_m: f64| {
            let mut views = Views::default();
            let place = |i: u32| (to_m / 2.0 * (1.0 - (f64::from(i) * 0.5 / to_m * std::f64::consts::PI).cos()), 0.0);
            (0..200).any(|i| {
                views.handle_view(place(i));
                views.take_turn_on_the_spot(2.0)
            })
        };
        assert!(turns(2.0) && !turns(6.0));
    }

    #[test]
    fn a_round_that_is_a_turn_on_the_spot_is_not_begun_again() {
        let mut views = Views::default();
        assert!(views.begin_round(2.0), "the survey so far counts as a round");
        assert!(!views.begin_round(2.0));
        (0..=30).for_each(|i| {
            views.handle_view((f64::from(i), 0.0));
        });
        assert!(views.begin_round(2.0));
    }
}
