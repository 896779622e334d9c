//! ROS 2 beside the loops of vehicle and surface; in builds without the feature `ros2` there is none.

use scenecast_config::Config;
use scenecast_core::UserError;

mod sensors;
#[cfg(feature = "surface")]
mod surface;
mod vehicle;

pub(crate) use sensors::RosSensors;
#[cfg(feature = "surface")]
pub(crate) use surface::SurfaceRos2;
pub(crate) use vehicle::VehicleRos2;

/// Whether ROS 2 is switched on.
///
/// # Errors
///
/// It is on, and this build has none.
fn is_enabled(config: &Config) -> Result<bool, UserError> {
    if config.ros2.enabled && !cfg!(feature = "ros2") {
        let text = "ros2.enabled = true: this build has no ROS 2; build it with the feature ros2, or set it to false";
        return Err(UserError::Input(text.to_owned()));
    }
    Ok(config.ros2.enabled)
}
