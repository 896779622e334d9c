//! Frames of reference on the horizontal plane.
//!
//! The *map frame* is the vehicle's own dead reckoning: it never jumps, so no cell moves once it is mapped. The *world
//! frame* is the tangent plane at the mission's origin. In both, the first axis points east and the second north. Only
//! a [`Placement`](crate::wire::Placement) converts one into the other, so a point of the wrong frame does not compile.
//!
//! ```
//! use scenecast_protocol::coordinates::{MapPoint, WorldPoint};
//! use scenecast_protocol::wire::Placement;
//!
//! let moved = Placement { version: 1, origin: WorldPoint::new(12.5, -3.0) };
//! assert_eq!(moved.to_world(MapPoint::new(1.0, 2.0)), WorldPoint::new(13.5, -1.0));
//! assert_eq!(moved.to_map(WorldPoint::new(13.5, -1.0)), MapPoint::new(1.0, 2.0));
//! ```

/// A point of the map frame, in metres from the origin of the vehicle's dead reckoning.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MapPoint {
    /// Metres along the first axis, which points east.
    pub x_m: f64,
    /// Metres along the second axis, which points north.
    pub y_m: f64,
}

impl MapPoint {
    /// The point `x_m` metres east and `y_m` metres north of the frame's origin.
    pub const fn new(x_m: f64, y_m: f64) -> Self {
        Self { x_m, y_m }
    }

    /// Both coordinates in metres, for geometry within the frame.
    pub const fn xy(self) -> (f64, f64) {
        (self.x_m, self.y_m)
    }

    /// Distance to another point of the frame in metres.
    pub fn distance_m(self, to: Self) -> f64 {
        (to.x_m - self.x_m).hypot(to.y_m - self.y_m)
    }
}

/// A point of the world frame, in metres from the mission's origin.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WorldPoint {
    /// Metres east of the mission's origin.
    pub east_m: f64,
    /// Metres north of the mission's origin.
    pub north_m: f64,
}

impl WorldPoint {
    /// The point `east_m` metres east and `north_m` metres north of the mission's origin.
    pub const fn new(east_m: f64, north_m: f64) -> Self {
        Self { east_m, north_m }
    }

    /// Both coordinates in metres, for geometry within the frame.
    pub const fn xy(self) -> (f64, f64) {
        (self.east_m, self.north_m)
    }

    /// Distance to another point of the frame in metres.
    pub fn distance_m(self, to: Self) -> f64 {
        (to.east_m - self.east_m).hypot(to.north_m - self.north_m)
    }
}

/// A point of the world frame in whole decimetres, so that geometry with it is exact; a vertex of a fence.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecimetrePoint {
    /// Decimetres east of the mission's origin, within [`Self::MAX_DM`] of it.
    pub east_dm: i32,
    /// Decimetres north of the mission's origin, within [`Self::MAX_DM`] of it.
    pub north_dm: i32,
}

impl DecimetrePoint {
    /// The largest coordinate on the wire, of either sign.
    pub const MAX_DM: i32 = 8_388_607;

    /// The point `east_dm` decimetres east and `north_dm` decimetres north of the mission's origin.
    pub const fn new(east_dm: i32, north_dm: i32) -> Self {
        Self { east_dm, north_dm }
    }

    /// The nearest point; `None` if it is beyond the range of the wire.
    pub fn nearest(point: WorldPoint) -> Option<Self> {
        let dm = |m: f64| {
            let dm = (m * 10.0).round();
            (dm.abs() <= f64::from(Self::MAX_DM)).then_some(dm as i32)
        };
        Some(Self { east_dm: dm(point.east_m)?, north_dm: dm(point.north_m)? })
    }

    /// The same point in metres.
    pub fn to_world(self) -> WorldPoint {
        WorldPoint { east_m: f64::from(self.east_dm) / 10.0, north_m: f64::from(self.north_dm) / 10.0 }
    }

    pub(crate) fn is_in_range(self) -> bool {
        self.east_dm.unsigned_abs().max(self.north_dm.unsigned_abs()) <= Self::MAX_DM.unsigned_abs()
    }
}
