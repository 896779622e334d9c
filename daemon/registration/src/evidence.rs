//! The measurements that placed a camera frame, and their counts.

use crate::pair::Match;
use nalgebra::{Matrix2, Vector2};
use serde::{Deserialize, Serialize};

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

/// The evidence that frames were placed by.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Tally {
    /// Frames in all, with and without a match.
    pub frames: u32,
    /// Frames that were matched with the frame before.
    pub chained: u32,
    /// Frames that were matched with at least one earlier frame.
    pub looped: u32,
    /// Matches with earlier frames, of which a frame can have several.
    pub loops: u32,
    /// Attempts at a match with earlier frames.
    pub attempts: u32,
    /// Matches that contradicted the pose, and were not used.
    pub contradicted: u32,
    /// Frames that were placed by dead reckoning and compass alone.
    pub unseen: u32,
}
