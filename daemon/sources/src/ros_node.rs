//! The node of ROS 2 that the sensors share, and the account of their inboxes.

use crate::live::SourceError;
use scenecast_config::{Ros2, RosName};
use scenecast_ros2::{Inbox, RosNode, topic};
use scenecast_sensors::CameraFault;
use std::sync::{Arc, Mutex, PoisonError};

pub(crate) fn parsed(name: &str) -> Result<RosName, SourceError> {
    topic(name).map_err(|error| SourceError(error.to_string()))
}

/// The node of the sensors, which starts when the first of them is opened.
pub struct SensorNode {
    settings: Ros2,
    node: Mutex<Option<Arc<RosNode>>>,
}

impl SensorNode {
    pub fn new(settings: &Ros2) -> Self {
        Self { settings: settings.clone(), node: Mutex::default() }
    }

    pub fn get(&self) -> Result<Arc<RosNode>, SourceError> {
        let mut node = self.node.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(node) = &*node {
            return Ok(node.clone());
        }
        let started = RosNode::start(&self.settings, "scenecast_sensors");
        let started = Arc::new(started.map_err(|error| SourceError(error.to_string()))?);
        Ok(node.insert(started).clone())
    }
}

/// Messages of an inbox that are already reported as faults.
#[derive(Debug, Default)]
pub(crate) struct Counted {
    dropped: u64,
    malformed: u64,
}

impl Counted {
    /// Reports the messages since the last call that the inbox has dropped, as `lost`, and those of another type, as `wrong`.
    pub(crate) fn report<M>(
        &mut self,
        inbox: &Inbox<M>,
        lost: (CameraFault, &str),
        wrong: CameraFault,
        fault: &mut dyn FnMut(CameraFault, String),
    ) {
        let now = Self { dropped: inbox.dropped(), malformed: inbox.malformed() };
        let before = std::mem::replace(self, now);
        (before.dropped..self.dropped).for_each(|_| fault(lost.0, lost.1.to_owned()));
        let text = "the message has another type than the topic";
        (before.malformed..self.malformed).for_each(|_| fault(wrong, text.to_owned()));
    }
}
