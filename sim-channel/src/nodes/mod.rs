//! The participants of a channel, their positions and their tracks.

mod track;

pub use track::Track;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn range_is_the_straight_line() {
        let a = NodePosition::new(0.0, 0.0, 2.0);
        let b = NodePosition::new(3.0, 4.0, 14.0);
        assert_eq!(a.range_m(&b), 13.0);
    }
}
