//! The participants of a channel, their positions, and the tracks of those that move.

use std::time::Duration;

/// A participant of the channel. Where a modem is emulated, the number usually is its address (1..=254) as well.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub struct NodeId(pub u8);

/// A position in metres: x east, y north, z down from the surface.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct NodePosition {
    /// Metres east of the origin.
    pub x_m: f64,
    /// Metres north of the origin.
    pub y_m: f64,
    /// Depth in metres below the surface.
    pub z_m: f64,
}

impl NodePosition {
    /// The position `x_m` east and `y_m` north of the origin, `z_m` below the surface.
    #[must_use]
    pub const fn new(x_m: f64, y_m: f64, z_m: f64) -> Self {
        Self { x_m, y_m, z_m }
    }

    /// Slant range along a straight ray, m.
    #[must_use]
    pub fn range_m(&self, other: &NodePosition) -> f64 {
        let (dx, dy, dz) = (self.x_m - other.x_m, self.y_m - other.y_m, self.z_m - other.z_m);
        (dx * dx + dy * dy + dz * dz).sqrt()
    }
}

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
    fn range_is_the_straight_line() {
        let a = NodePosition::new(0.0, 0.0, 2.0);
        let b = NodePosition::new(3.0, 4.0, 14.0);
        assert_eq!(a.range_m(&b), 13.0);
    }

    #[test]
    fn position_is_interpolated_and_clamped_at_the_ends() {
        let at = |s: u64, x: f64| (Duration::from_secs(s), NodePosition::new(x, 0.0, 5.0));
        let track = Track::new(vec![at(20, 100.0), at(10, 0.0)]);
        let x = |s| track.at(Duration::from_secs(s)).map(|p| p.x_m);
        assert_eq!([x(0), x(10), x(15), x(20), x(99)], [Some(0.0), Some(0.0), Some(50.0), Some(100.0), Some(100.0)]);
        assert_eq!(Track::default().at(Duration::ZERO), None);
    }
}
