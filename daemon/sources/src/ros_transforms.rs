//! The pose of a vehicle from the transforms (REP 105) and the odometry of ROS 2.

use crate::live::{Reading, SensorKind, SensorSource, SourceError};
use crate::ros_node::{Counted, SensorNode, parsed};
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::tf2_msgs::TFMessage;
use scenecast_ros2::Inbox;
use scenecast_sensors::{CameraFault, TransformTree, pose_of};
use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Transforms that were displaced in their inbox.
const LOST: (CameraFault, &str) = (CameraFault::UnusablePose, "transforms were dropped: the vehicle was busy");
/// Time after which transforms without a pose are explained.
const EXPLAIN_AFTER: Duration = Duration::from_secs(5);
/// Most poses of one message.
const MAX_POSES: usize = 100;

/// The topics `/tf` and `/tf_static`, and the two frames between which they give the pose.
pub struct RosTransforms {
    node: Arc<SensorNode>,
    /// The frame of east, north, up, and that of the vehicle.
    frames: (String, String),
    tree: TransformTree,
    inboxes: Option<(Inbox<TFMessage>, Inbox<TFMessage>)>,
    counted: (Counted, Counted),
    poses: VecDeque<Reading>,
    /// When the topics were opened, until a pose came in or the lack of one was explained.
    without_pose: Option<Instant>,
}

impl RosTransforms {
    /// `frames` are the name of the frame of east, north, up, and that of the vehicle.
    pub fn new(node: Arc<SensorNode>, frames: (&str, &str)) -> Self {
        Self {
            node,
            frames: (frames.0.to_owned(), frames.1.to_owned()),
            tree: TransformTree::new(frames.0, frames.1),
            inboxes: None,
            counted: Default::default(),
            poses: VecDeque::new(),
            without_pose: None,
        }
    }

    /// Says once which frames came in if they give no pose.
    fn explain(&mut self, fault: &mut dyn FnMut(CameraFault, String)) {
        if self.without_pose.is_some_and(|since| since.elapsed() >= EXPLAIN_AFTER) {
            self.without_pose = None;
            fault(CameraFault::UnusablePose, self.tree.explain());
        }
    }

    fn handle(&mut self, message: &TFMessage, is_static: bool, fault: &mut dyn FnMut(CameraFault, String)) {
        for transform in &message.transforms {
            match self.tree.handle(transform, is_static) {
                Ok(Some((stamp, pose))) if self.poses.len() < MAX_POSES => {
                    self.poses.push_back(Reading::Pose(stamp, pose));
                }
                Ok(_) => {}
                Err(error) => fault(CameraFault::UnusablePose, error.to_string()),
            }
        }
    }
}

impl SensorSource for RosTransforms {
    fn kind(&self) -> SensorKind {
        SensorKind::Navigation
    }

    fn open(&mut self) -> Result<(), SourceError> {
        let node = self.node.get()?;
        let failed = |error: scenecast_core::UserError| SourceError(error.to_string());
        let changing = node.subscribe_tf(&parsed("/tf")?).map_err(failed)?;
        let lasting = node.subscribe_static_tf(&parsed("/tf_static")?).map_err(failed)?;
        self.inboxes = Some((changing, lasting));
        self.without_pose = Some(Instant::now());
        self.tree = TransformTree::new(&self.frames.0, &self.frames.1);
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        if let Some(pose) = self.poses.pop_front() {
            return Ok(Some(pose));
        }
        let Some((changing, lasting)) = self.inboxes.take() else {
            return Err(SourceError("the topics of the transforms are not open".to_owned()));
        };
        changing.wait(timeout);
        self.counted.0.report(&changing, LOST, CameraFault::UnusablePose, fault);
        self.counted.1.report(&lasting, LOST, CameraFault::UnusablePose, fault);
        while let Some(received) = lasting.take() {
            self.handle(&received.message, true, fault);
        }
        if let Some(received) = changing.take() {
            self.handle(&received.message, false, fault);
        }
        self.inboxes = Some((changing, lasting));
        let pose = self.poses.pop_front();
        match pose {
            Some(_) => self.without_pose = None,
            None => self.explain(fault),
        }
        Ok(pose)
    }

    fn is_reopened_after_stall(&self) -> bool {
        // The subscription finds a publisher that comes back.
        false
    }

    fn close(&mut self) {
        self.inboxes = None;
        self.poses.clear();
    }
}

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
