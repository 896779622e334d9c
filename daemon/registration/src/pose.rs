//! The pose of a camera frame on the map.

use crate::similarity::Similarity;
use nalgebra::Vector2;
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
