//! A frame of a pinhole camera that need not look straight down, over a floor of known or assumed shape.

use super::pinhole::{CameraPose, DepthImage, PinholeCamera, Projected};
use super::{Observation, Pose};
use crate::words::Word;

/// The floor that a camera sees.
#[derive(Clone, Debug, PartialEq)]
pub enum Floor {
    /// The distance of each pixel is measured.
    Depth(DepthImage),
    /// A level plane that lies so many metres below the camera.
    Flat(f64),
}

/// The camera of a frame, how it is tilted, and the floor that it sees. A [`Pose`] tells where it is.
///
/// ```
/// use scene_model::project::{Floor, PinholeCamera, Pose, View};
/// use scene_model::words::Word;
///
/// let camera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0 };
/// // Straight down, 2 m above the floor.
/// let view = View { camera, tilt: View::DOWN, floor: Floor::Flat(2.0) };
/// // 20 m deep, heading east.
/// let pose = Pose { x: 10.0, y: -4.0, z: -20.0, yaw_rad: -f64::to_radians(90.0) };
/// let seen = view.project((100, 80), &pose, &[Word { id: 5, u: 50.0, v: 0.0 }]).observations[0];
/// assert!((seen.x - 10.8).abs() < 1e-9 && (seen.y + 4.0).abs() < 1e-9 && (seen.z + 22.0).abs() < 1e-9);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The intrinsics of the camera, in pixels.
    pub camera: PinholeCamera,
    /// The rotation x, y, z, w from the camera's axes to those of a frame whose top points north: to the right, ahead and
    /// up.
    pub tilt: [f64; 4],
    /// The floor that it sees: flat, or with measured distances.
    pub floor: Floor,
}

/// The least angle between a ray and a flat floor at which the ray is taken to meet it, as its sine: 10 degrees.
const MIN_SINE: f64 = 0.174;

impl View {
    /// The rotation of a camera that looks straight down.
    pub const DOWN: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

    /// Returns the position and rotation of the camera at a pose.
    #[must_use]
    pub fn camera_pose(&self, pose: &Pose) -> CameraPose {
        let (sin, cos) = (pose.yaw_rad / 2.0).sin_cos();
        let [x, y, z, w] = self.tilt;
        // The product of the turn about the axis upwards and the tilt.
        let rotation = [cos * x - sin * y, cos * y + sin * x, cos * z + sin * w, cos * w - sin * z];
        CameraPose { position: [pose.x, pose.y, pose.z], rotation }
    }

    /// Returns the words of a frame of `size` (width, height) pixels at their places on the floor. Words without depth, and
    /// those that look past a flat floor, are counted.
    #[must_use]
    pub fn project(&self, size: (u32, u32), pose: &Pose, words: &[Word]) -> Projected {
        let camera_pose = self.camera_pose(pose);
        let height_m = match &self.floor {
            Floor::Depth(depth) => return self.camera.project(size, depth, &camera_pose, words),
            Floor::Flat(height_m) => *height_m,
        };
        let mut projected = Projected::default();
        for word in words {
            match self.onto_flat(height_m, (word.u.into(), word.v.into())) {
                Some(metres) => {
                    let seen = self.camera.project_flat(metres, &camera_pose, std::slice::from_ref(word));
                    projected.observations.extend(seen);
                }
                None => projected.without_depth += 1,
            }
        }
        projected
    }

    /// Returns the place of a pixel on the floor; `None` without depth.
    #[must_use]
    pub fn place(&self, size: (u32, u32), pose: &Pose, (u, v): (f32, f32)) -> Option<Observation> {
        self.project(size, pose, &[Word { id: 0, u, v }]).observations.first().copied()
    }

    /// Returns the distance of the floor along the optical axis, metres: the median of a depth image, or that of the middle
    /// of the frame on a flat floor. `None` without any depth, or if the frame looks past the floor.
    #[must_use]
    pub fn distance_m(&self, size: (u32, u32)) -> Option<f64> {
        match &self.floor {
            Floor::Depth(depth) => depth.median_m(),
            Floor::Flat(height_m) => self.onto_flat(*height_m, middle_of(size)),
        }
    }

    /// Returns the edge of a pixel at a distance along the optical axis, metres.
    #[must_use]
    pub fn metres_per_pixel(&self, distance_m: f64) -> f64 {
        distance_m / (self.camera.fx * self.camera.fy).sqrt()
    }

    /// Returns the place that the middle of a frame shows at a distance along the optical axis: metres to the right of the
    /// camera and ahead of it.
    #[must_use]
    pub fn middle_m(&self, size: (u32, u32), distance_m: f64) -> [f64; 2] {
        let (u, v) = middle_of(size);
        let [x, y, _] =
            self.camera_pose(&Pose::default()).transform(self.camera.ray(u, v).map(|part| part * distance_m));
        [x, y]
    }

    /// Returns the angle between the optical axis and the vertical, radians.
    #[must_use]
    pub fn off_vertical_rad(&self) -> f64 {
        let ahead = self.camera_pose(&Pose::default()).transform([0.0, 0.0, 1.0]);
        ahead[0].hypot(ahead[1]).atan2(-ahead[2])
    }

    /// The distance along the optical axis at which the ray of a pixel meets a plane so far below the camera.
    fn onto_flat(&self, height_m: f64, (u, v): (f64, f64)) -> Option<f64> {
        let [x, y, z] = self.camera_pose(&Pose::default()).transform(self.camera.ray(u, v));
        let length = (x * x + y * y + z * z).sqrt();
        (-z > MIN_SINE * length).then(|| height_m / -z)
    }
}

fn middle_of((width, height): (u32, u32)) -> (f64, f64) {
    (f64::from(width) / 2.0, f64::from(height) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::DownCamera;

    const CAMERA: PinholeCamera = PinholeCamera { fx: 100.0, fy: 100.0, cx: 50.0, cy: 40.0 };
    const SIZE: (u32, u32) = (100, 80);

    /// A camera that is turned about the axis to the right, its optical axis ahead of the vertical.
    fn ahead(degrees: f64, floor: Floor) -> View {
        let half = degrees.to_radians() / 2.0;
        View { camera: CAMERA, tilt: [half.cos(), 0.0, 0.0, -half.sin()], floor }
    }

    fn word(u: f32, v: f32) -> Word {
        Word { id: 3, u, v }
    }

    #[test]
    fn a_level_view_places_words_like_a_camera_that_looks_down() {
        let pose = Pose { x: 10.0, y: -4.0, z: -20.0, yaw_rad: 0.7 };
        let down = DownCamera { metres_per_pixel: 0.03, altitude_m: 3.0 };
        let words = [word(13.0, 70.0), word(90.0, 2.0)];
        let view = ahead(0.0, Floor::Flat(3.0));
        for (a, b) in down.project(100, 80, &pose, &words).iter().zip(view.project(SIZE, &pose, &words).observations) {
            assert!((a.x - b.x).abs() < 1e-9 && (a.y - b.y).abs() < 1e-9 && (a.z - b.z).abs() < 1e-9, "{a:?} {b:?}");
        }
        assert_eq!((view.distance_m(SIZE), view.metres_per_pixel(3.0)), (Some(3.0), 0.03));
    }

    #[test]
    fn a_tilted_view_sees_the_floor_in_perspective() {
        let view = ahead(30.0, Floor::Flat(2.0));
        let pose = Pose { z: -5.0, ..Pose::default() };
        let up = |v: f32| view.place(SIZE, &pose, (50.0, v)).unwrap();
        assert!((up(40.0).y - 2.0 * 30f64.to_radians().tan()).abs() < 1e-9, "{:?}", up(40.0));
        let edge = 30f64.to_radians() + 0.4f64.atan();
        assert!((up(0.0).y - 2.0 * edge.tan()).abs() < 1e-9 && (up(0.0).z + 7.0).abs() < 1e-9);
        assert!((view.off_vertical_rad().to_degrees() - 30.0).abs() < 1e-9);
        let [right, before] = view.middle_m(SIZE, view.distance_m(SIZE).unwrap());
        assert!(right.abs() < 1e-9 && (before - up(40.0).y).abs() < 1e-9);
    }

    #[test]
    fn rays_past_a_flat_floor_are_counted() {
        let view = ahead(70.0, Floor::Flat(2.0));
        let projected = view.project(SIZE, &Pose::default(), &[word(50.0, 0.0), word(50.0, 79.0)]);
        assert_eq!((projected.observations.len(), projected.without_depth), (1, 1));
        assert_eq!(ahead(85.0, Floor::Flat(2.0)).distance_m(SIZE), None);
    }

    #[test]
    fn depth_places_words_at_their_heights() {
        let depth = DepthImage { width: 2, height: 1, metres: vec![2.0, 1.5] };
        let view = ahead(0.0, Floor::Depth(depth));
        let seen = view.project(SIZE, &Pose::default(), &[word(25.0, 40.0), word(75.0, 40.0)]).observations;
        assert_eq!((seen[0].x, seen[0].z, seen[1].x, seen[1].z), (-0.5, -2.0, 0.375, -1.5));
        assert_eq!(view.distance_m(SIZE), Some(2.0));
    }
}
