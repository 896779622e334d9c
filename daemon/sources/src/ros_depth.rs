//! Distances of ROS 2.

use crate::ArrivalClock;
use crate::live::{Reading, SensorKind, SensorSource, SourceDepth, SourceError};
use crate::ros_node::{Counted, SensorNode, parsed};
use scenecast_messages::sensor_msgs::{Image, PointCloud2};
use scenecast_ros2::Inbox;
use scenecast_sensors::{CameraFault, DepthMessage, stamp_of};
use std::sync::Arc;
use std::time::Duration;

/// A topic of depth images or of point clouds.
pub struct RosDepth {
    node: Arc<SensorNode>,
    topic: String,
    is_cloud: bool,
    clock: ArrivalClock,
    /// Whether a message without a stamp is dropped.
    needs_stamps: bool,
    inbox: Option<DepthInbox>,
    counted: Counted,
}

enum DepthInbox {
    Images(Inbox<Image>),
    Clouds(Inbox<PointCloud2>),
}

/// A measurement that a newer one displaced in its inbox.
const OVERTAKEN: (CameraFault, &str) = (CameraFault::UnusableDepth, "a newer message came before it was read");

impl RosDepth {
    pub fn new(node: Arc<SensorNode>, topic: &str, is_cloud: bool, clock: ArrivalClock, needs_stamps: bool) -> Self {
        Self { node, topic: topic.to_owned(), is_cloud, clock, needs_stamps, inbox: None, counted: Counted::default() }
    }
}

impl SensorSource for RosDepth {
    fn kind(&self) -> SensorKind {
        SensorKind::Depth
    }

    fn open(&mut self) -> Result<(), SourceError> {
        let (name, node) = (parsed(&self.topic)?, self.node.get()?);
        let failed = |error: scenecast_core::UserError| SourceError(error.to_string());
        self.inbox = Some(match self.is_cloud {
            true => DepthInbox::Clouds(node.subscribe_clouds(&name).map_err(failed)?),
            false => DepthInbox::Images(node.subscribe_images(&name).map_err(failed)?),
        });
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        let message = match &self.inbox {
            Some(DepthInbox::Images(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::UnusableDepth, fault);
                inbox.take().map(|received| DepthMessage::Image(received.message))
            }
            Some(DepthInbox::Clouds(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::UnusableDepth, fault);
                inbox.take().map(|received| DepthMessage::Cloud(received.message))
            }
            None => return Err(SourceError("the topic is not open".to_owned())),
        };
        let Some(message) = message else { return Ok(None) };
        let stamp = stamp_of(message.header());
        if stamp.is_none() && self.needs_stamps {
            fault(CameraFault::UnusableDepth, "a measurement of distances has no time".to_owned());
            return Ok(None);
        }
        Ok(Some(Reading::Depth(SourceDepth { stamp, arrival: self.clock.now(), message })))
    }

    fn is_reopened_after_stall(&self) -> bool {
        false
    }

    fn close(&mut self) {
        self.inbox = None;
    }
}
