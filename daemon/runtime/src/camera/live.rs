//! A live camera: its images wait for their poses, and the newest ones go to the scene model.

use super::fault_log::FaultLog;
use super::{CameraFrame, FramePicture};
use crate::ros2::RosSensors;
use scenecast_config::{CameraSource, CameraStamps, Config, NavigationSource};
use scenecast_core::UserError;
use scenecast_files::configured_mounting;
use scenecast_host::{CameraPose, MeasuredPose};
use scenecast_protocol::time::Instant;
use scenecast_sensors::{
    CameraFault, CameraMounting, CameraTally, FrameMatcher, Limits, MatchedImage, SensorPose, Stamp,
};
use scenecast_sources::{
    ArrivalClock, CommandSource, DvlSource, LiveSource, Picture, Reading, SensorKind, SourceImage, SourceReport,
    WatchSource, read_tum_poses,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// Frames that may wait for the scene model; further ones stay with the matcher, which drops the oldest.
const MAX_MAPPING: u32 = 2;

/// Smallest and largest size of pixels that a measured altitude gives, in configured ones.
const SCALES: (f64, f64) = (0.1, 10.0);

/// A camera whose images come in while the vehicle dives.
pub(crate) struct LiveCamera {
    /// The source of the images; without it the poses only move the vehicle.
    source: Option<LiveSource>,
    /// The source of the poses, if it is not the autopilot or a file.
    navigation: Option<LiveSource>,
    matcher: FrameMatcher<Picture>,
    clock: ArrivalClock,
    stamps: CameraStamps,
    delay: Duration,
    /// Added to the times that images give, seconds.
    clock_offset_s: f64,
    has_own_poses: bool,
    mounting: CameraMounting,
    /// Height of the camera at which its pixels have the configured size, metres.
    altitude_m: f64,
    /// Time of the autopilot's last pose.
    measured_at: Option<Instant>,
    /// The newest pose of the navigation source.
    newest_pose: Option<CameraPose>,
    /// Arrival of the newest pose, or the start of the run; and the time up to which the vehicle knows of its absence.
    posed: (Stamp, Stamp),
    /// Longest time between two poses.
    max_gap: Duration,
    /// Whether the vehicle does not know the newest pose yet.
    is_pose_new: bool,
    log: FaultLog,
    /// The last text about each kind of fault.
    texts: BTreeMap<CameraFault, String>,
    /// Whether the camera was lost or has stalled since its last image.
    is_lost: bool,
    was_matched: bool,
    /// Whether the scene model has frames enough, so that images wait for it.
    is_model_busy: bool,
}

/// The next report of a source; without one it never returns.
async fn next_of(source: &mut Option<LiveSource>) -> SourceReport {
    match source {
        Some(source) => source.next().await,
        None => std::future::pending().await,
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
            CameraSource::Ros2(topic) => Some(ros.camera(topic, clock, c.stamps == CameraStamps::Own, stall)),
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
        Ok(Self {
            source,
            navigation,
            matcher,
            clock,
            stamps: c.stamps,
            delay: Duration::from_secs_f64(c.delay_s),
            clock_offset_s: c.clock_offset_s,
            has_own_poses: config.navigation.source != NavigationSource::Autopilot,
            mounting: configured_mounting(config),
            altitude_m: config.survey.altitude_m,
            measured_at: None,
            newest_pose: None,
            posed: (clock.now(), clock.now()),
            max_gap,
            is_pose_new: false,
            log: FaultLog::default(),
            texts: BTreeMap::new(),
            is_lost: false,
            was_matched: false,
            is_model_busy: false,
        })
    }

    /// Waits for a report of the source, or until an image has waited too long for its pose. Cancel-safe.
    pub(super) async fn wait(&mut self) {
        // While the scene model is busy, its next report wakes the vehicle.
        let timeout = self.matcher.poll_timeout().filter(|_| !self.is_model_busy);
        let timeout = timeout.map(|at| tokio::time::Instant::from_std(self.clock.instant(at)));
        let overdue = async {
            match timeout {
                Some(at) => tokio::time::sleep_until(at).await,
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            report = next_of(&mut self.source) => self.handle_report(SensorKind::Camera, report),
            report = next_of(&mut self.navigation) => self.handle_report(SensorKind::Navigation, report),
            () = overdue => {}
        }
    }

    fn handle_report(&mut self, of: SensorKind, report: SourceReport) {
        match report {
            SourceReport::Open => match of {
                SensorKind::Camera => tracing::debug!("camera: open"),
                SensorKind::Navigation => tracing::info!("navigation: open"),
            },
            SourceReport::Reading(Reading::Image(image)) => self.handle_image(image),
            SourceReport::Reading(Reading::Pose(stamp, pose)) => {
                self.matcher.handle_pose(stamp, self.clock.now(), pose);
                let SensorPose { x_m, y_m, heading_rad, depth_m, .. } = pose;
                self.is_pose_new = true;
                self.posed.0 = self.clock.now();
                self.newest_pose = Some(CameraPose { x_m, y_m, heading_rad, depth_m });
            }
            SourceReport::Fault(fault, text) => {
                self.matcher.count(fault);
                self.is_lost |= matches!(fault, CameraFault::SourceLost | CameraFault::Stalled);
                self.texts.insert(fault, text);
            }
        }
        self.log_faults();
    }

    fn handle_image(&mut self, image: SourceImage) {
        if std::mem::take(&mut self.is_lost) {
            tracing::info!("camera: images come in again");
        }
        let own = image.stamp.filter(|_| self.stamps == CameraStamps::Own);
        let stamp = own.map_or_else(|| image.arrival.before(self.delay), |stamp| stamp.shifted(self.clock_offset_s));
        self.matcher.handle_image(stamp, image.arrival, image.picture);
    }

    pub(super) fn handle_pose(&mut self, measured: MeasuredPose) {
        // A pose that is not measured again is not that of a later image.
        if self.has_own_poses || self.measured_at.replace(measured.at) == Some(measured.at) {
            return;
        }
        let MeasuredPose {
            pose: CameraPose { x_m, y_m, heading_rad, depth_m }, roll_rad, pitch_rad, altitude_m, ..
        } = measured;
        let pose = SensorPose { x_m, y_m, heading_rad, depth_m, roll_rad, pitch_rad, altitude_m };
        let now = self.clock.now();
        self.matcher.handle_pose(now, now, pose);
    }

    pub(super) fn poll_pose(&mut self) -> Option<CameraPose> {
        std::mem::take(&mut self.is_pose_new).then_some(self.newest_pose)?
    }

    /// Time since the last call in which the navigation source gave no pose; `None` while it gives them.
    pub(super) fn poll_pose_gap(&mut self) -> Option<Duration> {
        let (now, (last, known)) = (self.clock.now(), self.posed);
        if self.navigation.is_none() || now <= last.after(self.max_gap) {
            return None;
        }
        self.posed.1 = now;
        Some(Duration::from_secs_f64(now.seconds_since(last.max(known)).max(0.0)))
    }

    /// Whether the camera is lost or has stalled.
    pub(super) fn is_silent(&self) -> bool {
        self.is_lost
    }

    pub(super) fn newest_pose(&self) -> Option<CameraPose> {
        self.newest_pose
    }

    pub(super) fn tally(&self) -> &CameraTally {
        self.matcher.tally()
    }

    pub(super) fn handle_missed(&mut self) {
        self.matcher.drop_matched(CameraFault::Unreadable);
    }

    pub(super) fn poll_frame(&mut self, mapping: u32) -> Option<CameraFrame> {
        self.is_model_busy = mapping >= MAX_MAPPING;
        let frame = if self.is_model_busy { None } else { self.next_frame() };
        if !self.was_matched && frame.is_some() {
            self.was_matched = true;
            tracing::info!("camera: the first image has a pose");
        }
        self.log_faults();
        frame
    }

    /// The next image that was taken near enough to straight down, at the pose of the camera.
    fn next_frame(&mut self) -> Option<CameraFrame> {
        let now = self.clock.now();
        self.matcher.keep_recent(now);
        let (MatchedImage { image, t_s, .. }, pose) = loop {
            let frame = self.matcher.poll_frame(now)?;
            match self.mounting.camera_pose(&frame.pose, self.altitude_m) {
                Some(pose) => break (frame, pose),
                None => self.matcher.drop_matched(CameraFault::Tilted),
            }
        };
        // A pixel's size on the floor grows with the height.
        let scale = pose.altitude_m.map_or(1.0, |height| (height / self.altitude_m).clamp(SCALES.0, SCALES.1));
        Some(CameraFrame { t_s, picture: FramePicture::Received(image), pose, scale })
    }

    /// Logs the account of the run.
    pub(super) fn log_end(&self) {
        tracing::info!("camera: {}", self.matcher.tally());
    }

    fn log_faults(&mut self) {
        let (matcher, texts) = (&self.matcher, &self.texts);
        let explain = |fault| match fault {
            CameraFault::NoPose => Some(matcher.times()),
            _ => texts.get(&fault).cloned(),
        };
        for line in self.log.lines(matcher.tally(), std::time::Instant::now(), explain) {
            tracing::warn!("{line}");
        }
    }
}
