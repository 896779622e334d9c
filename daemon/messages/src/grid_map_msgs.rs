//! The package `grid_map_msgs` of ANYbotics, as its ROS 2 branches define it.

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
