//! The process's node in ROS 2, in builds that have it.

#[cfg(feature = "ros2")]
pub(crate) use with::RosAccess;
#[cfg(not(feature = "ros2"))]
pub(crate) use without::RosAccess;

use scenecast_config::{CameraSource, Config, NavigationSource};

/// Whether a sensor is a topic of ROS 2.
fn is_needed(config: &Config) -> bool {
    matches!(config.camera.source, CameraSource::Ros2(_))
        || matches!(config.navigation.source, NavigationSource::Ros2(_))
}

#[cfg(feature = "ros2")]
mod with {
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_ros2::RosNode;
    use scenecast_sources::{ArrivalClock, LiveSource, RosCamera, RosNavigation};
    use std::sync::Arc;
    use std::time::Duration;

    /// The node, if the settings need one.
    pub(crate) struct RosAccess(Option<Arc<RosNode>>);

    impl RosAccess {
        pub(crate) fn start(config: &Config) -> Result<Self, UserError> {
            let name = format!("scenecast_{}", config.vehicle.address);
            Ok(Self(super::is_needed(config).then(|| RosNode::start(&config.ros2, &name)).transpose()?.map(Arc::new)))
        }

        fn node(&self) -> Result<Arc<RosNode>, UserError> {
            self.0.clone().ok_or_else(|| UserError::Failed("ROS 2 is not started".to_owned()))
        }

        pub(crate) fn camera(
            &self,
            topic: &str,
            clock: ArrivalClock,
            needs_stamps: bool,
            stall: Duration,
        ) -> Result<std::io::Result<LiveSource>, UserError> {
            Ok(LiveSource::start(RosCamera::new(self.node()?, topic, clock, needs_stamps), stall))
        }

        pub(crate) fn navigation(
            &self,
            topic: &str,
            stall: Duration,
        ) -> Result<std::io::Result<LiveSource>, UserError> {
            Ok(LiveSource::start(RosNavigation::new(self.node()?, topic), stall))
        }
    }
}

#[cfg(not(feature = "ros2"))]
mod without {
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_sources::{ArrivalClock, LiveSource};
    use std::time::Duration;

    /// No node: this build has no ROS 2.
    pub(crate) struct RosAccess;

    fn refused<T>() -> Result<T, UserError> {
        Err(UserError::Input("ros2:TOPIC is not allowed: this build has no ROS 2 (feature ros2)".to_owned()))
    }

    impl RosAccess {
        pub(crate) fn start(config: &Config) -> Result<Self, UserError> {
            if super::is_needed(config) { refused() } else { Ok(Self) }
        }

        pub(crate) fn camera(
            &self,
            _: &str,
            _: ArrivalClock,
            _: bool,
            _: Duration,
        ) -> Result<std::io::Result<LiveSource>, UserError> {
            refused()
        }

        pub(crate) fn navigation(&self, _: &str, _: Duration) -> Result<std::io::Result<LiveSource>, UserError> {
            refused()
        }
    }
}
