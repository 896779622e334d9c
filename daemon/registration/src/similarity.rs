//! Similarities of the plane (turn, scale and shift), and the pose of a camera frame on the map.

use nalgebra::Vector2;
use scenecast_protocol::coordinates::MapPoint;
use serde::{Deserialize, Serialize};

/// Maps a point by a turn and a scale about the origin, and then by a shift.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Similarity {
    /// Cosine and sine of the turn, each times the scale.
    turned: Vector2<f64>,
    shift: Vector2<f64>,
}

impl Similarity {
    /// A turn against the clock in radians, a scale and a shift.
    pub(crate) fn new(turn_rad: f64, scale: f64, shift: Vector2<f64>) -> Self {
        let (sin, cos) = turn_rad.sin_cos();
        Self { turned: Vector2::new(scale * cos, scale * sin), shift }
    }

    pub(crate) fn turn_rad(&self) -> f64 {
        self.turned.y.atan2(self.turned.x)
    }

    pub(crate) fn scale(&self) -> f64 {
        self.turned.norm()
    }

    pub(crate) fn shift(&self) -> Vector2<f64> {
        self.shift
    }

    /// Cosine and sine of the turn, each times the scale.
    pub(crate) fn turned(&self) -> Vector2<f64> {
        self.turned
    }

    pub(crate) fn apply(&self, at: Vector2<f64>) -> Vector2<f64> {
        turn_by(self.turned, at) + self.shift
    }

    pub(crate) fn inverse(&self) -> Self {
        let square = self.turned.norm_squared();
        let turned = Vector2::new(self.turned.x, -self.turned.y) / square;
        Self { turned, shift: -turn_by(turned, self.shift) }
    }

    /// The similarity that applies `first`, then this one.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self { turned: turn_by(self.turned, first.turned), shift: self.apply(first.shift) }
    }

    /// The shift that maps `from` to `to`, with the turn and scale as they are.
    pub(crate) fn through(&self, from: Vector2<f64>, to: Vector2<f64>) -> Self {
        Self { turned: self.turned, shift: to - turn_by(self.turned, from) }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.turned.iter().chain(&self.shift).all(|value| value.is_finite())
    }
}

/// The product of two complex numbers.
fn turn_by(turned: Vector2<f64>, at: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(turned.x * at.x - turned.y * at.y, turned.y * at.x + turned.x * at.y)
}

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
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_similarity_and_its_inverse_cancel(
            turn in -3.0..3.0f64, scale in 0.5..2.0f64, x in -9.0..9.0f64, y in -9.0..9.0f64,
        ) {
            let forth = Similarity::new(turn, scale, Vector2::new(x, y));
            let at = Vector2::new(y, 2.0 - x);
            prop_assert!((forth.inverse().apply(forth.apply(at)) - at).norm() < 1e-9);
            prop_assert!((forth.after(&forth.inverse()).apply(at) - at).norm() < 1e-9);
            prop_assert!((forth.turn_rad() - turn).abs() < 1e-9 && (forth.scale() - scale).abs() < 1e-9);
            prop_assert!((forth.through(at, Vector2::zeros()).apply(at)).norm() < 1e-9);
        }
    }

    #[test]
    fn the_top_of_a_frame_points_along_the_heading() {
        let pose = FramePose::new(MapPoint::new(10.0, 20.0), 90f64.to_radians(), 0.0);
        let ahead = pose.to_map().apply(Vector2::new(0.0, 1.0));
        assert!((ahead - Vector2::new(11.0, 20.0)).norm() < 1e-12);
        let right = pose.to_map().apply(Vector2::new(1.0, 0.0));
        assert!((right - Vector2::new(10.0, 19.0)).norm() < 1e-12);
    }
}
