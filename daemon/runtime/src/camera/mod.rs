//! The camera of a vehicle: a recording, or a live camera whose images are matched with poses.

mod fault_log;
mod live;
mod pose_feed;
mod recorded;

use live::LiveCamera;
use recorded::RecordedCamera;

use crate::clock::Clock;
use crate::ros2::RosSensors;
use image::RgbImage;
use scene_model::project::View;
use scenecast_config::Config;
use scenecast_core::UserError;
use scenecast_files::{RecordedFrame, Recording};
use scenecast_host::{CameraPose, MeasuredPose};
use scenecast_sensors::{
    BitDepth, CalibrationError, CameraTally, DecodeError, DepthError, DepthMessage, SensorPose, ViewGeometry,
};
use scenecast_sources::Picture;
use std::time::Duration;

/// An image and where it was taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraFrame {
    /// Mission time of the image, in seconds.
    pub(crate) t_s: f64,
    pub(crate) picture: FramePicture,
    /// Of the camera itself if it is calibrated; otherwise above the middle of the frame.
    pub(crate) pose: SensorPose,
    /// Size of the image's pixels on the sea floor, in those of the camera's usual ones.
    pub(crate) scale: f64,
}

/// The pixels of a frame, which are read where the frame is mapped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum FramePicture {
    Recorded(Box<RecordedFrame>),
    Received(Box<ReceivedImage>),
    /// It was read by [`CameraFrame::take_image`].
    Taken,
}

/// An image of a live camera.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ReceivedImage {
    pub(crate) picture: Picture,
    /// The bits of levels in a compressed image with 16.
    pub(crate) bits: BitDepth,
    /// The calibrated camera, if there is a calibration.
    pub(crate) geometry: Option<ViewGeometry>,
    /// The distances that belong to the image, and the units of whole numbers in a metre.
    pub(crate) depth: Option<(DepthMessage, f64)>,
}

/// The pixels of a frame that were read.
pub(crate) struct ReadFrame {
    pub(crate) image: RgbImage,
    /// The camera as it is mounted and tilted, if it is known.
    pub(crate) view: Option<View>,
    /// Why its distances were not used.
    pub(crate) unusable_depth: Option<DepthError>,
}

impl CameraFrame {
    /// The image, and the frame without its pixels.
    pub(crate) fn take_image(&mut self) -> Result<ReadFrame, UserError> {
        match std::mem::replace(&mut self.picture, FramePicture::Taken) {
            FramePicture::Recorded(frame) => {
                let (image, view) = frame.read()?;
                Ok(ReadFrame { image, view, unusable_depth: None })
            }
            FramePicture::Received(received) => {
                let fault = |fault| UserError::Input(format!("the image at {:.1} s: {fault}", self.t_s));
                received.read().map_err(fault)
            }
            FramePicture::Taken => Err(UserError::Failed("the image was already read".to_owned())),
        }
    }

    pub(crate) fn camera_pose(&self) -> CameraPose {
        let SensorPose { x_m, y_m, heading_rad, depth_m, .. } = self.pose;
        CameraPose { x_m, y_m, heading_rad, depth_m }
    }
}

/// Why a received image is not used.
#[derive(Debug, thiserror::Error)]
enum ImageFault {
    #[error(transparent)]
    Pixels(#[from] DecodeError),
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

impl ReceivedImage {
    /// The image without distortion, and what it sees. Distances that cannot be used leave the floor flat.
    fn read(self) -> Result<ReadFrame, ImageFault> {
        let image = self.picture.into_rgb(self.bits)?;
        let Some(geometry) = self.geometry else { return Ok(ReadFrame { image, view: None, unusable_depth: None }) };
        let camera = geometry.calibration.camera();
        let read = self.depth.map(|(message, units_per_m)| message.read(&camera, image.dimensions(), units_per_m));
        let (depth, unusable_depth) = match read {
            Some(Ok(depth)) => (Some(depth), None),
            Some(Err(error)) => (None, Some(error)),
            None => (None, None),
        };
        let (image, view) = geometry.view(image, depth)?;
        Ok(ReadFrame { image, view: Some(view), unusable_depth })
    }
}

impl From<RecordedFrame> for CameraFrame {
    fn from(frame: RecordedFrame) -> Self {
        let RecordedFrame { t_s, x_m, y_m, depth_m, heading_rad, scale, .. } = frame;
        let pose = SensorPose { x_m, y_m, depth_m, heading_rad, ..SensorPose::default() };
        Self { t_s, picture: FramePicture::Recorded(Box::new(frame)), pose, scale }
    }
}

/// The frames of the camera, each at its time.
pub(crate) enum Camera {
    Recorded(Box<RecordedCamera>),
    Live(Box<LiveCamera>),
}

/// Mission time that is assumed to pass between two runs of a live camera, seconds: the time since the end of the former run
/// is unknown.
const RESTART_S: f64 = 2.0;

impl Camera {
    /// Starts the configured camera after the last frame of an earlier run, if there was one.
    pub(crate) fn start(
        config: &Config,
        recording: Option<Recording>,
        sensors: &RosSensors,
        clock: Clock,
        last_s: Option<f64>,
    ) -> Result<Self, UserError> {
        // Without a camera, poses of a navigation source move the vehicle.
        let is_live = config.camera.source.is_live() || recording.is_none() && config.navigation.source.is_live();
        if !is_live {
            return Ok(Self::Recorded(Box::new(RecordedCamera::new(recording, clock, last_s))));
        }
        let start_s = last_s.map_or(0.0, |s| s + RESTART_S);
        Ok(Self::Live(Box::new(LiveCamera::start(config, start_s, sensors)?)))
    }

    /// Waits until [`Self::poll_frame`] may have a frame. Cancel-safe.
    pub(crate) async fn wait(&mut self) {
        match self {
            Self::Recorded(camera) => camera.wait().await,
            Self::Live(camera) => camera.wait().await,
        }
    }

    /// The next frame that is due. A live camera gives none while `mapping` frames wait for the scene model already, so that
    /// the newest one comes next.
    pub(crate) fn poll_frame(&mut self, mapping: u32) -> Option<CameraFrame> {
        match self {
            Self::Recorded(camera) => camera.poll_frame(),
            Self::Live(camera) => camera.poll_frame(mapping),
        }
    }

    /// Whether a recording has ended.
    pub(crate) fn is_over(&self) -> bool {
        match self {
            Self::Recorded(camera) => camera.is_over(),
            Self::Live(_) => false,
        }
    }

    /// Takes the last pose of the autopilot, new or not, for the images of a live camera.
    pub(crate) fn handle_pose(&mut self, pose: MeasuredPose) {
        if let Self::Live(camera) = self {
            camera.handle_pose(pose);
        }
    }

    /// The newest pose of a navigation source that is not the autopilot, once.
    pub(crate) fn poll_pose(&mut self) -> Option<CameraPose> {
        match self {
            Self::Recorded(_) => None,
            Self::Live(camera) => camera.poll_pose(),
        }
    }

    /// Time since the last call in which the navigation source gave no pose; `None` while it gives them, or if the autopilot or
    /// a recording gives the poses.
    pub(crate) fn poll_pose_gap(&mut self) -> Option<Duration> {
        match self {
            Self::Recorded(_) => None,
            Self::Live(camera) => camera.poll_pose_gap(),
        }
    }

    pub(crate) fn is_live(&self) -> bool {
        matches!(self, Self::Live(_))
    }

    /// The frame of a live camera that was polled last is not mapped, as the vehicle comes up.
    pub(crate) fn drop_rising(&mut self) {
        if let Self::Live(camera) = self {
            camera.drop_rising();
        }
    }

    /// The frame of a recording that was polled last only moves the vehicle.
    pub(crate) fn leave_unmapped(&mut self) {
        if let Self::Recorded(camera) = self {
            camera.leave_unmapped();
        }
    }

    /// A frame cannot be read, or the scene model does not take it.
    pub(crate) fn handle_missed(&mut self, error: &UserError) {
        match self {
            Self::Recorded(camera) => camera.handle_missed(error),
            Self::Live(camera) => camera.handle_missed(error),
        }
    }

    /// Whether a live camera is lost or has stalled.
    pub(crate) fn is_silent(&self) -> bool {
        match self {
            Self::Recorded(_) => false,
            Self::Live(camera) => camera.is_silent(),
        }
    }

    /// The newest pose of a navigation source that is not the autopilot.
    pub(crate) fn newest_pose(&self) -> Option<CameraPose> {
        match self {
            Self::Recorded(_) => None,
            Self::Live(camera) => camera.newest_pose(),
        }
    }

    /// Logs the account of a live camera at the end of the run.
    pub(crate) fn log_end(&self) {
        if let Self::Live(camera) = self {
            camera.log_end();
        }
    }

    /// What became of the images.
    pub(crate) fn tally(&self) -> Option<&CameraTally> {
        match self {
            Self::Recorded(camera) => camera.tally(),
            Self::Live(camera) => Some(camera.tally()),
        }
    }

    /// Counts distances that could not be used.
    pub(crate) fn handle_unusable_depth(&mut self, error: &DepthError) {
        if let Self::Live(camera) = self {
            camera.handle_unusable_depth(error);
        }
    }
}
