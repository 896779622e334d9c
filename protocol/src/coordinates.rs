//! Coordinates on the horizontal plane.

/// A place on the horizontal plane, decimetres from the origin, each coordinate within [`DecimetrePoint::REACH_DM`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct DecimetrePoint {
    /// East.
    pub x_dm: i32,
    /// North.
    pub y_dm: i32,
}

impl DecimetrePoint {
    /// Largest coordinate that fits the wire, either sign.
    pub const REACH_DM: i32 = 8_388_607;

    /// The nearest place to one in metres; `None` if that is not on the plane that the wire can say.
    pub fn from_metres(x_m: f64, y_m: f64) -> Option<Self> {
        let dm = |m: f64| {
            let dm = (m * 10.0).round();
            (dm.abs() <= f64::from(Self::REACH_DM)).then_some(dm as i32)
        };
        Some(Self { x_dm: dm(x_m)?, y_dm: dm(y_m)? })
    }

    /// East and north of the origin, metres.
    pub fn metres(self) -> (f64, f64) {
        (f64::from(self.x_dm) / 10.0, f64::from(self.y_dm) / 10.0)
    }

    pub(crate) fn is_in_reach(self) -> bool {
        self.x_dm.unsigned_abs().max(self.y_dm.unsigned_abs()) <= Self::REACH_DM.unsigned_abs()
    }
}
