//! A node that moves: places at times, straight lines between.

use crate::nodes::Position;
use std::time::Duration;

/// Waypoints in order of time; before the first and after the last the node stands still.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Track {
    waypoints: Vec<(Duration, Position)>,
}

impl Track {
    /// A track through `waypoints`, which are put in order of time.
    pub fn new(mut waypoints: Vec<(Duration, Position)>) -> Self {
        waypoints.sort_by_key(|(at, _)| *at);
        Self { waypoints }
    }

    /// Where the node is at `now`; `None` if there is no waypoint.
    pub fn at(&self, now: Duration) -> Option<Position> {
        let after = self.waypoints.partition_point(|(at, _)| *at <= now);
        let next = self.waypoints.get(after);
        let last = after.checked_sub(1).and_then(|index| self.waypoints.get(index));
        match (last, next) {
            (Some((from, a)), Some((to, b))) => {
                let share = (now - *from).as_secs_f64() / (*to - *from).as_secs_f64();
                let between = |a: f64, b: f64| a + (b - a) * share;
                Some(Position::new(between(a.x_m, b.x_m), between(a.y_m, b.y_m), between(a.z_m, b.z_m)))
            }
            (Some((_, only)), None) | (None, Some((_, only))) => Some(*only),
            (None, None) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moves_straight_between_waypoints_and_stands_outside_them() {
        let at = |s: u64, x: f64| (Duration::from_secs(s), Position::new(x, 0.0, 5.0));
        let track = Track::new(vec![at(20, 100.0), at(10, 0.0)]);
        let x = |s| track.at(Duration::from_secs(s)).map(|p| p.x_m);
        assert_eq!([x(0), x(10), x(15), x(20), x(99)], [Some(0.0), Some(0.0), Some(50.0), Some(100.0), Some(100.0)]);
        assert_eq!(Track::default().at(Duration::ZERO), None);
    }
}
