//! Coordinates in the frame of a vessel's body.

/// An offset in the frame of a vessel's body, metres.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BodyOffset {
    /// The part towards the bow.
    pub forward_m: f64,
    /// To the right of an observer who looks forward.
    pub starboard_m: f64,
    pub down_m: f64,
}

impl From<[f64; 3]> for BodyOffset {
    fn from([forward_m, starboard_m, down_m]: [f64; 3]) -> Self {
        Self { forward_m, starboard_m, down_m }
    }
}
