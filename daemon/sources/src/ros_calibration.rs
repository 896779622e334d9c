//! The calibration of a camera of ROS 2.

use crate::live::SourceError;
use crate::ros_node::parsed;
use scenecast_messages::sensor_msgs::CameraInfo;
use scenecast_messages::std_msgs::Header;
use scenecast_ros2::{Inbox, RosNode};
use scenecast_sensors::{Calibration, CalibrationError, CameraFault, Stamp, camera_info_beside};
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

/// Time from the first image within which a publisher of the calibration beside it may still be found. Until then images without
/// one are dropped.
const FIND_TIME: Duration = Duration::from_secs(3);

/// Why an image is dropped for want of the calibration on a topic.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(crate) enum NoCalibration {
    #[error("no usable calibration on {topic}")]
    Unusable { topic: String },
    #[error("{topic} is looked for, up to {} s; camera.calibration = \"none\" does without", FIND_TIME.as_secs())]
    Sought { topic: String },
}

/// The topic of a calibration, and its last usable message.
pub(crate) struct RosCalibration {
    topic: Option<String>,
    is_needed: bool,
    /// Whether the images of the topic are without distortion, as those of `image_proc`.
    is_rectified: bool,
    inbox: Option<Inbox<CameraInfo>>,
    /// When the first image came in.
    first: Option<Stamp>,
    /// The last message, usable or not.
    last: Option<CameraInfo>,
    /// Once there is one, images are never used without.
    calibration: Option<Arc<Calibration>>,
    /// Why the last message cannot be used, until it is reported.
    refused: Option<String>,
    is_absence_logged: bool,
}

impl RosCalibration {
    /// `images` is the topic of the images.
    pub(crate) fn new(source: &CalibrationTopic, images: &str) -> Self {
        let (beside, is_rectified) = camera_info_beside(images);
        let topic = match source {
            CalibrationTopic::None => None,
            CalibrationTopic::Beside => Some(beside),
            CalibrationTopic::Named(topic) => Some(topic.clone()),
        };
        Self {
            topic,
            is_needed: matches!(source, CalibrationTopic::Named(_)),
            is_rectified,
            inbox: None,
            first: None,
            last: None,
            calibration: None,
            refused: None,
            is_absence_logged: false,
        }
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

    /// The newest usable calibration for an image that came in at `now`; `None` if the images are used without one.
    ///
    /// # Errors
    /// There is none, and images cannot be used without it, or a publisher of it may still be found.
    pub(crate) fn current(&mut self, now: Stamp) -> Result<Option<Arc<Calibration>>, NoCalibration> {
        let newest = self.inbox.as_ref().and_then(|inbox| {
            if self.first.is_none() {
                inbox.wait(FIRST_WAIT);
            }
            inbox.take_newest()
        });
        if let Some(received) = newest {
            self.handle_info(received.message);
        }
        self.for_image(now)
    }

    fn for_image(&mut self, now: Stamp) -> Result<Option<Arc<Calibration>>, NoCalibration> {
        let Some(topic) = &self.topic else { return Ok(None) };
        let first = *self.first.get_or_insert(now);
        if self.calibration.is_some() {
            return Ok(self.calibration.clone());
        }
        if self.is_needed {
            return Err(NoCalibration::Unusable { topic: topic.clone() });
        }
        if self.last.is_none() && now < first.after(FIND_TIME) {
            return Err(NoCalibration::Sought { topic: topic.clone() });
        }
        if !std::mem::replace(&mut self.is_absence_logged, true) {
            let why = if self.last.is_some() { "has no usable calibration" } else { "was not found" };
            tracing::warn!("camera: {topic} {why}: images are mapped without one until there is one");
        }
        Ok(None)
    }

    fn handle_info(&mut self, info: CameraInfo) {
        // Drivers repeat the calibration with each image.
        let info = CameraInfo { header: Header::default(), ..info };
        if self.last.as_ref() == Some(&info) {
            return;
        }
        match Calibration::of_info(&info, self.is_rectified) {
            Ok(calibration) if self.calibration.as_deref() != Some(&calibration) => {
                let topic = self.topic.as_deref().unwrap_or_default();
                let which = if self.calibration.is_some() { "another calibration" } else { "the calibration" };
                tracing::info!("camera: images are rectified by {which} of {topic}");
                self.calibration = Some(Arc::new(calibration));
            }
            Ok(_) => {}
            Err(CalibrationError::Uncalibrated) if !self.is_needed && self.calibration.is_none() => {}
            Err(error) if self.calibration.is_some() => {
                self.refused = Some(format!("{error}; the calibration before it is used"));
            }
            Err(error) => self.refused = Some(error.to_string()),
        }
        self.last = Some(info);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info() -> CameraInfo {
        let k = [300.0, 0.0, 160.0, 0.0, 300.0, 120.0, 0.0, 0.0, 1.0];
        CameraInfo { width: 320, height: 240, k, ..CameraInfo::default() }
    }

    fn beside() -> RosCalibration {
        RosCalibration::new(&CalibrationTopic::Beside, "/camera/image_raw")
    }

    fn at(s: f64) -> Stamp {
        Stamp::default().shifted(s)
    }

    #[test]
    fn a_wrong_calibration_is_named_once_and_the_last_good_kept() {
        let mut source = beside();
        let mut info = info();
        source.handle_info(info.clone());
        let first = source.for_image(at(0.0)).unwrap().unwrap();
        info.header.stamp.sec = 5;
        source.handle_info(info.clone());
        assert!(Arc::ptr_eq(&first, &source.for_image(at(1.0)).unwrap().unwrap()));
        for wrong in [-1.0, 0.0] {
            info.k = [wrong; 9];
            source.handle_info(info.clone());
            let mut texts = Vec::new();
            (0..2).for_each(|_| source.report(&mut |_, text| texts.push(text)));
            assert!(texts.len() == 1 && texts[0].ends_with("the calibration before it is used"), "{texts:?}");
            assert!(Arc::ptr_eq(&first, &source.for_image(at(2.0)).unwrap().unwrap()));
        }
    }

    #[test]
    fn first_images_are_dropped_while_a_calibration_may_be_found() {
        let mut source = beside();
        let sought = source.for_image(at(10.0)).unwrap_err().to_string();
        assert!(sought.contains("/camera/camera_info is looked for, up to 3 s"), "{sought}");
        assert!(source.for_image(at(12.9)).is_err());
        source.handle_info(info());
        assert!(source.for_image(at(12.95)).unwrap().is_some());

        let mut without = beside();
        assert!(without.for_image(at(10.0)).is_err());
        assert_eq!(without.for_image(at(13.0)), Ok(None));

        let mut uncalibrated = beside();
        uncalibrated.handle_info(CameraInfo::default());
        assert_eq!(uncalibrated.for_image(at(10.0)), Ok(None), "the driver says that there is none");

        let mut none = RosCalibration::new(&CalibrationTopic::None, "/camera/image_raw");
        assert_eq!(none.for_image(at(10.0)), Ok(None));
    }
}
