//! RGB-D sequences as recordings: each image with its distances at the pose of the camera.

use crate::frame_image::FrameImage;
use crate::images::read_image;
use crate::recording::{DepthFile, RecordedFrame, Recording};
use crate::tum_folder::{TUM_UNITS_PER_M, TumFolder, TumFrame, tum_camera};
use scenecast_core::UserError;
use scenecast_sensors::{Calibration, Rotation, Sight, tilt_of};
use std::path::Path;
use std::sync::Arc;

/// How an RGB-D sequence is read.
#[derive(Debug, Clone, Default)]
pub struct TumOptions {
    /// `None` for the benchmark's own camera, scaled to the width of the images.
    pub calibration: Option<Arc<Calibration>>,
    /// Depth units per metre; `None` for those of the benchmark.
    pub units_per_m: Option<f64>,
    /// The largest angle between the optical axis and the vertical, radians.
    pub max_tilt_rad: Option<f64>,
    /// Height of the camera above the floor where an image shows no distance, metres.
    pub altitude_m: f64,
}

impl Recording {
    /// The images of an RGB-D sequence at the poses of its ground truth, whose axes are east, north and up.
    ///
    /// # Errors
    /// Lists that cannot be read, or a camera that is tilted more than allowed.
    pub fn open_tum(dir: &Path, options: &TumOptions) -> Result<Self, UserError> {
        let folder = TumFolder::open(dir)?;
        let calibration = match &options.calibration {
            Some(calibration) => calibration.clone(),
            None => {
                let width =
                    folder.frames.first().map_or(Ok(640), |first| read_image(&first.image).map(|i| i.width()))?;
                let own = Calibration::of_matrix(tum_camera(width));
                Arc::new(own.map_err(|error| UserError::file(dir, error))?)
            }
        };
        let began_s = folder.frames.first().map_or(0.0, |first| first.t_s);
        let mut frames = Vec::new();
        for frame in &folder.frames {
            frames.push(recorded(frame, began_s, &calibration, options).map_err(|cause| {
                UserError::Input(format!(
                    "{}: the pose at {} s: {cause}",
                    dir.join("groundtruth.txt").display(),
                    frame.t_s
                ))
            })?);
        }
        Ok(Self { frames, notes: folder.note().into_iter().collect() })
    }
}

fn recorded(
    frame: &TumFrame,
    began_s: f64,
    calibration: &Arc<Calibration>,
    options: &TumOptions,
) -> Result<RecordedFrame, String> {
    let turn = Rotation::from_quaternion(frame.pose.rotation).ok_or("the quaternion has not the length 1")?;
    let pose = turn.camera_pose(frame.pose.position);
    let axis = turn.apply([0.0, 0.0, 1.0]);
    let off_vertical = axis[0].hypot(axis[1]).atan2(-axis[2]);
    if let Some(most) = options.max_tilt_rad.filter(|most| off_vertical > *most) {
        return Err(format!(
            "the camera looks {:.0} degrees away from straight down; with registration.enabled = true, up to {:.0} are allowed",
            off_vertical.to_degrees(),
            most.to_degrees()
        ));
    }
    let tilt = tilt_of(frame.pose.rotation, pose.heading_rad);
    let units_per_m = options.units_per_m.unwrap_or(TUM_UNITS_PER_M);
    Ok(RecordedFrame {
        t_s: frame.t_s - began_s,
        image: FrameImage::File(frame.image.clone()),
        x_m: pose.x_m,
        y_m: pose.y_m,
        depth_m: pose.depth_m,
        heading_rad: pose.heading_rad,
        scale: 1.0,
        sight: Some(Sight { calibration: calibration.clone(), tilt, height_m: options.altitude_m }),
        depth: Some(DepthFile { path: frame.depth.clone(), units_per_m }),
    })
}
