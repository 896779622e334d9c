//! Rotations as quaternions, and the headings and tilts that vehicles use.

use crate::SensorPose;

/// A rotation from the axes of a body to east, north and up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation {
    rows: [[f64; 3]; 3],
}

impl Rotation {
    /// No rotation: the axes of the body point east, north and up.
    pub const IDENTITY: Self = Self { rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] };

    /// From a quaternion x, y, z, w; `None` unless its length is about 1.
    pub fn from_quaternion([x, y, z, w]: [f64; 4]) -> Option<Self> {
        let length = x * x + y * y + z * z + w * w;
        if !(0.9..1.1).contains(&length) {
            return None;
        }
        let s = 2.0 / length;
        Some(Self {
            rows: [
                [1.0 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
                [s * (x * y + z * w), 1.0 - s * (x * x + z * z), s * (y * z - x * w)],
                [s * (x * z - y * w), s * (y * z + x * w), 1.0 - s * (x * x + y * y)],
            ],
        })
    }

    /// A vector of the body in east, north, up.
    pub fn apply(&self, vector: [f64; 3]) -> [f64; 3] {
        self.rows.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// This rotation after the `first` one.
    #[must_use]
    pub fn after(&self, first: Self) -> Self {
        let columns = [0, 1, 2].map(|column| self.apply(first.rows.map(|row| row[column])));
        Self { rows: [0, 1, 2].map(|row| columns.map(|column| column[row])) }
    }

    /// The pose of a body at `place` (east, north, up), whose bow and starboard side, and its upper side,
    /// are these vectors of its own axes.
    fn pose_of(&self, place: [f64; 3], bow: [f64; 3], starboard: [f64; 3], upwards: [f64; 3]) -> SensorPose {
        let ([east, north, up], right) = (self.apply(bow), self.apply(starboard));
        let pitch_rad = up.clamp(-1.0, 1.0).asin();
        let upwards = self.apply(upwards)[2];
        SensorPose {
            x_m: place[0],
            y_m: place[1],
            depth_m: -place[2],
            heading_rad: east.atan2(north),
            roll_rad: (-right[2]).atan2(upwards),
            pitch_rad,
            altitude_m: None,
        }
    }

    /// The pose of a vehicle with the axes of ROS: x to the bow, y to port, z up (REP 103).
    pub fn vehicle_pose(&self, place: [f64; 3]) -> SensorPose {
        self.pose_of(place, [1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0])
    }

    /// The pose of a vehicle whose camera looks down, the top of its images to the bow. The axes of the camera are x to the right
    /// and y down in the image, z ahead.
    pub fn camera_pose(&self, place: [f64; 3]) -> SensorPose {
        self.pose_of(place, [0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0])
    }
}

/// A rotation about one of the axes, radians.
pub(crate) fn about(axis: usize, angle_rad: f64) -> [f64; 4] {
    let (sin, cos) = (angle_rad / 2.0).sin_cos();
    let mut quaternion = [0.0, 0.0, 0.0, cos];
    quaternion[axis] = sin;
    quaternion
}

/// The rotation `b`, and `a` after it.
pub(crate) fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// A vector after a rotation.
pub(crate) fn turned(quaternion: [f64; 4], [x, y, z]: [f64; 3]) -> [f64; 3] {
    let [qx, qy, qz, qw] = quaternion;
    let [x, y, z, _] = product(product(quaternion, [x, y, z, 0.0]), [-qx, -qy, -qz, qw]);
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// A rotation by an angle about one of the axes east, north, up.
    fn about(axis: usize, degrees: f64) -> [f64; 4] {
        let half = degrees.to_radians() / 2.0;
        let mut quaternion = [0.0, 0.0, 0.0, half.cos()];
        quaternion[axis] = half.sin();
        quaternion
    }

    fn degrees(pose: SensorPose) -> [i64; 3] {
        [pose.heading_rad, pose.roll_rad, pose.pitch_rad].map(|angle| angle.to_degrees().round() as i64)
    }

    #[test]
    fn headings_count_clockwise_from_north() {
        let pose = |axis, angle| Rotation::from_quaternion(about(axis, angle)).unwrap().vehicle_pose([1.0, 2.0, -3.0]);
        assert_eq!(degrees(pose(2, 0.0)), [90, 0, 0], "x to the east");
        assert_eq!(degrees(pose(2, 90.0)), [0, 0, 0], "a quarter turn to the north");
        assert_eq!(degrees(pose(0, 10.0)), [90, 10, 0], "starboard is down");
        assert_eq!(degrees(pose(1, -20.0)), [90, 0, 20], "the bow is up");
        assert_eq!((pose(2, 0.0).x_m, pose(2, 0.0).y_m, pose(2, 0.0).depth_m), (1.0, 2.0, 3.0));
    }

    #[test]
    fn a_camera_that_looks_down_has_the_heading_of_its_upper_edge() {
        let down = Rotation::from_quaternion(about(0, 180.0)).unwrap();
        assert_eq!(degrees(down.camera_pose([0.0; 3])), [0, 0, 0]);
        let east = Rotation::from_quaternion([0.5_f64.sqrt(), -(0.5_f64.sqrt()), 0.0, 0.0]).unwrap();
        assert_eq!(degrees(east.camera_pose([0.0; 3])), [90, 0, 0]);
        let up = Rotation::from_quaternion(about(2, 30.0)).unwrap().camera_pose([0.0; 3]);
        assert_eq!(
            up.roll_rad.to_degrees().abs().round(),
            180.0,
            "a camera that looks up is no camera that looks down"
        );
        let capsized = Rotation::from_quaternion(about(0, 180.0)).unwrap().vehicle_pose([0.0; 3]);
        assert_eq!(capsized.roll_rad.to_degrees().abs().round(), 180.0);
        assert_eq!(Rotation::from_quaternion([0.0; 4]), None);
        assert_eq!(Rotation::from_quaternion([f64::NAN; 4]), None);
    }

    #[test]
    fn rotations_follow_each_other() {
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(turned(super::about(2, FRAC_PI_2), [1.0, 0.0, 5.0]), [0.0, 1.0, 5.0]));
        let both = product(super::about(0, FRAC_PI_2), super::about(2, FRAC_PI_2));
        assert!(near(turned(both, [1.0, 0.0, 0.0]), [0.0, 0.0, 1.0]));
    }
}
