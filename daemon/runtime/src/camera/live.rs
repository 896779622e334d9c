//! A live camera: its images wait for their poses, and the newest ones go to the scene model.

use super::fault_log::FaultReports;
use super::pose_feed::{DepthAnswer, DepthFeed, PoseFeed};
use super::{CameraFrame, FramePicture, ReceivedImage};
use crate::ros2::RosSensors;
use scenecast_config::{CameraSource, CameraStamps, Config, NavigationSource};
use scenecast_core::UserError;
use scenecast_files::{configured_calibration, configured_mounting};
use scenecast_host::{CameraPose, MeasuredPose};
use scenecast_sensors::{
    BitDepth, Calibration, CameraFault, CameraMounting, CameraTally, DepthError, FrameMatcher, Limits, MatchedImage,
    Stamp, ViewGeometry,
};
use scenecast_sources::{
    ArrivalClock, CommandSource, DvlSource, LiveSource, Picture, Reading, SensorKind, SourceImage, SourceReport,
    WatchSource, read_tum_poses,
};
use std::sync::Arc;
use std::time::Duration;

/// Frames that may wait for the scene model; further ones stay with the matcher, which drops the oldest.
const MAX_MAPPING: u32 = 2;

/// Smallest and largest size of pixels, and height of a calibrated camera, that a measured altitude gives, in configured ones.
const SCALES: (f64, f64) = (0.1, 10.0);

/// An image that waits, and its calibration.
type LiveImage = (Picture, Option<Arc<Calibration>>);

/// A camera whose images come in while the vehicle dives.
pub(crate) struct LiveCamera {
    /// The source of the images; without it the poses only move the vehicle.
    source: Option<LiveSource>,
    poses: PoseFeed,
    depth: DepthFeed,
    matcher: FrameMatcher<LiveImage>,
    /// An image with its pose that waits for its distances, and since when.
    pending: Option<(MatchedImage<LiveImage>, Stamp)>,
    clock: ArrivalClock,
    times: ImageTimes,
    /// The bits of levels in compressed images with 16.
    bits: BitDepth,
    /// The calibration by the settings.
    calibration: Option<Arc<Calibration>>,
    mounting: CameraMounting,
    /// Height of the camera at which its pixels have the configured size, metres.
    altitude_m: f64,
    faults: FaultReports,
    /// Whether the scene model has frames enough, so that images wait for it.
    is_model_busy: bool,
}

/// How the times of images and distances follow from their stamps and arrivals.
struct ImageTimes {
    stamps: CameraStamps,
    delay: Duration,
    /// Added to the times that images give, seconds.
    clock_offset_s: f64,
}

impl ImageTimes {
    fn of(&self, stamp: Option<Stamp>, arrival: Stamp) -> Stamp {
        let own = stamp.filter(|_| self.stamps == CameraStamps::Own);
        own.map_or_else(|| arrival.before(self.delay), |stamp| stamp.shifted(self.clock_offset_s))
    }
}

impl LiveCamera {
    /// Starts the configured live camera, if there is one, and the source of its poses; the first frame has the mission
    /// time `start_s`.
    pub(crate) fn start(config: &Config, start_s: f64, ros: &RosSensors) -> Result<Self, UserError> {
        let clock = ArrivalClock::start();
        let c = &config.camera;
        let stall = Duration::from_secs_f64(c.timeout_s);
        let source = match &c.source {
            CameraSource::Rehearsal => None,
            CameraSource::Watch(dir) => Some(LiveSource::start(WatchSource::new(dir, clock), stall)),
            CameraSource::Command(command) => Some(LiveSource::start(CommandSource::new(command, clock), stall)),
            CameraSource::V4l2(device) => Some(LiveSource::start(CommandSource::of_device(device, clock), stall)),
            CameraSource::Ros2(topic) => Some(ros.camera(topic, clock, config)),
            other => return Err(UserError::Input(format!("camera.source: {other:?} is not a live camera"))),
        };
        let failed = |e: std::io::Error| UserError::Failed(format!("a sensor's thread did not start: {e}"));
        let source = source.transpose().map_err(failed)?;
        let max_gap = Duration::from_secs_f64(config.navigation.max_gap_s);
        let mut matcher = FrameMatcher::new(Limits { max_gap, ..Limits::default() }, start_s);
        let nav_stall = Duration::from_secs_f64(config.navigation.timeout_s);
        let navigation = match &config.navigation.source {
            NavigationSource::Autopilot => None,
            NavigationSource::Tum(file) => {
                matcher.set_poses(read_tum_poses(file)?);
                None
            }
            NavigationSource::Ros2(topic) => Some(ros.navigation(topic, nav_stall).map_err(failed)?),
            source @ NavigationSource::Tf(_) => {
                let frames = source.frames().unwrap_or_default();
                Some(ros.transforms(frames, nav_stall).map_err(failed)?)
            }
            NavigationSource::Dvl(address) => {
                let dvl = DvlSource::new(address, config.navigation.dvl_heading_deg.to_radians(), clock);
                Some(LiveSource::start(dvl, nav_stall).map_err(failed)?)
            }
        };
        let depth = ros.depth(clock, config).map_err(failed)?;
        Ok(Self {
            source,
            poses: PoseFeed::new(config, navigation, &clock),
            depth: DepthFeed::new(depth, c.depth_units_per_m),
            matcher,
            pending: None,
            clock,
            times: ImageTimes {
                stamps: c.stamps,
                delay: Duration::from_secs_f64(c.delay_s),
                clock_offset_s: c.clock_offset_s,
            },
            bits: BitDepth::of_setting(c.bits),
            calibration: configured_calibration(config)?,
            mounting: configured_mounting(config),
            altitude_m: config.survey.altitude_m,
            faults: FaultReports::default(),
            is_model_busy: false,
        })
    }

    /// Waits for a report of the source, or until an image has waited too long for its pose or its distances. Cancel-safe.
    pub(super) async fn wait(&mut self) {
        let pending = self.pending.as_ref().map(|(_, since)| DepthFeed::due(*since));
        // While the scene model is busy, its next report wakes the vehicle.
        let timeout = pending.or(self.matcher.poll_timeout()).filter(|_| !self.is_model_busy);
        let timeout = timeout.map(|at| tokio::time::Instant::from_std(self.clock.instant(at)));
        let overdue = async {
            match timeout {
                Some(at) => tokio::time::sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            report = LiveSource::next_of(&mut self.source) => self.handle_report(SensorKind::Camera, report),
            report = self.depth.next() => self.handle_report(SensorKind::Depth, report),
            report = self.poses.next() => self.handle_report(SensorKind::Navigation, report),
            () = overdue => {}
        }
    }

    fn handle_report(&mut self, of: SensorKind, report: SourceReport) {
        match report {
            SourceReport::Open => match of {
                SensorKind::Camera | SensorKind::Depth => tracing::debug!("camera: open"),
                SensorKind::Navigation => tracing::info!("navigation: open"),
            },
            SourceReport::Reading(Reading::Image(image)) => self.handle_image(image),
            SourceReport::Reading(Reading::Pose(stamp, pose)) => {
                let (pose, jumps) = self.poses.handle_pose(stamp, pose, self.clock.now());
                if let Some(pose) = pose {
                    self.matcher.handle_pose(stamp, self.clock.now(), pose);
                }
                for jump in jumps {
                    self.matcher.count(CameraFault::PoseJump);
                    jump.note.into_iter().for_each(|note| self.faults.handle_fault(CameraFault::PoseJump, note));
                }
            }
            SourceReport::Reading(Reading::Depth(depth)) => {
                let pending = self.pending.as_ref().map(|(image, _)| image.stamp);
                let images = pending.into_iter().chain(self.matcher.waiting());
                self.depth.handle_depth(self.times.of(depth.stamp, depth.arrival), depth.message, images);
            }
            SourceReport::Fault(fault, text) => {
                self.matcher.count(fault);
                self.faults.handle_fault(fault, text);
            }
        }
        self.faults.log(&self.matcher);
    }

    fn handle_image(&mut self, image: SourceImage) {
        self.faults.handle_image();
        let stamp = self.times.of(image.stamp, image.arrival);
        self.matcher.handle_image(stamp, image.arrival, (image.picture, image.calibration));
    }

    pub(super) fn handle_pose(&mut self, measured: MeasuredPose) {
        if let Some(pose) = self.poses.of_autopilot(measured) {
            let now = self.clock.now();
            self.matcher.handle_pose(now, now, pose);
        }
    }

    pub(super) fn poll_pose(&mut self) -> Option<CameraPose> {
        self.poses.poll_pose()
    }

    /// Time since the last call in which the navigation source gave no pose; `None` while it gives them.
    pub(super) fn poll_pose_gap(&mut self) -> Option<Duration> {
        self.poses.poll_gap(self.clock.now())
    }

    /// Whether the camera is lost or has stalled.
    pub(super) fn is_silent(&self) -> bool {
        self.faults.is_silent()
    }

    pub(super) fn newest_pose(&self) -> Option<CameraPose> {
        self.poses.newest()
    }

    pub(super) fn tally(&self) -> &CameraTally {
        self.matcher.tally()
    }

    /// Counts an image that could not be read, or has another size than its calibration.
    pub(crate) fn handle_missed(&mut self, error: &UserError) {
        self.matcher.drop_matched(CameraFault::Unreadable);
        self.faults.handle_fault(CameraFault::Unreadable, error.to_string());
        self.faults.log(&self.matcher);
    }

    /// The frame that was polled last is not mapped, as the vehicle comes up.
    pub(super) fn drop_rising(&mut self) {
        self.matcher.drop_matched(CameraFault::ComingUp);
    }

    pub(super) fn handle_unusable_depth(&mut self, error: &DepthError) {
        self.matcher.count(CameraFault::UnusableDepth);
        self.faults.handle_fault(CameraFault::UnusableDepth, error.to_string());
        self.faults.log(&self.matcher);
    }

    pub(super) fn poll_frame(&mut self, mapping: u32) -> Option<CameraFrame> {
        self.is_model_busy = mapping >= MAX_MAPPING;
        let frame = if self.is_model_busy { None } else { self.next_frame() };
        if let Some(frame) = &frame {
            tracing::debug!("camera: the image of {:.3} s goes to the scene model", frame.t_s);
            self.faults.handle_matched();
        }
        self.faults.log(&self.matcher);
        frame
    }

    /// The next image that was taken near enough to straight down, at the pose of the camera.
    fn next_frame(&mut self) -> Option<CameraFrame> {
        let now = self.clock.now();
        loop {
            let (image, since) = match self.pending.take() {
                Some(pending) => pending,
                None => {
                    self.matcher.keep_recent(now);
                    (self.matcher.poll_frame(now)?, now)
                }
            };
            let Some(answer) = self.depth.poll(image.stamp, since, now) else {
                self.pending = Some((image, since));
                return None;
            };
            match self.frame(image, answer) {
                Some(frame) => return Some(frame),
                None => self.matcher.drop_matched(CameraFault::Tilted),
            }
        }
    }

    /// The frame of an image; `None` if it is tilted too much.
    fn frame(&mut self, matched: MatchedImage<LiveImage>, answer: DepthAnswer) -> Option<CameraFrame> {
        let MatchedImage { image: (picture, own), t_s, pose, .. } = matched;
        let Some(calibration) = self.calibration.clone().or(own) else {
            if answer != DepthAnswer::Unmeasured {
                self.count_missing_depth("the camera has no calibration, by which distances would be placed");
            }
            let pose = self.mounting.camera_pose(&pose, self.altitude_m)?;
            // A pixel's size on the floor grows with the height.
            let scale = pose.altitude_m.map_or(1.0, |height| (height / self.altitude_m).clamp(SCALES.0, SCALES.1));
            let received = ReceivedImage { picture, bits: self.bits, geometry: None, depth: None };
            return Some(CameraFrame { t_s, picture: FramePicture::Received(Box::new(received)), pose, scale });
        };
        let camera = self.mounting.mounted_camera(&pose, self.altitude_m)?;
        let depth = match answer {
            DepthAnswer::Measured(message, units_per_m) => Some((message, units_per_m)),
            DepthAnswer::Unmeasured => None,
            DepthAnswer::Missing => {
                self.count_missing_depth("the image is mapped on a flat floor");
                None
            }
        };
        let height_m = camera.height_m.clamp(SCALES.0 * self.altitude_m, SCALES.1 * self.altitude_m);
        let geometry = Some(ViewGeometry { calibration, tilt: camera.tilt, height_m });
        let received = ReceivedImage { picture, bits: self.bits, geometry, depth };
        let picture = FramePicture::Received(Box::new(received));
        Some(CameraFrame { t_s, picture, pose: camera.pose, scale: 1.0 })
    }

    fn count_missing_depth(&mut self, text: &str) {
        self.matcher.count(CameraFault::NoDepth);
        self.faults.handle_fault(CameraFault::NoDepth, text.to_owned());
    }

    /// Logs the account of the run.
    pub(super) fn log_end(&self) {
        tracing::info!("camera: {}", self.matcher.tally());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::sync::Mutex;

    #[derive(Clone, Default)]
    struct Logged(Arc<Mutex<Vec<u8>>>);

    impl Write for Logged {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn images_that_do_not_fit_their_calibration_are_logged_rarely() {
        let config = Config::default();
        let ros = RosSensors::new(&config).unwrap();
        let mut camera = LiveCamera::start(&config, 0.0, &ros).unwrap();
        let logged = Logged::default();
        let writer = logged.clone();
        let subscriber = tracing_subscriber::fmt().with_writer(move || writer.clone()).with_ansi(false).finish();
        tracing::subscriber::with_default(subscriber, || {
            let error = UserError::Input("the image has 640 x 480 pixels, its calibration 320 x 240".to_owned());
            (0..100).for_each(|_| camera.handle_missed(&error));
        });
        let text = String::from_utf8(logged.0.lock().unwrap().clone()).unwrap();
        assert_eq!(text.lines().count(), 1, "{text}");
        assert!(
            text.contains("dropped, unreadable (1 so far): the image has 640 x 480 pixels, its calibration 320 x 240")
        );
        assert_eq!(camera.tally().of(CameraFault::Unreadable), 100);
    }
}
