//! A pinhole camera with depth: back-projects words into the world (Algorithm 1 of the paper).

use super::Observation;
use crate::words::Word;

/// The intrinsics of a pinhole camera, pixels. Its axes are x to the right, y down, z ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PinholeCamera {
    /// Focal length along x, pixels.
    pub fx: f64,
    /// Focal length along y, pixels.
    pub fy: f64,
    /// Column of the optical axis, pixels from the left edge.
    pub cx: f64,
    /// Row of the optical axis, pixels from the top edge.
    pub cy: f64,
}

/// The transform from the camera to the world: a quaternion and a position.
///
/// A camera that looks straight down, with the top of its image to the north, has the quaternion (1, 0, 0, 0) in the
/// order x, y, z, w: half a turn about the axis to the east.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// The position of the camera: metres to the east, to the north and up.
    pub position: [f64; 3],
    /// The rotation as x, y, z, w, the order of the TUM RGB-D files. It need not have unit length, but must not be 0.
    pub rotation: [f64; 4],
}

/// The distance of each pixel along the optical axis.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthImage {
    /// Columns, pixels; need not be those of the colour image.
    pub width: u32,
    /// Rows, pixels; need not be those of the colour image.
    pub height: u32,
    /// `width` x `height` distances in metres, row by row from the top; 0, negative or NaN without a reading.
    pub metres: Vec<f32>,
}

/// The words of a frame in the world, and the number of words without depth.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Projected {
    /// The words whose pixel has a depth, in their order in the frame.
    pub observations: Vec<Observation>,
    /// The number of words whose pixel has no depth; they are skipped.
    pub without_depth: u64,
}

impl PinholeCamera {
    /// Returns the words of a frame of `size` (width, height) pixels at the positions that the depth image gives.
    ///
    /// ```
    /// use scene_model::project::{CameraPose, DepthImage, PinholeCamera};
    /// use scene_model::words::Word;
    ///
    /// let camera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0 };
    /// let looking_down = CameraPose { position: [10.0, 20.0, -5.0], rotation: [1.0, 0.0, 0.0, 0.0] };
    /// let depth = DepthImage { width: 2, height: 1, metres: vec![2.0, 0.0] };
    /// let words = [Word { id: 3, u: 25.0, v: 40.0 }, Word { id: 4, u: 75.0, v: 40.0 }];
    ///
    /// let projected = camera.project((100, 80), &depth, &looking_down, &words);
    /// assert_eq!((projected.observations[0].x, projected.observations[0].z), (9.5, -7.0));
    /// assert_eq!(projected.without_depth, 1);
    /// ```
    #[must_use]
    pub fn project(&self, size: (u32, u32), depth: &DepthImage, pose: &CameraPose, words: &[Word]) -> Projected {
        let mut projected = Projected::default();
        for word in words {
            match depth.at(word.u / size.0 as f32, word.v / size.1 as f32) {
                Some(metres) => projected.observations.push(self.place(word, metres, pose)),
                None => projected.without_depth += 1,
            }
        }
        projected
    }

    /// Returns the words of a frame on a plane at a constant distance of `metres` along the optical axis.
    #[must_use]
    pub fn project_flat(&self, metres: f64, pose: &CameraPose, words: &[Word]) -> Vec<Observation> {
        words.iter().map(|word| self.place(word, metres, pose)).collect()
    }

    /// The direction of a pixel in the camera's axes, of length 1 along the optical axis.
    pub(super) fn ray(&self, u: f64, v: f64) -> [f64; 3] {
        [(u - self.cx) / self.fx, (v - self.cy) / self.fy, 1.0]
    }

    fn place(&self, word: &Word, metres: f64, pose: &CameraPose) -> Observation {
        let [x, y, z] = pose.transform(self.ray(word.u.into(), word.v.into()).map(|part| part * metres));
        Observation { word: word.id, x, y, z }
    }
}

impl CameraPose {
    /// Transforms a point from the camera's axes to the world, metres.
    pub(super) fn transform(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y, z, w] = self.rotation;
        let scale = 2.0 / (x * x + y * y + z * z + w * w);
        let rows = [
            [1.0 - scale * (y * y + z * z), scale * (x * y - z * w), scale * (x * z + y * w)],
            [scale * (x * y + z * w), 1.0 - scale * (x * x + z * z), scale * (y * z - x * w)],
            [scale * (x * z - y * w), scale * (y * z + x * w), 1.0 - scale * (x * x + y * y)],
        ];
        std::array::from_fn(|i| {
            self.position[i] + rows[i][0] * point[0] + rows[i][1] * point[1] + rows[i][2] * point[2]
        })
    }
}

impl DepthImage {
    /// Returns the median of every seventh reading, metres; `None` without readings.
    #[must_use]
    pub fn median_m(&self) -> Option<f64> {
        let readings = || self.metres.iter().copied().filter(|metres| metres.is_finite() && *metres > 0.0);
        let mut some: Vec<f32> = readings().step_by(7).collect();
        if some.is_empty() {
            return None;
        }
        let middle = some.len() / 2;
        Some(f64::from(*some.select_nth_unstable_by(middle, f32::total_cmp).1))
    }

    /// The reading at a position given as shares of width and height.
    fn at(&self, across: f32, down: f32) -> Option<f64> {
        if !(0.0..1.0).contains(&across) || !(0.0..1.0).contains(&down) {
            return None;
        }
        let column = (across * self.width as f32) as usize;
        let row = (down * self.height as f32) as usize;
        let metres = *self.metres.get(row * self.width as usize + column)?;
        (metres.is_finite() && metres > 0.0).then_some(f64::from(metres))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: PinholeCamera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0 };
    const DOWN: CameraPose = CameraPose { position: [10.0, 20.0, -5.0], rotation: [1.0, 0.0, 0.0, 0.0] };

    fn word(u: f32, v: f32) -> Word {
        Word { id: 3, u, v }
    }

    #[test]
    fn camera_looking_down_sees_the_ground_below() {
        let seen = CAMERA.project_flat(2.0, &DOWN, &[word(50.0, 40.0), word(100.0, 0.0)]);
        assert_eq!((seen[0].x, seen[0].y, seen[0].z), (10.0, 20.0, -7.0));
        assert_eq!((seen[1].x, seen[1].y, seen[1].z), (11.0, 20.8, -7.0));
    }

    #[test]
    fn words_without_depth_are_counted_and_skipped() {
        let metres = vec![0.0, f32::NAN, -1.0, 4.0];
        let depth = DepthImage { width: 2, height: 2, metres };
        let words = [word(10.0, 10.0), word(60.0, 10.0), word(10.0, 70.0), word(60.0, 70.0), word(-1.0, 5.0)];
        let projected = CAMERA.project((100, 80), &depth, &DOWN, &words);
        assert_eq!(projected.without_depth, 4);
        assert_eq!(projected.observations.len(), 1);
        assert!((projected.observations[0].z + 9.0).abs() < 1e-9);
    }

    #[test]
    fn both_cameras_agree_on_flat_ground() {
        let pose = super::super::Pose { x: 10.0, y: 20.0, z: -5.0, yaw_rad: 0.0 };
        let camera = super::super::DownCamera { metres_per_pixel: 0.02, altitude_m: 2.0 };
        let words = [word(13.0, 70.0)];
        let (a, b) = (camera.project(100, 80, &pose, &words)[0], CAMERA.project_flat(2.0, &DOWN, &words)[0]);
        assert!((a.x - b.x).abs() < 1e-9 && (a.y - b.y).abs() < 1e-9 && (a.z - b.z).abs() < 1e-9);
    }
}
