//! The poses of a live vehicle and the distances of its camera's pixels: each image waits for those of its moment.

use scenecast_config::{Config, NavigationSource};
use scenecast_drivers::autopilot::{Jump, Plausible, Step};
use scenecast_host::{CameraPose, MeasuredPose};
use scenecast_protocol::time::Instant;
use scenecast_sensors::{DepthMatch, DepthMessage, DepthTrack, SensorPose, Stamp};
use scenecast_sources::{ArrivalClock, LiveSource, SourceReport};
use std::time::Duration;

/// The source of the poses, and the newest one.
pub(super) struct PoseFeed {
    /// The source, if it is not the autopilot or a file.
    source: Option<LiveSource>,
    has_own_poses: bool,
    /// Time of the autopilot's last pose.
    measured_at: Option<Instant>,
    /// The newest pose of the navigation source.
    newest: Option<CameraPose>,
    /// Arrival of the newest pose, or the start of the run; and the time up to which the vehicle knows of its absence.
    posed: (Stamp, Stamp),
    /// Longest time between two poses.
    max_gap: Duration,
    /// Whether the vehicle does not know the newest pose yet.
    is_new: bool,
    plausible: Plausible,
}

impl PoseFeed {
    pub(super) fn new(config: &Config, source: Option<LiveSource>, clock: &ArrivalClock) -> Self {
        Self {
            source,
            has_own_poses: config.navigation.source != NavigationSource::Autopilot,
            measured_at: None,
            newest: None,
            posed: (clock.now(), clock.now()),
            max_gap: Duration::from_secs_f64(config.navigation.max_gap_s),
            is_new: false,
            plausible: Plausible::default(),
        }
    }

    /// The next report of the source. Cancel-safe.
    pub(super) async fn next(&mut self) -> SourceReport {
        LiveSource::next_of(&mut self.source).await
    }

    /// Takes a pose that the source measured at `stamp`. Returns it with the heading, the depth and the height above the sea floor that
    /// can be, and the jumps that were found; `None` in place of a pose that no vehicle can reach so fast, until it stays.
    pub(super) fn handle_pose(
        &mut self,
        stamp: Stamp,
        pose: SensorPose,
        now: Stamp,
    ) -> (Option<SensorPose>, Vec<Jump>) {
        let SensorPose { x_m, y_m, heading_rad, depth_m, altitude_m, .. } = pose;
        let measured = Step { heading_rad: Some(heading_rad), depth_m: Some(depth_m), altitude_m, ..Step::default() };
        // Only differences of these times count.
        let at = Instant::from_micros((stamp.nanos() / 1000).max(0) as u64);
        let (step, mut jumps) = self.plausible.check(measured, at);
        jumps.extend(self.plausible.check_place((y_m, x_m), at));
        if self.plausible.is_place_in_doubt() {
            return (None, jumps);
        }
        let (heading_rad, depth_m) = (step.heading_rad.unwrap_or(heading_rad), step.depth_m.unwrap_or(depth_m));
        self.is_new = true;
        self.posed.0 = now;
        self.newest = Some(CameraPose { x_m, y_m, heading_rad, depth_m });
        (Some(SensorPose { heading_rad, depth_m, altitude_m: step.altitude_m, ..pose }), jumps)
    }

    /// The autopilot's pose, if images are mapped at it and it is a new one: a pose that is not measured again is not that of
    /// a later image.
    pub(super) fn of_autopilot(&mut self, measured: MeasuredPose) -> Option<SensorPose> {
        if self.has_own_poses || self.measured_at.replace(measured.at) == Some(measured.at) {
            return None;
        }
        let MeasuredPose {
            pose: CameraPose { x_m, y_m, heading_rad, depth_m }, roll_rad, pitch_rad, altitude_m, ..
        } = measured;
        Some(SensorPose { x_m, y_m, heading_rad, depth_m, roll_rad, pitch_rad, altitude_m })
    }

    /// The newest pose of the source, once.
    pub(super) fn poll_pose(&mut self) -> Option<CameraPose> {
        std::mem::take(&mut self.is_new).then_some(self.newest)?
    }

    /// Time since the last call in which the source gave no pose; `None` while it gives them.
    pub(super) fn poll_gap(&mut self, now: Stamp) -> Option<Duration> {
        let (last, known) = self.posed;
        if self.source.is_none() || now <= last.after(self.max_gap) {
            return None;
        }
        self.posed.1 = now;
        Some(Duration::from_secs_f64(now.seconds_since(last.max(known)).max(0.0)))
    }

    pub(super) fn newest(&self) -> Option<CameraPose> {
        self.newest
    }
}

/// Longest time that an image waits for its distances.
const MAX_WAIT: Duration = Duration::from_millis(500);

/// Units in a metre of whole-number depth images of ROS 2 (REP 118).
const ROS_UNITS_PER_M: f64 = 1000.0;

/// The source of the distances, and those that wait for their images.
pub(super) struct DepthFeed {
    source: Option<LiveSource>,
    track: DepthTrack<DepthMessage>,
    units_per_m: f64,
}

impl DepthFeed {
    /// `units_per_m` is 0 for the units of ROS 2.
    pub(super) fn new(source: Option<LiveSource>, units_per_m: f64) -> Self {
        let units_per_m = if units_per_m > 0.0 { units_per_m } else { ROS_UNITS_PER_M };
        Self { source, track: DepthTrack::default(), units_per_m }
    }

    /// The next report of the source. Cancel-safe.
    pub(super) async fn next(&mut self) -> SourceReport {
        LiveSource::next_of(&mut self.source).await
    }

    /// Takes distances, which are kept for the images that wait, at these times.
    pub(super) fn handle_depth(
        &mut self,
        stamp: Stamp,
        message: DepthMessage,
        images: impl IntoIterator<Item = Stamp>,
    ) {
        let bytes = message.size();
        self.track.push(stamp, message, bytes, images);
    }

    /// The distances at the time of an image that waits since `since`; `None` as long as it waits for them.
    pub(super) fn poll(&mut self, stamp: Stamp, since: Stamp, now: Stamp) -> Option<DepthAnswer> {
        if self.source.is_none() {
            return Some(DepthAnswer::Unmeasured);
        }
        match self.track.take(stamp) {
            DepthMatch::Found(message) => Some(DepthAnswer::Measured(message, self.units_per_m)),
            DepthMatch::NotYet if now < Self::due(since) => None,
            DepthMatch::NotYet | DepthMatch::Missing => Some(DepthAnswer::Missing),
        }
    }

    /// The moment at which an image that waits since `since` is mapped without distances.
    pub(super) fn due(since: Stamp) -> Stamp {
        since.after(MAX_WAIT)
    }
}

/// The distances of an image.
#[derive(Debug, PartialEq)]
pub(super) enum DepthAnswer {
    /// They were measured, whole numbers in so many units a metre.
    Measured(DepthMessage, f64),
    /// A source is configured, and has none for this image.
    Missing,
    /// No source of distances is configured.
    Unmeasured,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_wrong_height_of_a_velocity_log_is_not_used_and_named() {
        let clock = ArrivalClock::start();
        let mut feed = PoseFeed::new(&Config::default(), None, &clock);
        let mut heights = Vec::new();
        let mut notes = Vec::new();
        for tenths in 0..100 {
            let altitude_m = Some(if tenths % 40 == 20 { 60.0 } else { 2.0 });
            let at = clock.now().after(Duration::from_millis(100 * tenths));
            let (pose, jumps) = feed.handle_pose(at, SensorPose { altitude_m, ..SensorPose::default() }, clock.now());
            heights.push(pose.unwrap().altitude_m);
            notes.extend(jumps.into_iter().filter_map(|jump| jump.note));
        }
        assert_eq!(heights, [Some(2.0); 100]);
        assert_eq!(notes.len(), 1, "{notes:?}");
        assert!(notes[0].starts_with("the height above the sea floor jumps from 2.0 to 60.0 m"), "{notes:?}");
    }

    #[test]
    fn a_place_that_no_vehicle_reaches_is_no_pose_until_it_stays() {
        let clock = ArrivalClock::start();
        let mut feed = PoseFeed::new(&Config::default(), None, &clock);
        let mut notes = Vec::new();
        let mut places = Vec::new();
        for tenths in 0..60 {
            let x_m = if tenths == 20 || tenths >= 40 { 400.0 } else { 1.0 };
            let at = clock.now().after(Duration::from_millis(100 * tenths));
            let (pose, jumps) = feed.handle_pose(at, SensorPose { x_m, ..SensorPose::default() }, clock.now());
            places.extend(pose.map(|pose| (tenths, pose.x_m)));
            notes.extend(jumps.into_iter().filter_map(|jump| jump.note));
        }
        assert!(places.iter().all(|(tenths, x_m)| *x_m == if *tenths < 50 { 1.0 } else { 400.0 }), "{places:?}");
        assert!((48..=50).contains(&places.len()) && feed.newest().is_some_and(|pose| pose.x_m == 400.0), "{places:?}");
        assert!(notes[0].starts_with("the position east jumps from 1.0 to 400.0 m"), "{notes:?}");
    }
}
