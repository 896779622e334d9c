//! Cameras and odometry of ROS 2.

use crate::live::{Reading, SensorKind, SensorSource, SourceError, SourceImage};
use crate::{ArrivalClock, Picture};
use scenecast_config::{Ros2, RosName};
use scenecast_messages::nav_msgs::Odometry;
use scenecast_messages::sensor_msgs::{CompressedImage, Image};
use scenecast_messages::std_msgs::Header;
use scenecast_ros2::{Inbox, RosNode, topic};
use scenecast_sensors::{CameraFault, Stamp, pose_of, rgb_of, stamp_of};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

fn parsed(name: &str) -> Result<RosName, SourceError> {
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

    /// The node, which starts now if it has not.
    ///
    /// # Errors
    ///
    /// DDS does not start.
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

/// The topic of a camera: of `sensor_msgs/msg/CompressedImage` if its name ends in `/compressed`, or else of
/// `sensor_msgs/msg/Image`.
pub struct RosCamera {
    node: Arc<SensorNode>,
    topic: String,
    clock: ArrivalClock,
    /// Whether stamps of the messages are used, so that a message without one is dropped.
    needs_stamps: bool,
    inbox: Option<CameraInbox>,
    counted: Counted,
}

enum CameraInbox {
    Raw(Inbox<Image>),
    Compressed(Inbox<CompressedImage>),
}

/// Messages of an inbox that are already reported as faults.
#[derive(Debug, Default)]
struct Counted {
    dropped: u64,
    malformed: u64,
}

impl Counted {
    /// Reports the messages since the last call that the inbox has dropped, as `lost`, and those of another type, as `wrong`.
    fn report<M>(
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

/// An image that a newer one displaced in its inbox.
const OVERTAKEN: (CameraFault, &str) = (CameraFault::Overtaken, "a newer message came before it was read");

/// A pose that was displaced in its inbox.
const LOST_POSE: (CameraFault, &str) = (CameraFault::UnusablePose, "a pose was dropped: the vehicle was busy");

impl RosCamera {
    pub fn new(node: Arc<SensorNode>, topic: &str, clock: ArrivalClock, needs_stamps: bool) -> Self {
        Self { node, topic: topic.to_owned(), clock, needs_stamps, inbox: None, counted: Counted::default() }
    }

    /// The time of a header; `Err` if it has none and needs one.
    fn stamp(&self, header: &Header) -> Result<Option<Stamp>, (CameraFault, String)> {
        let stamp = stamp_of(header);
        if stamp.is_none() && self.needs_stamps {
            let advice = "set camera.stamps = \"arrival\" if the camera does not know the time";
            return Err((CameraFault::NoStamp, advice.to_owned()));
        }
        Ok(stamp)
    }

    fn raw(&self, image: &Image) -> Result<SourceImage, (CameraFault, String)> {
        let stamp = self.stamp(&image.header)?;
        let rgb = rgb_of(image).map_err(|error| (CameraFault::Encoding, error.to_string()))?;
        Ok(SourceImage { stamp, arrival: self.clock.now(), picture: Picture::Rgb(rgb) })
    }

    fn compressed(&self, image: CompressedImage) -> Result<SourceImage, (CameraFault, String)> {
        let stamp = self.stamp(&image.header)?;
        Ok(SourceImage { stamp, arrival: self.clock.now(), picture: Picture::Compressed(image.data) })
    }
}

impl SensorSource for RosCamera {
    fn kind(&self) -> SensorKind {
        SensorKind::Camera
    }

    fn open(&mut self) -> Result<(), SourceError> {
        let name = parsed(&self.topic)?;
        let node = self.node.get()?;
        let failed = |error: scenecast_core::UserError| SourceError(error.to_string());
        self.inbox = Some(if self.topic.ends_with("/compressed") {
            CameraInbox::Compressed(node.subscribe_compressed_images(&name).map_err(failed)?)
        } else {
            CameraInbox::Raw(node.subscribe_images(&name).map_err(failed)?)
        });
        Ok(())
    }

    fn next(
        &mut self,
        timeout: Duration,
        fault: &mut dyn FnMut(CameraFault, String),
    ) -> Result<Option<Reading>, SourceError> {
        let image = match &self.inbox {
            Some(CameraInbox::Raw(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::Unreadable, fault);
                inbox.take().map(|received| self.raw(&received.message))
            }
            Some(CameraInbox::Compressed(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::Unreadable, fault);
                inbox.take().map(|received| self.compressed(received.message))
            }
            None => return Err(SourceError("the topic is not open".to_owned())),
        };
        Ok(match image {
            Some(Ok(image)) => Some(Reading::Image(image)),
            Some(Err((kind, text))) => {
                fault(kind, text);
                None
            }
            None => None,
        })
    }

    fn is_reopened_after_stall(&self) -> bool {
        // The subscription finds a publisher that comes back.
        false
    }

    fn close(&mut self) {
        self.inbox = None;
    }
}

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
