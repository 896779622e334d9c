//! Subscriptions of what a vehicle sees and how it moves.

use crate::inbox::Inbox;
use crate::node::RosNode;
use crate::transport::Qos;
use scenecast_config::RosName;
use scenecast_core::UserError;
use scenecast_messages::grid_map_msgs::GridMap;
use scenecast_messages::nav_msgs::{OccupancyGrid, Odometry};
use scenecast_messages::sensor_msgs::{CameraInfo, CompressedImage, Image, PointCloud2};
use scenecast_messages::tf2_msgs::TFMessage;

/// Images that wait at most.
const IMAGES: usize = 5;
/// Poses and transforms that wait at most: 4 s at 50 a second.
const POSES: usize = 200;

impl RosNode {
    /// Images without compression: best effort, depth 5.
    pub fn subscribe_images(&self, topic: &RosName) -> Result<Inbox<Image>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Compressed images: best effort, depth 5.
    pub fn subscribe_compressed_images(&self, topic: &RosName) -> Result<Inbox<CompressedImage>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Clouds of points: best effort, depth 5.
    pub fn subscribe_clouds(&self, topic: &RosName) -> Result<Inbox<PointCloud2>, UserError> {
        self.subscribe(topic, Qos::Sensor(5), IMAGES)
    }

    /// Calibrations, if a camera has one: best effort, depth 5.
    pub fn subscribe_camera_info(&self, topic: &RosName) -> Result<Inbox<CameraInfo>, UserError> {
        self.subscribe_if_there(topic, Qos::Sensor(5), IMAGES)
    }

    /// Estimates of pose and speed: best effort.
    pub fn subscribe_odometry(&self, topic: &RosName) -> Result<Inbox<Odometry>, UserError> {
        self.subscribe(topic, Qos::Sensor(50), POSES)
    }

    /// Transforms that change, usually on `/tf`: best effort.
    pub fn subscribe_tf(&self, topic: &RosName) -> Result<Inbox<TFMessage>, UserError> {
        self.subscribe(topic, Qos::Sensor(100), POSES)
    }

    /// Transforms that stay, if there are any, usually on `/tf_static`; those before the subscription are included.
    pub fn subscribe_static_tf(&self, topic: &RosName) -> Result<Inbox<TFMessage>, UserError> {
        self.subscribe_if_there(topic, Qos::Latched(100), POSES)
    }

    /// Whole grids of labels: the last one, and each new one of a publisher that keeps its last message.
    pub fn subscribe_label_map(&self, topic: &RosName) -> Result<Inbox<OccupancyGrid>, UserError> {
        self.subscribe(topic, Qos::Latched(1), 1)
    }

    /// Grids with several layers: the last one, and each new one of a publisher that keeps its last message.
    pub fn subscribe_grid_map(&self, topic: &RosName) -> Result<Inbox<GridMap>, UserError> {
        self.subscribe(topic, Qos::Latched(1), 1)
    }
}
