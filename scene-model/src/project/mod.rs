//! From pixels to the world: the position of a visual word on the sea floor.

mod pinhole;
mod view;

use crate::words::Word;
pub use pinhole::{CameraPose, DepthImage, PinholeCamera, Projected};
pub use view::{Floor, View};

/// A visual word at a position in the world: metres in a local east-north-up frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// The word's number, below the vocabulary size.
    pub word: u32,
    /// Metres to the east of the origin.
    pub x: f64,
    /// Metres to the north of the origin.
    pub y: f64,
    /// Metres above the origin; negative below it.
    pub z: f64,
}

/// The position and the heading of a camera that looks down: metres in a local east-north-up frame, and radians.
///
/// At `yaw_rad` 0 the top of the image points north. Positive angles are counter-clockwise seen from above, so the
/// compass heading h in degrees is `-h.to_radians()`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// Metres to the east of the origin.
    pub x: f64,
    /// Metres to the north of the origin.
    pub y: f64,
    /// Height of the camera itself above the origin, metres.
    pub z: f64,
    /// Angle of the top of the image, radians counter-clockwise from north.
    pub yaw_rad: f64,
}

/// A camera that looks straight down on flat ground at a known altitude.
///
/// ```
/// use scene_model::project::{DownCamera, Pose};
/// use scene_model::words::Word;
///
/// let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
/// // 20 m deep, heading east: a compass heading of 90 degrees.
/// let pose = Pose { x: 10.0, y: -4.0, z: -20.0, yaw_rad: -f64::to_radians(90.0) };
/// // The middle of the upper edge of a frame of 640 x 480 pixels lies 2.4 m ahead.
/// let seen = camera.project(640, 480, &pose, &[Word { id: 5, u: 320.0, v: 0.0 }]);
/// assert!((seen[0].x - 12.4).abs() < 1e-9 && (seen[0].y + 4.0).abs() < 1e-9);
/// assert_eq!(seen[0].z, -23.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DownCamera {
    /// The edge of a pixel on the ground at the current altitude, metres.
    pub metres_per_pixel: f64,
    /// The height of the camera above the ground, metres.
    pub altitude_m: f64,
}

impl DownCamera {
    /// Returns the words of a frame of `width` x `height` pixels at their positions on the ground below `pose`.
    ///
    /// The centre of the frame lies below the camera; `v` grows towards the bottom of the image.
    #[must_use]
    pub fn project(&self, width: u32, height: u32, pose: &Pose, words: &[Word]) -> Vec<Observation> {
        let (sin, cos) = pose.yaw_rad.sin_cos();
        let (centre_u, centre_v) = (f64::from(width) / 2.0, f64::from(height) / 2.0);
        let z = pose.z - self.altitude_m;
        let place = |word: &Word| {
            let right = (f64::from(word.u) - centre_u) * self.metres_per_pixel;
            let ahead = (centre_v - f64::from(word.v)) * self.metres_per_pixel;
            Observation {
                word: word.id,
                x: pose.x + cos * right - sin * ahead,
                y: pose.y + sin * right + cos * ahead,
                z,
            }
        };
        words.iter().map(place).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn top_centre(yaw_rad: f64) -> Observation {
        let camera = DownCamera { metres_per_pixel: 0.01, altitude_m: 3.0 };
        let pose = Pose { x: 10.0, y: -4.0, z: -20.0, yaw_rad };
        camera.project(640, 480, &pose, &[Word { id: 5, u: 320.0, v: 0.0 }])[0]
    }

    #[test]
    fn image_top_points_north_at_zero_yaw() {
        let seen = top_centre(0.0);
        assert!((seen.x - 10.0).abs() < 1e-9 && (seen.y + 1.6).abs() < 1e-9);
        assert_eq!((seen.word, seen.z), (5, -23.0));
    }

    #[test]
    fn a_quarter_turn_points_image_top_west() {
        let seen = top_centre(std::f64::consts::FRAC_PI_2);
        assert!((seen.x - 7.6).abs() < 1e-9 && (seen.y + 4.0).abs() < 1e-9);
    }
}
