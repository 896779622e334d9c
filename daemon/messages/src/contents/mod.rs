//! Maps, poses and states of scenecast as messages of ROS 2.
//!
//! The conversions stand apart from DDS, so that recordings and viewers write the same messages without it.
//!
//! Frames of reference are those of ROS REP 105: the world frame is `map`, the map frame of a vehicle is `odom`. Axes point
//! east, north and up; headings become angles from east, anticlockwise.

mod map;
mod stamps;
mod vehicle_state;

pub use map::{Grid, GridLayer, MAX_GRID_CELLS, cloud, layers, occupancy};
pub use stamps::{Stamps, valid_part};
pub use vehicle_state::{Health, Place, camera_pose, diagnostics, exemplar_jpeg, fix, path, pose};

use crate::builtin_interfaces::Time;
use crate::std_msgs::Header;

/// The world frame in ROS 2.
pub const WORLD_FRAME: &str = "map";
/// The map frame of a vehicle in ROS 2.
pub const MAP_FRAME: &str = "odom";

/// A header with this time and this frame of reference.
pub fn header(stamp: Time, frame: &str) -> Header {
    Header { stamp, frame_id: frame.to_owned() }
}
