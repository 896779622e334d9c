//! Camera images and poses of a live vehicle, from the bytes of a source to the frame that is mapped.
//!
//! | step | type |
//! |---|---|
//! | images are cut out of a stream of bytes | [`ImageStream`] |
//! | raw pixels of ROS 2 become RGB | [`RawImage`] |
//! | compressed images become RGB, and say when they were taken | [`decode`], [`own_stamp`] |
//! | quaternions become headings and tilts | [`Rotation`] |
//! | messages of ROS 2 become images and poses | [`rgb_of`], [`pose_of`] |
//! | transforms of ROS 2 become poses | [`TransformTree`] |
//! | calibrations remove the distortion of the lens | [`Calibration`] |
//! | depth images and clouds become distances, and wait for their images | [`DepthMessage`], [`DepthTrack`] |
//! | lines of a Doppler velocity log become poses | [`DvlReport`], [`DvlTrack`] |
//! | poses are interpolated at the time of an image | [`PoseTrack`] |
//! | the pose of a vehicle becomes that of its camera | [`CameraMounting`] |
//! | images wait for their poses, and are dropped with a reason | [`FrameMatcher`] |
//!
//! The crate does no IO: bytes and times of arrival come in as arguments.

mod calibration;
mod calibration_file;
mod camera_tally;
mod compressed;
mod depth;
mod depth_track;
mod dvl;
mod exif;
mod frame_matcher;
mod image_size;
mod image_stream;
mod lens;
mod pose_track;
mod raw_image;
mod rotation;
mod stamp;
mod tiff_pages;
mod transforms;
mod view_geometry;

pub use crate::depth::DepthError;
pub use crate::pose_track::{Times, reachable};
pub use crate::view_geometry::{CameraMounting, MountedCamera, ViewGeometry, tilt_of};
pub use calibration::{Calibration, CalibrationError};
pub use calibration_file::{CalibrationFileError, camera_info_beside, read_calibration};
pub use camera_tally::{CameraFault, CameraTally};
pub use compressed::{DecodeError, decode, decode_upright, own_stamp};
pub use depth::DepthMessage;
pub use depth_track::{DepthMatch, DepthTrack};
pub use dvl::{DvlError, DvlPosition, DvlReport, DvlTrack, MAX_DVL_LINE};
pub use frame_matcher::{FrameMatcher, Limits, MatchedImage};
pub use image_size::{ImageSize, MAX_PIXELS, OtherSize};
pub use image_stream::{ImageStream, MAX_IMAGE_BYTES, complete_length, is_known_image};
pub use lens::LensError;
pub use pose_track::{PoseMatch, PoseTrack, SensorPose};
pub use raw_image::{BitDepth, RawImage, RawImageError};
pub use rotation::Rotation;
pub use stamp::{Stamp, StampForm};
pub use tiff_pages::{geotiff_scale_m, unread_emptiness};
pub use transforms::{TransformError, TransformTree, pose_of, rgb_of, stamp_of, stamp_of_cdr};
