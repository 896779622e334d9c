//! The recording that the settings name as the camera.

use crate::bag_recording::{BagTiming, BagTopics};
use crate::recording::Recording;
use scenecast_config::{CameraSource, Config, NavigationSource};
use scenecast_core::UserError;
use scenecast_sensors::CameraMounting;
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
            let timing = BagTiming {
                max_gap: Duration::from_secs_f64(config.navigation.max_gap_s),
                clock_offset_s: config.camera.clock_offset_s,
                mounting: configured_mounting(config),
                altitude_m: config.survey.altitude_m,
            };
            open_bag(bag, odometry, &timing).map(Some)
        }
        _ => Ok(None),
    }
}

/// Place and direction of the configured camera on the vehicle.
pub fn configured_mounting(config: &Config) -> CameraMounting {
    let [turn_rad, ahead, aside] = config.camera.mount_deg.map(f64::to_radians);
    CameraMounting { place_m: config.camera.mount_m, turn_rad, tilt_rad: [ahead, aside] }
}

/// Opens `FILE` or `FILE#TOPIC`; a bag with one topic of images or of odometry needs no name of it.
pub fn open_bag(bag: &str, odometry: Option<&str>, timing: &BagTiming) -> Result<Recording, UserError> {
    let (file, images) = match bag.split_once('#') {
        Some((file, topic)) => (file, Some(topic)),
        None => (bag, None),
    };
    Recording::open_bag(Path::new(file), BagTopics { images, odometry }, timing)
}
