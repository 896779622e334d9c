//! Odometry of ROS 2.

use crate::live::{Reading, SensorKind, SensorSource, SourceError};
use crate::ros_node::{Counted, SensorNode, parsed};
use scenecast_messages::nav_msgs::Odometry;
use scenecast_ros2::Inbox;
use scenecast_sensors::{CameraFault, pose_of};
use std::sync::Arc;
use std::time::Duration;

/// A pose that was displaced in its inbox.
const LOST_POSE: (CameraFault, &str) = (CameraFault::UnusablePose, "a pose was dropped: the vehicle was busy");

/// A topic of `nav_msgs/msg/Odometry` in a frame of east, north, up.
pub struct RosNavigation {
    node: Arc<SensorNode>,
    topic: String,
    inbox: Option<Inbox<Odometry>>,
    counted: Counted,
}

impl RosNavigation {
    pub fn new(node: Arc<SensorNode>, topic: &str) -> Self {
        Self { node, topic: topic.to_owned(), inbox: None, counted: Counted::default() }
    }
}

impl SensorSource for RosNavigation {
    fn kind(&self) -> SensorKind {
        SensorKind::Navigation
    }

    fn open(&mut self) -> Result<(), SourceError> {
        let inbox = self.node.get()?.subscribe_odometry(&parsed(&self.topic)?);
        self.inbox = Some(inbox.map_err(|error| SourceError(error.to_string()))?);
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        let Some(inbox) = &self.inbox else { return Err(SourceError("the topic is not open".to_owned())) };
        inbox.wait(timeout);
        self.counted.report(inbox, LOST_POSE, CameraFault::UnusablePose, fault);
        let Some(received) = inbox.take() else { return Ok(None) };
        let pose = pose_of(&received.message);
        if pose.is_none() {
            let text = "odometry without a time, or whose quaternion has not the length 1".to_owned();
            fault(CameraFault::UnusablePose, text);
        }
        Ok(pose.map(|(stamp, pose)| Reading::Pose(stamp, pose)))
    }

    fn is_reopened_after_stall(&self) -> bool {
        false
    }

    fn close(&mut self) {
        self.inbox = None;
    }
}
