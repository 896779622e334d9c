//! The measurements that a frame was placed by.

use crate::pair::Match;
use nalgebra::{Matrix2, Vector2};

/// The measurements that a frame was placed by, for [`FrameGraph`](crate::FrameGraph).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evidence {
    /// From the frame before; `None` for the first frame, and after a gap in dead reckoning.
    pub(crate) step: Option<Step>,
    /// The match with the frame before.
    pub(crate) chain: Option<Match>,
    /// The matches with earlier frames that agreed with the pose.
    pub(crate) loops: Vec<Loop>,
    /// Variance of the heights of the floor, in squares of the altitude.
    pub(crate) relief: f64,
}

/// The displacement from the frame before, by odometry and images.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Step {
    /// In the axes of the map, metres.
    pub(crate) by: Vector2<f64>,
    /// The heading of the frame before, as it was placed.
    pub(crate) from_heading_rad: f64,
    pub(crate) covariance_m2: Matrix2<f64>,
}

/// A match with an earlier frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Loop {
    /// The number of the earlier frame.
    pub(crate) older: u32,
    pub(crate) found: Match,
}
