//! The camera of a survey vehicle: straight down on flat ground.

use super::Observation;
use crate::words::Word;

/// Where the camera is: local ENU metres (x east, y north, z up) and heading.
///
/// `yaw_rad` 0 points the top of the image north; positive turns counter-clockwise seen from above (the mathematical
/// sense), so a compass heading h degrees is `-h.to_radians()`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// East, metres.
    pub x: f64,
    /// North, metres.
    pub y: f64,
    /// Up, metres, of the camera itself.
    pub z: f64,
    /// Radians, counter-clockwise from north.
    pub yaw_rad: f64,
}

/// A camera that looks straight down on flat ground at a known altitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DownCamera {
    /// Ground size of one pixel, metres, at the present altitude.
    pub metres_per_pixel: f64,
    /// Height of the camera above the ground, metres.
    pub altitude_m: f64,
}

impl DownCamera {
    /// Puts the words of a frame of `width` x `height` pixels onto the ground below `pose`.
    ///
    /// The centre of the frame lies below the camera; `v` grows towards the bottom of the image.
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
