//! The package `nav_msgs`.

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
