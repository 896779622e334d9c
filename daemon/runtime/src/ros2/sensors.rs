//! The vehicle's camera and navigation as topics of ROS 2.

#[cfg(feature = "ros2")]
pub(crate) use with::RosSensors;
#[cfg(not(feature = "ros2"))]
pub(crate) use without::RosSensors;

#[cfg(feature = "ros2")]
mod with {
    use crate::labels::{Feed, TopicFeed, topic};
    use scenecast_config::Config;
    use scenecast_core::UserError;
    use scenecast_sources::{ArrivalClock, LiveSource, RosCamera, RosNavigation, RosTransforms, SensorNode};
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

        /// A feed of labels or bands.
        pub(crate) fn labels(&self, wanted: TopicFeed) -> Result<Feed, UserError> {
            topic(self.0.clone(), wanted)
        }

        pub(crate) fn navigation(&self, topic: &str, stall: Duration) -> std::io::Result<LiveSource> {
            LiveSource::start(RosNavigation::new(self.0.clone(), topic), stall)
        }

        pub(crate) fn transforms(&self, frames: (&str, &str), stall: Duration) -> std::io::Result<LiveSource> {
            LiveSource::start(RosTransforms::new(self.0.clone(), frames), stall)
        }
    }
}

#[cfg(not(feature = "ros2"))]
mod without {
    use crate::labels::{Feed, TopicFeed};
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
                || matches!(config.navigation.source, NavigationSource::Ros2(_) | NavigationSource::Tf(_))
                || [&config.labels.source, &config.bands.source].iter().any(|s| matches!(s, LabelSource::Ros2(..)));
            if is_topic {
                let text = "a source of ROS 2 is not allowed: this build has no ROS 2; build it with the feature ros2";
                return Err(UserError::Input(text.to_owned()));
            }
            Ok(Self)
        }

        pub(crate) fn camera(&self, _: &str, _: ArrivalClock, _: bool, _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }

        pub(crate) fn labels(&self, wanted: TopicFeed) -> std::result::Result<Feed, UserError> {
            Err(UserError::Input(format!("{}: this build has no ROS 2", wanted.topic)))
        }

        pub(crate) fn navigation(&self, _: &str, _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }

        pub(crate) fn transforms(&self, _: (&str, &str), _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }
    }
}
