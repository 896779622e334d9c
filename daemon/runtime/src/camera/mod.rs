//! The camera of a vehicle: a recording, or a live camera whose images are matched with poses.

mod fault_log;
mod live;
mod recorded;

pub(crate) use live::LiveCamera;
pub(crate) use recorded::RecordedCamera;

use image::RgbImage;
use scenecast_core::UserError;
use scenecast_files::{FrameImage, RecordedFrame};
use scenecast_host::{CameraPose, MeasuredPose};
use scenecast_sensors::{CameraTally, SensorPose};
use scenecast_sources::Picture;
use std::time::Duration;

/// An image and where it was taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraFrame {
    /// Mission time, seconds.
    pub(crate) t_s: f64,
    pub(crate) picture: FramePicture,
    pub(crate) pose: SensorPose,
    /// Size of the image's pixels on the sea floor, in those of the camera's usual ones.
    pub(crate) scale: f64,
}

/// The pixels of a frame, which are read where the frame is mapped.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum FramePicture {
    Recorded(FrameImage),
    Received(Picture),
    /// It was read.
    Taken,
}

impl CameraFrame {
    /// The image, and the frame without its pixels.
    pub(crate) fn take_image(&mut self) -> Result<RgbImage, UserError> {
        match std::mem::replace(&mut self.picture, FramePicture::Taken) {
            FramePicture::Recorded(image) => image.read(),
            FramePicture::Received(picture) => {
                picture.into_rgb().map_err(|error| UserError::Input(format!("the image at {:.1} s: {error}", self.t_s)))
            }
            FramePicture::Taken => Err(UserError::Failed("the image was already read".to_owned())),
        }
    }

    pub(crate) fn camera_pose(&self) -> CameraPose {
        let SensorPose { x_m, y_m, heading_rad, depth_m, .. } = self.pose;
        CameraPose { x_m, y_m, heading_rad, depth_m }
    }
}

impl From<RecordedFrame> for CameraFrame {
    fn from(frame: RecordedFrame) -> Self {
        let RecordedFrame { t_s, image, x_m, y_m, depth_m, heading_rad, scale } = frame;
        let pose = SensorPose { x_m, y_m, depth_m, heading_rad, ..SensorPose::default() };
        Self { t_s, picture: FramePicture::Recorded(image), pose, scale }
    }
}

/// The frames of the camera, each at its time.
pub(crate) enum Camera {
    Recorded(RecordedCamera),
    Live(Box<LiveCamera>),
}

impl Camera {
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

    /// The run ends.
    pub(crate) fn log_end(&self) {
        if let Self::Live(camera) = self {
            camera.log_end();
        }
    }

    /// What became of the images of a live camera.
    pub(crate) fn tally(&self) -> Option<&CameraTally> {
        match self {
            Self::Recorded(_) => None,
            Self::Live(camera) => Some(camera.tally()),
        }
    }

    /// Counts an image that could not be decoded.
    pub(crate) fn handle_missed(&mut self) {
        if let Self::Live(camera) = self {
            camera.handle_missed();
        }
    }
}
