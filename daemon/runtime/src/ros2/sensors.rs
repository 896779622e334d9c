//! The vehicle's camera and navigation as topics of ROS 2.

#[cfg(feature = "ros2")]
pub(crate) use with::RosSensors;
#[cfg(not(feature = "ros2"))]
pub(crate) use without::RosSensors;

#[cfg(feature = "ros2")]
mod with {
    use scenecast_config::{CalibrationSource, CameraStamps, Config, DepthSource};
    use scenecast_core::UserError;
    use scenecast_sensors::BitDepth;
    use scenecast_sources::{
        ArrivalClock, CalibrationTopic, LiveSource, RosCamera, RosCameraOptions, RosDepth, RosNavigation,
        RosTransforms, SensorNode,
    };
    use std::sync::Arc;
    use std::time::Duration;

    /// The node of the sensors, which starts with the first of them.
    pub(crate) struct RosSensors(Arc<SensorNode>);

    impl RosSensors {
        #[expect(clippy::unnecessary_wraps, reason = "a build without ROS 2 refuses topics")]
        pub(crate) fn new(config: &Config) -> Result<Self, UserError> {
            Ok(Self(Arc::new(SensorNode::new(&config.ros2))))
        }

        /// A camera with its calibration, unless the settings give one.
        pub(crate) fn camera(&self, topic: &str, clock: ArrivalClock, config: &Config) -> std::io::Result<LiveSource> {
            let c = &config.camera;
            let calibration = match &c.calibration {
                CalibrationSource::Ros2(topic) => CalibrationTopic::Named(topic.clone()),
                CalibrationSource::Beside if c.matrix == [0.0; 4] => CalibrationTopic::Beside,
                CalibrationSource::Beside | CalibrationSource::File(_) | CalibrationSource::None => {
                    CalibrationTopic::None
                }
            };
            let (needs_stamps, bits) = (c.stamps == CameraStamps::Own, BitDepth::of_setting(c.bits));
            let options = RosCameraOptions { needs_stamps, bits, calibration };
            let stall = Duration::from_secs_f64(c.timeout_s);
            LiveSource::start(RosCamera::new(self.0.clone(), topic, clock, &options), stall)
        }

        /// The distances of the camera's pixels, if something measures them.
        pub(crate) fn depth(&self, clock: ArrivalClock, config: &Config) -> std::io::Result<Option<LiveSource>> {
            let c = &config.camera;
            let (topic, is_cloud) = match &c.depth {
                DepthSource::None => return Ok(None),
                DepthSource::Ros2(topic) => (topic, false),
                DepthSource::Cloud(topic) => (topic, true),
            };
            let depth = RosDepth::new(self.0.clone(), topic, is_cloud, clock, c.stamps == CameraStamps::Own);
            LiveSource::start(depth, Duration::from_secs_f64(c.timeout_s)).map(Some)
        }

        /// The node, for other topics.
        pub(crate) fn node(&self) -> Arc<SensorNode> {
            self.0.clone()
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
    use scenecast_config::{CameraSource, Config, DepthSource, LabelSource, NavigationSource};
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
                || [&config.labels.source, &config.bands.source].iter().any(|s| matches!(s, LabelSource::Ros2(..)))
                || config.camera.depth != DepthSource::None;
            if is_topic {
                let text = "a source of ROS 2 is not allowed: this build has no ROS 2; build it with the feature ros2";
                return Err(UserError::Input(text.to_owned()));
            }
            Ok(Self)
        }

        pub(crate) fn camera(&self, _: &str, _: ArrivalClock, _: &Config) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }

        #[expect(clippy::unnecessary_wraps, reason = "a build with ROS 2 starts a thread")]
        pub(crate) fn depth(&self, _: ArrivalClock, _: &Config) -> Result<Option<LiveSource>> {
            Ok(None)
        }

        pub(crate) fn navigation(&self, _: &str, _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }

        pub(crate) fn transforms(&self, _: (&str, &str), _: Duration) -> Result<LiveSource> {
            Err(Error::from(ErrorKind::Unsupported))
        }
    }
}
