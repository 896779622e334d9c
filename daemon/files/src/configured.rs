//! The recording that the settings name as the camera, and the vocabulary that they name.

use crate::bag_recording::{BagTiming, BagTopics};
use crate::recording::Recording;
use crate::tum_recording::TumOptions;
use scene_model::project::View;
use scene_model::words::Measures;
use scenecast_config::{CalibrationSource, CameraSource, Config, NavigationSource};
use scenecast_core::UserError;
use scenecast_sensors::{BitDepth, Calibration, CameraMounting, ViewGeometry, read_calibration};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

/// The largest tilt of frames that are registered, radians.
const MAX_TILT_RAD: f64 = 0.6;

/// The recording that is the camera; `None` if the camera is live, or the sea floor of a rehearsal.
pub fn configured_recording(config: &Config) -> Result<Option<Recording>, UserError> {
    let calibration = configured_calibration(config)?;
    let altitude_m = config.survey.altitude_m;
    match &config.camera.source {
        CameraSource::Frames(dir) => {
            let mut recording = Recording::open(dir, None, config.camera.metres_per_pixel)?;
            if let Some(calibration) = calibration {
                for frame in &mut recording.frames {
                    let height_m = altitude_m * frame.scale;
                    frame.geometry =
                        Some(ViewGeometry { calibration: calibration.clone(), tilt: View::DOWN, height_m });
                }
            }
            Ok(Some(recording))
        }
        CameraSource::Tum(dir) => {
            let units_per_m = Some(config.camera.depth_units_per_m).filter(|units| *units > 0.0);
            let max_tilt_rad = config.registration.enabled.then_some(MAX_TILT_RAD);
            let options = TumOptions { calibration, units_per_m, max_tilt_rad, altitude_m };
            Recording::open_tum(dir, &options).map(Some)
        }
        CameraSource::Bag(bag) => {
            let odometry = match &config.navigation.source {
                NavigationSource::Ros2(topic) => Some(topic.as_str()),
                _ => None,
            };
            let timing = BagTiming {
                max_gap: Duration::from_secs_f64(config.navigation.max_gap_s),
                clock_offset_s: config.camera.clock_offset_s,
                mounting: configured_mounting(config),
                altitude_m,
                calibration,
                reads_info: config.camera.calibration == CalibrationSource::Beside,
                bits: BitDepth::of_setting(config.camera.bits),
            };
            open_bag(bag, odometry, &timing).map(Some)
        }
        _ => Ok(None),
    }
}

/// Size of the largest file of a calibration, bytes.
const MAX_CALIBRATION_BYTES: u64 = 1 << 20;

/// The calibration by `camera.matrix` or a file; `None` if there is none, or if it comes in by ROS 2.
///
/// # Errors
/// A file that cannot be read, or numbers that are no calibration.
pub fn configured_calibration(config: &Config) -> Result<Option<Arc<Calibration>>, UserError> {
    let calibration = match &config.camera.calibration {
        CalibrationSource::File(path) => {
            let text = scenecast_config::read_text(path, MAX_CALIBRATION_BYTES)?;
            let info = read_calibration(&text);
            let info = info.map_err(|error| UserError::Input(format!("{}:{error}", path.display())))?;
            Calibration::of_info(&info, false).map_err(|error| UserError::file(path, error))?
        }
        _ if config.camera.matrix != [0.0; 4] => {
            let given = config.camera.matrix;
            Calibration::of_matrix(given)
                .map_err(|error| UserError::Input(format!("camera.matrix = {given:?}: {error}")))?
        }
        _ => return Ok(None),
    };
    Ok(Some(Arc::new(calibration)))
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

/// Most bytes of a vocabulary; one takes some kilobytes.
const MAX_VOCABULARY_BYTES: u64 = 1 << 20;

/// Reads a vocabulary that `scenecast vocabulary train` wrote.
pub fn read_vocabulary(path: &Path) -> Result<Measures, UserError> {
    let bytes = scenecast_config::read_regular(path, MAX_VOCABULARY_BYTES)?;
    let advice = "make one with scenecast vocabulary train";
    scene_model::vocabulary::load(&bytes).map_err(|e| UserError::file(path, format!("{e}; {advice}")))
}

/// The vocabulary of `scene.vocabulary`; `None` for the one that ships.
///
/// # Errors
/// As [`read_vocabulary`].
pub fn configured_vocabulary(file: Option<&Path>) -> Result<Option<Measures>, UserError> {
    file.map(read_vocabulary).transpose()
}
