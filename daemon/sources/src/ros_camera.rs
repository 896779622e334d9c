//! Cameras of ROS 2.

use crate::live::{Reading, SensorKind, SensorSource, SourceError, SourceImage};
use crate::ros_node::{Counted, SensorNode, parsed};
use crate::{ArrivalClock, Picture};
use scenecast_messages::sensor_msgs::{CompressedImage, Image};
use scenecast_messages::std_msgs::Header;
use scenecast_ros2::Inbox;
use scenecast_sensors::{CameraFault, Stamp, rgb_of, stamp_of};
use std::sync::Arc;
use std::time::Duration;

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

/// An image that a newer one displaced in its inbox.
const OVERTAKEN: (CameraFault, &str) = (CameraFault::Overtaken, "a newer message came before it was read");

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
