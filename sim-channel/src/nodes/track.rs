//! The track of a moving node.

use crate::nodes::NodePosition;
use std::time::Duration;

/// Waypoints with times. The node moves on straight lines between them, and stands still before the first and after the
/// last.
///
/// ```
/// use sim_channel::{Duration, NodePosition, Track};
///
/// let track = Track::new(vec![
///     (Duration::ZERO, NodePosition::new(0.0, 0.0, 10.0)),
///     (Duration::from_secs(100), NodePosition::new(150.0, 0.0, 30.0)),
/// ]);
/// assert_eq!(track.at(Duration::from_secs(50)), Some(NodePosition::new(75.0, 0.0, 20.0)));
/// assert_eq!(track.at(Duration::from_secs(999)), Some(NodePosition::new(150.0, 0.0, 30.0)));
/// ```
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Track {
    waypoints: Vec<(Duration, NodePosition)>,
}

impl Track {
    /// A track through `waypoints`, which may come in any order.
    #[must_use]
    pub fn new(mut waypoints: Vec<(Duration, NodePosition)>) -> Self {
        waypoints.sort_by_key(|(at, _)| *at);
        Self { waypoints }
    }

    /// Position of the node at `now`; `None` if the track has no waypoint.
    #[must_use]
    pub fn at(&self, now: Duration) -> Option<NodePosition> {
        let after = self.waypoints.partition_point(|(at, _)| *at <= now);
        let next = self.waypoints.get(after);
        let last = after.checked_sub(1).and_then(|index| self.waypoints.get(index));
        match (last, next) {
            (Some((from, a)), Some((to, b))) => {
                let share = (now - *from).as_secs_f64() / (*to - *from).as_secs_f64();
                let between = |a: f64, b: f64| a + (b - a) * share;
                Some(NodePosition::new(between(a.x_m, b.x_m), between(a.y_m, b.y_m), between(a.z_m, b.z_m)))
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
    fn position_is_interpolated_and_clamped_at_the_ends() {
        let at = |s: u64, x: f64| (Duration::from_secs(s), NodePosition::new(x, 0.0, 5.0));
        let track = Track::new(vec![at(20, 100.0), at(10, 0.0)]);
        let x = |s| track.at(Duration::from_secs(s)).map(|p| p.x_m);
        assert_eq!([x(0), x(10), x(15), x(20), x(99)], [Some(0.0), Some(0.0), Some(50.0), Some(100.0), Some(100.0)]);
        assert_eq!(Track::default().at(Duration::ZERO), None);
    }
}
