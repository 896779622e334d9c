//! The path of the last minutes, as the sensors measured it.

use scenecast_protocol::time::Instant;
use std::collections::VecDeque;

/// A measured displacement without correction, and the length of its path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Displacement {
    pub(super) dx_m: f64,
    pub(super) dy_m: f64,
    pub(super) length_m: f64,
}

/// Remembers the path of the last minutes, so that a late fix is compared with the position at its time.
#[derive(Debug, Default)]
pub(super) struct Odometer {
    /// Sums since the start, with their times.
    track: VecDeque<(Instant, Displacement)>,
}

impl Odometer {
    /// Maximum number of steps that are kept.
    const MAX: usize = 20_000;

    fn last(&self) -> Displacement {
        self.track.back().map_or_else(Displacement::default, |(_, path)| *path)
    }

    pub(super) fn handle_travel(&mut self, dx_m: f64, dy_m: f64, now: Instant, memory_s: f64) {
        let last = self.last();
        let path =
            Displacement { dx_m: last.dx_m + dx_m, dy_m: last.dy_m + dy_m, length_m: last.length_m + dx_m.hypot(dy_m) };
        self.track.push_back((now, path));
        let is_old = |at: Instant| now.since(at).as_secs_f64() > memory_s;
        // One older entry stays, so that times after it can be interpolated.
        while self.track.len() > Self::MAX || self.track.get(1).is_some_and(|(at, _)| is_old(*at)) {
            self.track.pop_front();
        }
    }

    /// The displacement from `taken` to now; `None` if `taken` is further back than `memory_s`.
    pub(super) fn since(&self, taken: Instant, now: Instant, memory_s: f64) -> Option<Displacement> {
        if now.since(taken).as_secs_f64() > memory_s {
            return None;
        }
        let after = self.track.partition_point(|(at, _)| *at <= taken);
        let before = after.checked_sub(1).and_then(|i| self.track.get(i));
        let then = match (before, self.track.get(after)) {
            (Some((a_at, a)), Some((b_at, b))) => {
                let whole = b_at.since(*a_at).as_secs_f64();
                let share = if whole > 0.0 { taken.since(*a_at).as_secs_f64() / whole } else { 0.0 };
                let between = |a: f64, b: f64| a + (b - a) * share;
                Displacement {
                    dx_m: between(a.dx_m, b.dx_m),
                    dy_m: between(a.dy_m, b.dy_m),
                    length_m: between(a.length_m, b.length_m),
                }
            }
            (Some((_, last)), None) => *last,
            // Before the first step the vehicle was at its start.
            (None, Some(_)) if self.track.len() < Self::MAX => Displacement::default(),
            (None, Some(_)) => return None,
            (None, None) => Displacement::default(),
        };
        let last = self.last();
        Some(Displacement {
            dx_m: last.dx_m - then.dx_m,
            dy_m: last.dy_m - then.dy_m,
            length_m: last.length_m - then.length_m,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_path_since_a_time_is_interpolated_and_forgotten() {
        let at = Instant::from_secs_f64;
        let mut odometer = Odometer::default();
        for s in 1..=300 {
            odometer.handle_travel(1.0, 0.5, at(f64::from(s)), 120.0);
        }
        let path = odometer.since(at(250.5), at(300.0), 120.0).unwrap();
        assert!((path.dx_m - 49.5).abs() < 1e-9 && (path.dy_m - 24.75).abs() < 1e-9);
        assert_eq!(odometer.since(at(179.0), at(300.0), 120.0), None);
        assert!(odometer.since(at(180.5), at(300.0), 120.0).is_some());
        assert!(odometer.track.len() <= 123, "{}", odometer.track.len());
        assert_eq!(odometer.since(at(310.0), at(310.0), 120.0), Some(Displacement::default()));
    }
}
