//! Live cameras and navigation sensors, each on a thread of its own.
//!
//! A [`SensorSource`] waits for the readings of a sensor. [`LiveSource`] opens it, opens it again with back-off when it is lost,
//! and reports readings and faults to the vehicle. Which image is mapped at which pose is decided by
//! [`scenecast_sensors::FrameMatcher`].

mod command;
mod dvl;
mod live;
#[cfg(feature = "ros2")]
mod ros_calibration;
#[cfg(feature = "ros2")]
mod ros_camera;
#[cfg(feature = "ros2")]
mod ros_node;
#[cfg(feature = "ros2")]
mod ros_transforms;
mod tum_poses;
mod watch;

pub use command::CommandSource;
pub use dvl::DvlSource;
pub use live::{
    ArrivalClock, LiveSource, Picture, Reading, SensorKind, SensorSource, SourceDepth, SourceError, SourceImage,
    SourceReport,
};
#[cfg(feature = "ros2")]
pub use ros_calibration::CalibrationTopic;
#[cfg(feature = "ros2")]
pub use ros_camera::{RosCamera, RosCameraOptions, RosDepth};
#[cfg(feature = "ros2")]
pub use ros_node::SensorNode;
#[cfg(feature = "ros2")]
pub use ros_transforms::{RosNavigation, RosTransforms};
pub use tum_poses::read_tum_poses;
pub use watch::WatchSource;
