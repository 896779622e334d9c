//! The vehicle's camera and navigation as topics of ROS 2.

#[cfg(feature = "ros2")]
pub(crate) use with::RosSensors;
#[cfg(not(feature = "ros2"))]
pub(crate) use without::RosSensors;

#[cfg(feature = "ros2")]
mod with {
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_sources::{ArrivalClock, LiveSource, RosCamera, RosNavigation, SensorNode};
    use std::sync::Arc;
    use std::time::Duration;

    /// The node of the sensors, which starts with the first of them.
    pub(crate) struct RosSensors(Arc<SensorNode>);

    impl RosSensors {
        #[expect(clippy::unnecessary_wraps, reason = "a build without ROS 2 refuses topics")]
        pub(crate) fn new(config: &Config) -> Result<Self, UserError> {
            Ok(Self(Arc::new(SensorNode::new(&config.ros2))))
        }

        pub(crate) fn camera(
            &self,
            topic: &str,
            clock: ArrivalClock,
            needs_stamps: bool,
            stall: Duration,
        ) -> std::io::Result<LiveSource> {
            LiveSource::start(RosCamera::new(self.0.clone(), topic, clock, needs_stamps), stall)
        }

        /// The node, for other topics.
        pub(crate) fn node(&self) -> Arc<SensorNode> {
            self.0.clone()
        }

        pub(crate) fn navigation(&self, topic: &str, stall: Duration) -> std::io::Result<LiveSource> {
            LiveSource::start(RosNavigation::new(self.0.clone(), topic), stall)
        }
    }
}

#[cfg(not(feature = "ros2"))]
mod without {
    use scenecast_config::{CameraSource, Config, LabelSource, NavigationSource};
    use scenecast_core::UserError;
    use scenecast_sources::{ArrivalClock, LiveSource};
    use std::io::{Error, ErrorKind, Result};
    use std::time::Duration;

    /// This build has no ROS 2.
    pub(crate) struct RosSensors;

    impl RosSensors {
        pub(crate) fn new(config: &Config) -> std::result::Result<Self, UserError> {
            let is_topic = matches!(config.camera.source, CameraSource::Ros2(_))
                || matches!(config.navigation.source, NavigationSource::Ros2(_))
                || [&config.labels.source, &config.bands.source].iter().any(|s| matches!(s, LabelSource::Ros2(..)));
            if is_topic {
                let text = "ros2:TOPIC is not allowed: this build has no ROS 2; build it with the feature ros2";
                return Err(UserError::Input(text.to_owned()));
            }
            Ok(Self)
        }

        pub(crate) fn camera(&self, _: &str, _: ArrivalClock, _: bool, _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }

        pub(crate) fn navigation(&self, _: &str, _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }
    }
}
