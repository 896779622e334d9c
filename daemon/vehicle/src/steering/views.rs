//! The track of the camera, and the rounds of looks along it.

use crate::planning::{Point, distance};

/// The shortest round that is flown again, in steps of the lattice. A shorter one would be a turn on the spot.
const LEAST_ROUND: f64 = 12.0;

/// The views of a survey.
#[derive(Debug, Default)]
pub(super) struct Views {
    last: Option<Point>,
    track_m: f64,
    /// The length of the track where the present round began; `None` before the first repeated round.
    round_from_m: Option<f64>,
}

impl Views {
    /// Takes a view around `at`, and returns the length of the track so far, metres.
    pub(super) fn handle_view(&mut self, at: Point) -> f64 {
        self.track_m += self.last.replace(at).map_or(0.0, |before| distance(before, at));
        self.track_m
    }

    /// Begins another round of looks, unless the present one was too short to be flown again.
    pub(super) fn begin_round(&mut self, step_m: f64) -> bool {
        let is_long = self.round_from_m.is_none_or(|from| self.track_m - from >= LEAST_ROUND * step_m);
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
