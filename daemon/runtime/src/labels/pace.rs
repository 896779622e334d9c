//! How often the vehicle gets the map of another program.

use std::time::{Duration, Instant};

/// Shortest time between two updates, and between two slices of a large one.
const MIN_INTERVAL: Duration = Duration::from_millis(200);
const BETWEEN_SLICES: Duration = Duration::from_millis(10);
/// The vehicle handles updates for at most one part of so many of its time, so that a large map does not delay its modem.
const PART: u32 = 6;

/// When the next update is due: never before the vehicle has handled the last one, and later the longer that took.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pace {
    From(Instant),
    /// The vehicle handles an update; whether more of the same waits.
    Handling {
        has_more: bool,
    },
}

impl Pace {
    pub(super) fn new(now: Instant) -> Self {
        Self::From(now)
    }

    pub(super) fn is_due(self, now: Instant) -> bool {
        matches!(self, Self::From(at) if now >= at)
    }

    /// An update is given to the vehicle; `has_more` if further changes wait.
    pub(super) fn handle_given(&mut self, has_more: bool) {
        *self = Self::Handling { has_more };
    }

    /// The vehicle has handled the update since `began`.
    pub(super) fn handle_taken(&mut self, began: Instant, now: Instant) {
        let took = now.saturating_duration_since(began);
        let shortest = if *self == (Self::Handling { has_more: true }) { BETWEEN_SLICES } else { MIN_INTERVAL };
        *self = Self::From(now + shortest.max(took * (PART - 1)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_that_takes_long_is_updated_less_often() {
        let start = Instant::now();
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut pace = Pace::new(start);
        assert!(pace.is_due(start));
        pace.handle_given(false);
        assert!(!pace.is_due(at(60_000)), "the vehicle has not handled it");
        pace.handle_taken(at(1_000), at(1_001));
        assert!(!pace.is_due(at(1_200)) && pace.is_due(at(1_201)));
        pace.handle_given(true);
        pace.handle_taken(at(2_000), at(2_000));
        assert!(!pace.is_due(at(2_009)) && pace.is_due(at(2_010)), "slices follow each other soon");
        pace.handle_given(true);
        pace.handle_taken(at(2_000), at(5_000));
        assert!(!pace.is_due(at(19_999)) && pace.is_due(at(20_000)));
    }
}
