//! The package `geometry_msgs`: metres, radians, and frames of reference as in ROS REP 103.

use crate::message::messages;
use crate::std_msgs::Header;

messages! {
    package "geometry_msgs";

    /// A place.
    message Point {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A place in single precision.
    message Point32 {
        x: f32,
        y: f32,
        z: f32,
    }

    /// An outline.
    message Polygon {
        points: Vec<Point32>,
    }

    /// A direction with a length.
    message Vector3 {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A rotation.
    message Quaternion {
        x: f64,
        y: f64,
        z: f64,
        w: f64,
    }

    /// A place and a rotation.
    message Pose {
        position: Point,
        orientation: Quaternion,
    }

    /// A pose with its time and its frame of reference.
    message PoseStamped {
        header: Header,
        pose: Pose,
    }

    /// A pose with the covariance of x, y, z and of the rotations about them, row by row.
    message PoseWithCovariance {
        pose: Pose,
        covariance: [f64; 36],
    }

    /// A pose with its covariance, its time and its frame of reference.
    message PoseWithCovarianceStamped {
        header: Header,
        pose: PoseWithCovariance,
    }

    /// A shift and a rotation between two frames of reference.
    message Transform {
        translation: Vector3,
        rotation: Quaternion,
    }

    /// The pose of a child frame in the frame of the header.
    message TransformStamped {
        header: Header,
        child_frame_id: String,
        transform: Transform,
    }

    /// Speed in m/s and rate of turn in rad/s.
    message Twist {
        linear: Vector3,
        angular: Vector3,
    }

    /// A twist with its covariance, row by row.
    message TwistWithCovariance {
        twist: Twist,
        covariance: [f64; 36],
    }
}

impl Quaternion {
    /// The rotation by `yaw` radians about the upward axis, anticlockwise.
    pub fn from_yaw(yaw: f64) -> Self {
        let (z, w) = (yaw / 2.0).sin_cos();
        Self { x: 0.0, y: 0.0, z, w }
    }
}
