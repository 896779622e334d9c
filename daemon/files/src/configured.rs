//! The recording that the settings name as the camera.

use crate::bag::BagTopics;
use crate::recording::Recording;
use scenecast_config::{CameraSource, Config, NavigationSource};
use scenecast_core::UserError;
use std::path::Path;
use std::time::Duration;

/// The recording that is the camera; `None` if the camera is live, or the sea floor of a rehearsal.
pub fn configured_recording(config: &Config) -> Result<Option<Recording>, UserError> {
    match &config.camera.source {
        CameraSource::Frames(dir) => Recording::open(dir, None, config.camera.metres_per_pixel).map(Some),
        CameraSource::Bag(bag) => {
            let odometry = match &config.navigation.source {
                NavigationSource::Ros2(topic) => Some(topic.as_str()),
                _ => None,
            };
            open_bag(bag, odometry, Duration::from_secs_f64(config.navigation.max_gap_s)).map(Some)
        }
        _ => Ok(None),
    }
}

/// Opens `FILE` or `FILE#TOPIC`; a bag with one topic of images or of odometry needs no name of it.
pub fn open_bag(bag: &str, odometry: Option<&str>, max_gap: Duration) -> Result<Recording, UserError> {
    let (file, images) = match bag.split_once('#') {
        Some((file, topic)) => (file, Some(topic)),
        None => (bag, None),
    };
    Recording::open_bag(Path::new(file), BagTopics { images, odometry }, max_gap)
}
