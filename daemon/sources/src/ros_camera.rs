//! Cameras of ROS 2, and their distances.

use crate::live::{Reading, SensorKind, SensorSource, SourceDepth, SourceError, SourceImage};
use crate::ros_calibration::{CalibrationTopic, RosCalibration};
use crate::ros_node::{Counted, SensorNode, parsed};
use crate::{ArrivalClock, Picture};
use scenecast_messages::sensor_msgs::{CompressedImage, Image, PointCloud2};
use scenecast_messages::std_msgs::Header;
use scenecast_ros2::Inbox;
use scenecast_sensors::{BitDepth, CameraFault, DepthMessage, Stamp, rgb_of, stamp_of};
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
    bits: BitDepth,
    calibration: RosCalibration,
    inbox: Option<CameraInbox>,
    counted: Counted,
}

enum CameraInbox {
    Raw(Inbox<Image>),
    Compressed(Inbox<CompressedImage>),
}

/// A message of either type.
enum Either {
    Raw(Image),
    Compressed(CompressedImage),
}

/// How the messages of a camera are read.
#[derive(Debug, Clone)]
pub struct RosCameraOptions {
    /// Whether a message without a stamp is dropped.
    pub needs_stamps: bool,
    /// The bits of levels in 16-bit images.
    pub bits: BitDepth,
    pub calibration: CalibrationTopic,
}

/// An image that a newer one displaced in its inbox.
const OVERTAKEN: (CameraFault, &str) = (CameraFault::Overtaken, "a newer message came before it was read");

impl RosCamera {
    pub fn new(node: Arc<SensorNode>, topic: &str, clock: ArrivalClock, options: &RosCameraOptions) -> Self {
        Self {
            node,
            topic: topic.to_owned(),
            clock,
            needs_stamps: options.needs_stamps,
            bits: options.bits,
            calibration: RosCalibration::new(&options.calibration, topic),
            inbox: None,
            counted: Counted::default(),
        }
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

    fn raw(&mut self, image: &Image) -> Result<SourceImage, (CameraFault, String)> {
        let stamp = self.stamp(&image.header)?;
        let rgb = rgb_of(image, &mut self.bits).map_err(|error| (CameraFault::Encoding, error.to_string()))?;
        self.image(stamp, Picture::Rgb(rgb))
    }

    fn compressed(&mut self, image: CompressedImage) -> Result<SourceImage, (CameraFault, String)> {
        let stamp = self.stamp(&image.header)?;
        self.image(stamp, Picture::Compressed(image.data))
    }

    fn image(&mut self, stamp: Option<Stamp>, picture: Picture) -> Result<SourceImage, (CameraFault, String)> {
        let arrival = self.clock.now();
        let calibration = self.calibration.current(arrival);
        let calibration = calibration.map_err(|why| (CameraFault::Calibration, why.to_string()))?;
        Ok(SourceImage { stamp, arrival, picture, calibration })
    }
}

impl SensorSource for RosCamera {
    fn kind(&self) -> SensorKind {
        SensorKind::Camera
    }

    fn open(&mut self) -> Result<(), SourceError> {
        let name = parsed(&self.topic)?;
        let node = self.node.get()?;
        self.calibration.open(&node)?;
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
        self.calibration.report(fault);
        let received = match &self.inbox {
            Some(CameraInbox::Raw(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::Unreadable, fault);
                inbox.take().map(|received| Either::Raw(received.message))
            }
            Some(CameraInbox::Compressed(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, OVERTAKEN, CameraFault::Unreadable, fault);
                inbox.take().map(|received| Either::Compressed(received.message))
            }
            None => return Err(SourceError("the topic is not open".to_owned())),
        };
        let image = received.map(|message| match message {
            Either::Raw(image) => self.raw(&image),
            Either::Compressed(image) => self.compressed(image),
        });
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
        self.calibration.close();
        self.inbox = None;
    }
}

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
const DEPTH_OVERTAKEN: (CameraFault, &str) = (CameraFault::UnusableDepth, "a newer message came before it was read");

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
                self.counted.report(inbox, DEPTH_OVERTAKEN, CameraFault::UnusableDepth, fault);
                inbox.take().map(|received| DepthMessage::Image(received.message))
            }
            Some(DepthInbox::Clouds(inbox)) => {
                inbox.wait(timeout);
                self.counted.report(inbox, DEPTH_OVERTAKEN, CameraFault::UnusableDepth, fault);
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
