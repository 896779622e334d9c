//! The calibration of a camera of ROS 2.

use crate::live::SourceError;
use crate::ros_node::parsed;
use scenecast_messages::sensor_msgs::CameraInfo;
use scenecast_messages::std_msgs::Header;
use scenecast_ros2::{Inbox, RosNode};
use scenecast_sensors::{Calibration, CalibrationError, CameraFault};
use std::sync::Arc;
use std::time::Duration;

/// Where the calibration of a camera comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CalibrationTopic {
    /// It is known by other means.
    None,
    /// `camera_info` beside the images, if somebody publishes it.
    Beside,
    /// This topic; without it, images cannot be used.
    Named(String),
}

/// Longest wait of the first image for the calibration beside it.
const FIRST_WAIT: Duration = Duration::from_millis(300);

/// The topic of a calibration, and its last message.
pub(crate) struct RosCalibration {
    topic: Option<String>,
    is_needed: bool,
    /// Whether the images of the topic are without distortion, as those of `image_proc`.
    is_rectified: bool,
    inbox: Option<Inbox<CameraInfo>>,
    has_waited: bool,
    last: Option<(CameraInfo, Option<Arc<Calibration>>)>,
    /// Why the last message cannot be used, until it is reported.
    refused: Option<String>,
}

/// The topic `camera_info` in the namespace of the images, and whether these are rectified by their name.
fn beside(images: &str) -> (String, bool) {
    let images = images.strip_suffix("/compressed").unwrap_or(images);
    let (namespace, name) = images.rsplit_once('/').unwrap_or(("", images));
    let topic = if namespace.is_empty() && !images.starts_with('/') { String::new() } else { format!("{namespace}/") };
    (format!("{topic}camera_info"), name.starts_with("image_rect"))
}

impl RosCalibration {
    /// `images` is the topic of the images.
    pub(crate) fn new(source: &CalibrationTopic, images: &str) -> Self {
        let (beside, is_rectified) = beside(images);
        let topic = match source {
            CalibrationTopic::None => None,
            CalibrationTopic::Beside => Some(beside),
            CalibrationTopic::Named(topic) => Some(topic.clone()),
        };
        let is_needed = matches!(source, CalibrationTopic::Named(_));
        Self { topic, is_needed, is_rectified, inbox: None, has_waited: false, last: None, refused: None }
    }

    pub(crate) fn open(&mut self, node: &RosNode) -> Result<(), SourceError> {
        if let Some(topic) = &self.topic {
            let inbox = node.subscribe_camera_info(&parsed(topic)?);
            self.inbox = Some(inbox.map_err(|error| SourceError(error.to_string()))?);
        }
        Ok(())
    }

    pub(crate) fn close(&mut self) {
        self.inbox = None;
    }

    /// Reports a calibration that cannot be used, once.
    pub(crate) fn report(&mut self, fault: &mut dyn FnMut(CameraFault, String)) {
        if let Some(text) = self.refused.take() {
            fault(CameraFault::BadCalibration, text);
        }
    }

    /// The newest calibration; `None` without one. The first image waits for it for a moment.
    ///
    /// # Errors
    /// There is none, and images cannot be used without it.
    pub(crate) fn current(&mut self) -> Result<Option<Arc<Calibration>>, String> {
        let Some(inbox) = &self.inbox else { return Ok(None) };
        if !std::mem::replace(&mut self.has_waited, true) {
            inbox.wait(FIRST_WAIT);
        }
        if let Some(received) = inbox.take_newest() {
            self.handle_info(received.message);
        }
        let calibration = self.last.as_ref().and_then(|(_, calibration)| calibration.clone());
        match calibration {
            None if self.is_needed => {
                Err(format!("no usable calibration on {}", self.topic.as_deref().unwrap_or_default()))
            }
            calibration => Ok(calibration),
        }
    }

    fn handle_info(&mut self, info: CameraInfo) {
        // Drivers repeat the calibration with each image.
        let info = CameraInfo { header: Header::default(), ..info };
        if self.last.as_ref().is_some_and(|(last, _)| *last == info) {
            return;
        }
        let calibration = match Calibration::of_info(&info, self.is_rectified) {
            Ok(calibration) => Some(Arc::new(calibration)),
            Err(CalibrationError::Uncalibrated) if !self.is_needed => None,
            Err(error) => {
                self.refused = Some(error.to_string());
                None
            }
        };
        self.last = Some((info, calibration));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_calibration_is_beside_the_images() {
        for (images, info, is_rectified) in [
            ("/camera/image_raw", "/camera/camera_info", false),
            ("/stereo/left/image_rect_color/compressed", "/stereo/left/camera_info", true),
            ("/image", "/camera_info", false),
            ("image_rect", "camera_info", true),
        ] {
            assert_eq!(beside(images), (info.to_owned(), is_rectified), "{images}");
        }
    }

    #[test]
    fn a_calibration_is_read_once_and_a_wrong_one_is_named() {
        let mut source = RosCalibration::new(&CalibrationTopic::Beside, "/camera/image_raw");
        let k = [300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0];
        let mut info = CameraInfo { width: 320, height: 240, k, ..CameraInfo::default() };
        source.handle_info(info.clone());
        let first = source.last.clone().unwrap().1.unwrap();
        info.header.stamp.sec = 5;
        source.handle_info(info.clone());
        assert!(Arc::ptr_eq(&first, &source.last.clone().unwrap().1.unwrap()));
        info.k[0] = -1.0;
        source.handle_info(info);
        let mut texts = Vec::new();
        (0..2).for_each(|_| source.report(&mut |_, text| texts.push(text)));
        assert!(source.last.unwrap().1.is_none() && texts.len() == 1 && texts[0].contains("the matrix K"));
    }
}
