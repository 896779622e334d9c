//! ROS 2 beside the loops of vehicle and surface; in builds without the feature `ros2` there is none.

use scenecast_config::{Config, RosTransport};
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
/// It is on, and this build has none, or not the transport that is set.
fn is_enabled(config: &Config) -> Result<bool, UserError> {
    if config.ros2.enabled && !cfg!(feature = "ros2") {
        let text = "ros2.enabled = true: this build has no ROS 2; build it with the feature ros2, or set it to false";
        return Err(UserError::Input(text.to_owned()));
    }
    check_transport(config)?;
    Ok(config.ros2.enabled)
}

/// # Errors
///
/// The transport needs rmw_zenoh, and this build has none.
fn check_transport(config: &Config) -> Result<(), UserError> {
    let transport = config.ros2.transport;
    if transport == RosTransport::Dds || cfg!(feature = "zenoh") {
        return Ok(());
    }
    let text = "this build has no rmw_zenoh; build it with the feature zenoh, or set it to \"dds\"";
    Err(UserError::Input(format!("ros2.transport = \"{transport}\": {text}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_build_without_zenoh_names_the_feature_that_it_needs() {
        let load = |value: &str| scenecast_config::load(None, &[format!("ros2.transport={value}")]).unwrap();
        assert!(check_transport(&load("dds")).is_ok());
        for value in ["zenoh", "both"] {
            let refused = check_transport(&load(value)).err().map(|error| error.to_string());
            assert_eq!(refused.is_none(), cfg!(feature = "zenoh"), "{value}");
            assert!(refused.is_none_or(|text| text.contains("the feature zenoh")));
        }
    }
}
