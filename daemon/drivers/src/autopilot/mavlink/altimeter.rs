//! Height above the sea floor, from the best of the messages that have one.

use scenecast_protocol::time::Instant;
use std::time::Duration;

/// A height counts for this long.
const LASTS: Duration = Duration::from_secs(2);

/// The message that a height is from, the best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum HeightSource {
    DistanceSensor,
    Rangefinder,
    Altitude,
}

/// The last height of the best source that is not old.
#[derive(Debug, Default)]
pub(super) struct Altimeter {
    last: Option<(HeightSource, f64, Instant)>,
}

impl Altimeter {
    /// Takes a height; that of a better source stays until it is old.
    pub(super) fn handle(&mut self, source: HeightSource, height_m: Option<f64>, now: Instant) {
        let is_better = self.last.is_none_or(|(last, _, at)| source <= last || now.since(at) >= LASTS);
        if is_better {
            self.last = height_m.filter(|m| m.is_finite() && *m > 0.0).map(|m| (source, m, now));
        }
    }

    /// Metres above the sea floor, if they were measured not long ago.
    pub(super) fn height_m(&self, now: Instant) -> Option<f64> {
        self.last.filter(|(_, _, at)| now.since(*at) < LASTS).map(|(_, height_m, _)| height_m)
    }

    pub(super) fn forget(&mut self) {
        self.last = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_best_height_counts_until_it_is_old() {
        let at = |s: f64| Instant::from_secs_f64(s);
        let mut altimeter = Altimeter::default();
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(0.0));
        altimeter.handle(HeightSource::DistanceSensor, Some(4.0), at(0.1));
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(0.2));
        assert_eq!(altimeter.height_m(at(0.3)), Some(4.0));
        assert_eq!(altimeter.height_m(at(2.2)), None);
        altimeter.handle(HeightSource::Altitude, Some(9.0), at(2.2));
        assert_eq!(altimeter.height_m(at(2.3)), Some(9.0));
        altimeter.handle(HeightSource::Rangefinder, None, at(2.4));
        assert_eq!(altimeter.height_m(at(2.5)), None, "out of range");
    }
}
