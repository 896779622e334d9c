//! How a calibrated camera on its vehicle sees the floor.

use crate::rotation::{about, product, turned};
use crate::{Calibration, CalibrationError, SensorPose};
use image::RgbImage;
use scene_model::project::{DepthImage, Floor, View};
use std::sync::Arc;

/// Least and greatest distance that counts as one, metres: nothing sees further under water, and a wrong distance must not put
/// words far off the map.
const MIN_DISTANCE_M: f32 = 0.02;
const MAX_DISTANCE_M: f32 = 50.0;

/// A calibrated camera at the time of a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewGeometry {
    pub calibration: Arc<Calibration>,
    /// The rotation x, y, z, w from the camera's axes to those of a frame whose top points north, as [`View`] has it.
    pub tilt: [f64; 4],
    /// Height of the camera above a flat floor, metres.
    pub height_m: f64,
}

impl ViewGeometry {
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

/// Place and direction of a camera that looks down, on a vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CameraMounting {
    /// Metres towards the bow, to starboard and down from the point whose pose is measured.
    pub place_m: [f64; 3],
    /// Rotation of the image's upper edge from the bow, clockwise from above, radians.
    pub turn_rad: f64,
    /// Rotation of the optical axis from straight down: towards the bow, and to starboard, radians.
    pub tilt_rad: [f64; 2],
}

/// The largest tilt of a frame that is mapped, radians: beyond it a frame sees too much of the distance.
const MAX_TILT_RAD: f64 = 0.6;

impl CameraMounting {
    /// The pose of a camera straight above the middle of its frame that sees the same floor, from the pose of the vehicle:
    /// the camera's offset and the tilt of its optical axis move the middle of the frame. Without a measured altitude the
    /// floor is `altitude_m` below the camera. `None` if the optical axis is tilted by more than 0.6 radians.
    ///
    /// The perspective within a tilted frame remains: at a tilt of 10 degrees, the outer parts of a frame 0.6 altitudes long
    /// are off by about 3 % of the altitude.
    #[must_use]
    pub fn camera_pose(&self, vehicle: &SensorPose, altitude_m: f64) -> Option<SensorPose> {
        let [forward, starboard, down] = self.place_m;
        let height = vehicle.altitude_m.map_or(altitude_m, |altitude| (altitude - down).max(0.0));
        // Bow up and starboard up turn the optical axis towards the bow and to starboard.
        let (ahead, aside) = (self.tilt_rad[0] + vehicle.pitch_rad, self.tilt_rad[1] - vehicle.roll_rad);
        if ahead.hypot(aside) > MAX_TILT_RAD {
            return None;
        }
        let (along, across) = (forward + height * ahead.tan(), starboard + height * aside.tan());
        let (sin, cos) = vehicle.heading_rad.sin_cos();
        Some(SensorPose {
            x_m: vehicle.x_m + along * sin + across * cos,
            y_m: vehicle.y_m + along * cos - across * sin,
            depth_m: vehicle.depth_m + down,
            heading_rad: vehicle.heading_rad + self.turn_rad,
            altitude_m: vehicle.altitude_m.map(|_| height),
            ..*vehicle
        })
    }
}

/// The pose of a calibrated camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MountedCamera {
    /// The place of the camera itself, and the direction of the image's upper edge.
    pub pose: SensorPose,
    /// The rotation x, y, z, w from the camera's axes to those of a frame whose top points north.
    pub tilt: [f64; 4],
    /// Height above a flat floor, metres.
    pub height_m: f64,
}

impl CameraMounting {
    /// The pose of the camera itself, with the whole attitude of the vehicle. Without a measured altitude the floor is
    /// `altitude_m` below the camera. `None` if the optical axis is tilted by more than 0.6 radians.
    #[must_use]
    pub fn mounted_camera(&self, vehicle: &SensorPose, altitude_m: f64) -> Option<MountedCamera> {
        let [east, north, up] = [0, 1, 2];
        let attitude = product(about(east, vehicle.pitch_rad), about(north, vehicle.roll_rad));
        let body = product(about(up, -vehicle.heading_rad), attitude);
        let tilts = product(about(east, self.tilt_rad[0]), about(north, -self.tilt_rad[1]));
        // A camera that looks down is turned over about the axis to the right.
        let mounted = product(product(tilts, about(up, -self.turn_rad)), [1.0, 0.0, 0.0, 0.0]);
        let heading_rad = vehicle.heading_rad + self.turn_rad;
        let tilt = product(about(up, heading_rad), product(body, mounted));
        let axis = turned(tilt, [0.0, 0.0, 1.0]);
        if axis[0].hypot(axis[1]).atan2(-axis[2]) > MAX_TILT_RAD {
            return None;
        }
        let [forward, starboard, down] = self.place_m;
        let [east, north, up] = turned(body, [starboard, forward, -down]);
        let height_m = vehicle.altitude_m.map_or(altitude_m, |altitude| (altitude + up).max(MIN_HEIGHT_M));
        let pose = SensorPose {
            x_m: vehicle.x_m + east,
            y_m: vehicle.y_m + north,
            depth_m: vehicle.depth_m - up,
            heading_rad,
            altitude_m: vehicle.altitude_m.map(|_| height_m),
            ..*vehicle
        };
        Some(MountedCamera { pose, tilt, height_m })
    }
}

/// The least height above the floor, metres: a camera that is on it sees nothing.
const MIN_HEIGHT_M: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::{Pose, View};

    #[test]
    fn distances_that_no_camera_sees_do_not_count() {
        let calibration = Arc::new(Calibration::of_matrix([100.0, 100.0, 50.0, 40.0]).unwrap());
        let geometry = ViewGeometry { calibration, tilt: View::DOWN, height_m: 4.0 };
        let floor = |metres: Vec<f32>| {
            let depth = DepthImage { width: metres.len() as u32, height: 1, metres };
            geometry.view(RgbImage::new(100, 80), Some(depth)).unwrap().1.floor
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

    fn vehicle(heading_deg: f64) -> SensorPose {
        let heading_rad = heading_deg.to_radians();
        SensorPose { x_m: 100.0, y_m: 50.0, depth_m: 10.0, heading_rad, altitude_m: Some(4.5), ..SensorPose::default() }
    }

    fn place(pose: Option<SensorPose>) -> (f64, f64) {
        let pose = pose.unwrap();
        ((pose.x_m * 1e6).round() / 1e6, (pose.y_m * 1e6).round() / 1e6)
    }

    #[test]
    fn an_offset_turns_with_the_vehicle() {
        let mounting = CameraMounting { place_m: [1.0, 0.2, 0.5], ..CameraMounting::default() };
        let north = mounting.camera_pose(&vehicle(0.0), 4.0);
        let (depth_m, altitude_m) = north.map(|pose| (pose.depth_m, pose.altitude_m)).unwrap();
        assert_eq!((place(north), depth_m, altitude_m), ((100.2, 51.0), 10.5, Some(4.0)));
        assert_eq!(place(mounting.camera_pose(&vehicle(90.0), 4.0)), (101.0, 49.8));
    }

    #[test]
    fn a_tilt_moves_the_middle_of_the_frame() {
        let straight = CameraMounting::default();
        let bow_up = SensorPose { pitch_rad: 0.1, altitude_m: None, ..vehicle(0.0) };
        assert_eq!(place(straight.camera_pose(&bow_up, 4.0)), (100.0, 50.401339));
        let starboard_down = SensorPose { roll_rad: 0.1, altitude_m: Some(4.0), ..vehicle(0.0) };
        assert_eq!(place(straight.camera_pose(&starboard_down, 9.0)), (99.598661, 50.0));
        let level = CameraMounting { tilt_rad: [-0.1, 0.0], ..CameraMounting::default() };
        assert_eq!(place(level.camera_pose(&bow_up, 4.0)), (100.0, 50.0), "the mounting compensates the trim");
        let on_its_side = SensorPose { roll_rad: 0.7, ..vehicle(0.0) };
        assert_eq!(straight.camera_pose(&on_its_side, 4.0), None);
    }

    /// The place on a flat floor that the middle of the image shows.
    fn middle(camera: &MountedCamera) -> (f64, f64) {
        let turn = product(about(2, -camera.pose.heading_rad), camera.tilt);
        let [east, north, up] = turned(turn, [0.0, 0.0, 1.0]);
        let share = camera.height_m / -up;
        (camera.pose.x_m + share * east, camera.pose.y_m + share * north)
    }

    #[test]
    fn a_calibrated_camera_looks_at_the_middle_of_its_flat_frame() {
        let mounting = CameraMounting { place_m: [0.0; 3], turn_rad: 0.4, tilt_rad: [0.1, 0.0] };
        for (roll_rad, pitch_rad, heading) in [(0.0, 0.0, 20.0), (0.2, 0.0, 120.0), (0.0, -0.15, 250.0)] {
            let vehicle = SensorPose { roll_rad, pitch_rad, ..vehicle(heading) };
            let flat = mounting.camera_pose(&vehicle, 4.0).unwrap();
            let camera = mounting.mounted_camera(&vehicle, 4.0).unwrap();
            let (x, y) = middle(&camera);
            // A tilt in both directions is not the sum of the two.
            assert!((x - flat.x_m).abs() < 0.01 && (y - flat.y_m).abs() < 0.01, "{x} {y} {flat:?}");
            assert_eq!((camera.pose.heading_rad, camera.height_m), (flat.heading_rad, 4.5));
        }
        let on_its_side = SensorPose { roll_rad: 0.7, ..vehicle(0.0) };
        assert_eq!(mounting.mounted_camera(&on_its_side, 4.0), None);
    }

    #[test]
    fn the_top_of_the_image_points_along_the_heading() {
        let mounting = CameraMounting { turn_rad: 0.5, ..CameraMounting::default() };
        let camera = mounting.mounted_camera(&vehicle(90.0), 4.0).unwrap();
        assert!(turned(camera.tilt, [0.0, -1.0, 0.0]).iter().zip([0.0, 1.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn an_offset_turns_with_the_whole_attitude() {
        let mounting = CameraMounting { place_m: [1.0, 0.0, 0.5], ..CameraMounting::default() };
        let bow_up = SensorPose { pitch_rad: 0.3, ..vehicle(0.0) };
        let MountedCamera { pose, height_m, .. } = mounting.mounted_camera(&bow_up, 4.0).unwrap();
        let (sin, cos) = 0.3f64.sin_cos();
        assert!((pose.y_m - (50.0 + cos + 0.5 * sin)).abs() < 1e-9, "{pose:?}");
        assert!((pose.depth_m - (10.0 - sin + 0.5 * cos)).abs() < 1e-9);
        assert!((height_m - (4.5 + sin - 0.5 * cos)).abs() < 1e-9);
    }
}
