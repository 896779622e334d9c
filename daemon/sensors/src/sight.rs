//! How a calibrated camera sees the floor: its image without distortion, its tilt, and distances.

use crate::quaternion::{about, product};
use crate::{Calibration, CalibrationError};
use image::RgbImage;
use scene_model::project::{DepthImage, Floor, View};
use std::sync::Arc;

/// Least and greatest distance that counts as one, metres: nothing sees further under water, and a wrong distance must not put
/// words far off the map.
const MIN_DISTANCE_M: f32 = 0.02;
const MAX_DISTANCE_M: f32 = 50.0;

/// A calibrated camera at the time of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    pub calibration: Arc<Calibration>,
    /// The rotation x, y, z, w from the camera's axes to those of a frame whose top points north, as [`View`] has it.
    pub tilt: [f64; 4],
    /// Height of the camera above a flat floor, metres.
    pub height_m: f64,
}

impl Sight {
    /// The image without distortion, and what it sees. Distances from 0.02 to 50 m count. Without `depth`, or with one that has
    /// no reading, the floor is flat.
    ///
    /// # Errors
    /// The calibration is for images of another size.
    pub fn view(&self, image: RgbImage, depth: Option<DepthImage>) -> Result<(RgbImage, View), CalibrationError> {
        let image = self.calibration.rectify(image)?;
        let depth = depth.map(|mut depth| {
            let is_far = |metres: &f32| !(MIN_DISTANCE_M..=MAX_DISTANCE_M).contains(metres);
            depth.metres.iter_mut().filter(|metres| is_far(metres)).for_each(|metres| *metres = 0.0);
            depth
        });
        let depth = depth.filter(|depth| depth.median_m().is_some());
        let floor = depth.map_or(Floor::Flat(self.height_m), Floor::Depth);
        Ok((image, View { camera: self.calibration.camera(), tilt: on_grid(self.tilt), floor }))
    }
}

/// The tilt in steps of 2^-30, so that sources of the same attitude in other forms give the same map.
fn on_grid(tilt: [f64; 4]) -> [f64; 4] {
    const STEPS: f64 = (1 << 30) as f64;
    // A rotation is two quaternions; the greatest part in amount is taken to be positive.
    let greatest = tilt.iter().copied().fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
    tilt.map(|part| (part * greatest.signum() * STEPS).round() / STEPS)
}

/// The tilt of a camera with a heading, from its rotation x, y, z, w to east, north and up.
pub fn tilt_of(rotation: [f64; 4], heading_rad: f64) -> [f64; 4] {
    let length = rotation.iter().map(|part| part * part).sum::<f64>().sqrt();
    product(about(2, heading_rad), rotation.map(|part| part / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::{Pose, View};

    #[test]
    fn distances_that_no_camera_sees_do_not_count() {
        let calibration = Arc::new(Calibration::of_matrix([100.0, 100.0, 50.0, 40.0]).unwrap());
        let sight = Sight { calibration, tilt: View::DOWN, height_m: 4.0 };
        let floor = |metres: Vec<f32>| {
            let depth = DepthImage { width: metres.len() as u32, height: 1, metres };
            sight.view(RgbImage::new(100, 80), Some(depth)).unwrap().1.floor
        };
        let Floor::Depth(depth) = floor(vec![1e30, 3.0, 0.001, f32::NAN, -2.0, 50.0]) else { panic!() };
        assert_eq!(depth.metres, [0.0, 3.0, 0.0, 0.0, 0.0, 50.0]);
        assert_eq!(floor(vec![f32::INFINITY, 0.0]), Floor::Flat(4.0));
    }

    #[test]
    fn a_tilt_and_a_heading_are_the_rotation() {
        let rotation = [0.8, 0.2, -0.4, 0.4];
        let pose = Pose { yaw_rad: -1.1, ..Pose::default() };
        let camera = Calibration::of_matrix([100.0, 100.0, 50.0, 40.0]).unwrap().camera();
        let view = View { camera, tilt: tilt_of(rotation, 1.1), floor: Floor::Flat(1.0) };
        let again = view.camera_pose(&pose).rotation;
        assert!(again.iter().zip(rotation).all(|(a, b)| (a - b).abs() < 1e-12), "{again:?}");
    }
}
