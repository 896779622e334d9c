//! The standard messages of ROS 2, and `grid_map_msgs` of ANYbotics, by package. `sensor_msgs` has a file of its own.

/// The package `builtin_interfaces`: times and spans of time.
pub mod builtin_interfaces {
    use crate::message::messages;

    const NANOS: i64 = 1_000_000_000;

    messages! {
        package "builtin_interfaces";

        /// A time of day, or a time since the start of a simulation.
        message Time {
            sec: i32,
            nanosec: u32,
        }

        /// A span of time.
        message Duration {
            sec: i32,
            nanosec: u32,
        }
    }

    impl Time {
        /// The time this many nanoseconds after 1970; the nearest that the type can hold.
        pub fn from_nanos(nanos: i64) -> Self {
            let sec = nanos.div_euclid(NANOS);
            match i32::try_from(sec) {
                Ok(sec) => Self { sec, nanosec: nanos.rem_euclid(NANOS) as u32 },
                Err(_) if sec < 0 => Self { sec: i32::MIN, nanosec: 0 },
                Err(_) => Self { sec: i32::MAX, nanosec: NANOS as u32 - 1 },
            }
        }

        /// The time in nanoseconds: since 1970, or since the start of a simulation.
        pub fn nanos(&self) -> i64 {
            // 2^31 s and 2^32 ns together are below 2^63 ns.
            i64::from(self.sec) * NANOS + i64::from(self.nanosec)
        }
    }
}

/// The package `std_msgs`: headers, texts, colours and arrays.
pub mod std_msgs {
    use crate::builtin_interfaces::Time;
    use crate::message::messages;

    messages! {
        package "std_msgs";

        /// The time and the frame of reference of data.
        message Header {
            stamp: Time,
            frame_id: String,
        }

        /// A text.
        message Text = "String" {
            data: String,
        }

        /// A colour; each part is from 0 to 1.
        message ColorRGBA {
            r: f32,
            g: f32,
            b: f32,
            a: f32,
        }

        /// One dimension of an array.
        message MultiArrayDimension {
            label: String,
            size: u32,
            stride: u32,
        }

        /// The dimensions of an array, the outermost first.
        message MultiArrayLayout {
            dim: Vec<MultiArrayDimension>,
            data_offset: u32,
        }

        /// An array with any number of dimensions.
        message Float32MultiArray {
            layout: MultiArrayLayout,
            data: Vec<f32>,
        }
    }
}

/// The package `geometry_msgs`: metres, radians, and frames of reference as in ROS REP 103.
pub mod geometry_msgs {
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
}

/// The package `nav_msgs`: occupancy grids, odometry and paths.
pub mod nav_msgs {
    use crate::builtin_interfaces::Time;
    use crate::geometry_msgs::{Pose, PoseStamped, PoseWithCovariance, TwistWithCovariance};
    use crate::message::messages;
    use crate::std_msgs::Header;

    messages! {
        package "nav_msgs";

        /// The cells of a grid.
        message MapMetaData {
            map_load_time: Time,
            /// Metres a cell.
            resolution: f32,
            /// Cells.
            width: u32,
            /// Cells.
            height: u32,
            /// The pose of the corner of cell (0, 0).
            origin: Pose,
        }

        /// A grid, row by row from cell (0, 0), the first coordinate first; -1 is unknown.
        message OccupancyGrid {
            header: Header,
            info: MapMetaData,
            data: Vec<i8>,
        }

        /// An estimate of pose and speed; the twist is in the child frame.
        message Odometry {
            header: Header,
            child_frame_id: String,
            pose: PoseWithCovariance,
            twist: TwistWithCovariance,
        }

        /// Poses along a path.
        message Path {
            header: Header,
            poses: Vec<PoseStamped>,
        }
    }
}

/// The package `grid_map_msgs` of ANYbotics, as its ROS 2 branches define it.
pub mod grid_map_msgs {
    use crate::geometry_msgs::Pose;
    use crate::message::messages;
    use crate::std_msgs::{Float32MultiArray, Header};

    messages! {
        package "grid_map_msgs";

        /// Size and place of a grid.
        message GridMapInfo {
            /// Metres a cell.
            resolution: f64,
            /// Metres.
            length_x: f64,
            /// Metres.
            length_y: f64,
            /// The pose of the middle of the grid.
            pose: Pose,
        }

        /// A grid with several layers.
        message GridMap {
            header: Header,
            info: GridMapInfo,
            layers: Vec<String>,
            /// The layers that must be valid for a cell to be valid.
            basic_layers: Vec<String>,
            /// One array a layer, column by column, from the cell with the largest coordinates; NaN is unknown.
            data: Vec<Float32MultiArray>,
            outer_start_index: u16,
            inner_start_index: u16,
        }
    }
}

/// The package `diagnostic_msgs`: the state of the parts of a robot.
pub mod diagnostic_msgs {
    use crate::Byte;
    use crate::message::messages;
    use crate::std_msgs::Header;

    messages! {
        package "diagnostic_msgs";

        /// A named value.
        message KeyValue {
            key: String,
            value: String,
        }

        /// The state of one part of a robot.
        message DiagnosticStatus {
            level: Byte,
            name: String,
            message: String,
            hardware_id: String,
            values: Vec<KeyValue>,
        }
        constants {
            byte OK: u8 = 0;
            byte WARN: u8 = 1;
            byte ERROR: u8 = 2;
            byte STALE: u8 = 3;
        }

        /// The states of all parts.
        message DiagnosticArray {
            header: Header,
            status: Vec<DiagnosticStatus>,
        }
    }
}

/// The package `rcl_interfaces`: lines of a log.
pub mod rcl_interfaces {
    use crate::builtin_interfaces::Time;
    use crate::message::messages;

    messages! {
        package "rcl_interfaces";

        /// One line of a log.
        message Log {
            stamp: Time,
            level: u8,
            name: String,
            msg: String,
            file: String,
            function: String,
            line: u32,
        }
        constants {
            uint8 DEBUG: u8 = 10;
            uint8 INFO: u8 = 20;
            uint8 WARN: u8 = 30;
            uint8 ERROR: u8 = 40;
            uint8 FATAL: u8 = 50;
        }
    }
}

/// The package `rosgraph_msgs`: the clock of a simulation or of a recording.
pub mod rosgraph_msgs {
    use crate::builtin_interfaces::Time;
    use crate::message::messages;

    messages! {
        package "rosgraph_msgs";

        /// The time of a simulation or of a playback.
        message Clock {
            clock: Time,
        }
    }
}

/// The package `tf2_msgs`: transforms between frames of reference.
pub mod tf2_msgs {
    use crate::geometry_msgs::TransformStamped;
    use crate::message::messages;

    messages! {
        package "tf2_msgs";

        /// Transforms between frames of reference.
        message TFMessage {
            transforms: Vec<TransformStamped>,
        }
    }
}
