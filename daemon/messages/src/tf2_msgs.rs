//! The package `tf2_msgs`.

use crate::geometry_msgs::TransformStamped;
use crate::message::messages;

messages! {
    package "tf2_msgs";

    /// Transforms between frames of reference.
    message TFMessage {
        transforms: Vec<TransformStamped>,
    }
}
