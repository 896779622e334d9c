//! The pose of a camera frame on the map, the measurements that placed it, their counts, and the state of a registration as
//! bytes.
//!
//! ```text
//!  0        8         10
//!  | magic  | version | state in postcard |
//! ```

use crate::consensus::Similarity;
use crate::pair::Match;
use crate::registrar::Registrar;
use nalgebra::{Matrix2, Vector2};
use scenecast_protocol::coordinates::MapPoint;
use serde::{Deserialize, Serialize};

/// The place, direction and scale of a camera frame in the map frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FramePose {
    x_m: f64,
    y_m: f64,
    /// Direction of the frame's top, clockwise from north, radians.
    pub heading_rad: f64,
    /// The natural logarithm of the size of a pixel on the sea floor, divided by the size by the altitude.
    pub log_scale: f64,
}

impl FramePose {
    pub fn new(at: MapPoint, heading_rad: f64, log_scale: f64) -> Self {
        Self { x_m: at.x_m, y_m: at.y_m, heading_rad, log_scale }
    }

    /// The place below the camera.
    pub fn at(&self) -> MapPoint {
        MapPoint::new(self.x_m, self.y_m)
    }

    pub(crate) fn place(&self) -> Vector2<f64> {
        Vector2::new(self.x_m, self.y_m)
    }

    /// The size of a pixel on the sea floor, divided by the size by the altitude.
    pub fn scale(&self) -> f64 {
        self.log_scale.exp()
    }

    /// From metres to the right and ahead in the frame, by the altitude, to metres east and north on the map.
    pub(crate) fn to_map(self) -> Similarity {
        Similarity::new(-self.heading_rad, self.scale(), self.place())
    }

    pub(crate) fn is_sound(&self) -> bool {
        let finite = [self.x_m, self.y_m, self.heading_rad, self.log_scale].into_iter().all(f64::is_finite);
        finite && self.log_scale.abs() < 2.0 && self.x_m.abs() < 1e7 && self.y_m.abs() < 1e7
    }
}

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

const MAGIC: [u8; 8] = *b"SCNREGIS";
const VERSION: u16 = 2;

/// The reason why bytes are no registration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum RestoreError {
    #[error("no registration")]
    Foreign,
    #[error("a registration of version {0}, this program reads version {VERSION}")]
    Version(u16),
    #[error("its content is inconsistent")]
    Inconsistent,
}

impl Registrar {
    /// The state for [`Registrar::restore`], at most about 21 MB.
    pub fn save(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(postcard::to_allocvec(self).unwrap_or_default());
        bytes
    }

    /// Restores a state. Its poses continue exactly as those of the saved registrar would.
    ///
    /// # Errors
    /// The bytes are no state, of another version, or contradict themselves.
    pub fn restore(bytes: &[u8]) -> Result<Self, RestoreError> {
        let content = bytes.strip_prefix(&MAGIC).ok_or(RestoreError::Foreign)?;
        let (version, content) = content.split_first_chunk::<2>().ok_or(RestoreError::Inconsistent)?;
        if u16::from_le_bytes(*version) != VERSION {
            return Err(RestoreError::Version(u16::from_le_bytes(*version)));
        }
        let restored: Self = postcard::from_bytes(content).map_err(|_| RestoreError::Inconsistent)?;
        if restored.is_sound() { Ok(restored) } else { Err(RestoreError::Inconsistent) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_of_a_frame_points_along_the_heading() {
        let pose = FramePose::new(MapPoint::new(10.0, 20.0), 90f64.to_radians(), 0.0);
        let ahead = pose.to_map().apply(Vector2::new(0.0, 1.0));
        assert!((ahead - Vector2::new(11.0, 20.0)).norm() < 1e-12);
        let right = pose.to_map().apply(Vector2::new(1.0, 0.0));
        assert!((right - Vector2::new(10.0, 19.0)).norm() < 1e-12);
    }
}
