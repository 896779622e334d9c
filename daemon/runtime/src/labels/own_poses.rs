//! The vehicle's own poses of the last minutes, for images without one.

use scenecast_labels::{ImagePose, Refusal};
use scenecast_protocol::time::Instant;
use scenecast_sensors::{PoseMatch, PoseTrack, SensorPose, Stamp};
use std::time::Duration;

/// Longest time between two poses for which one between them is interpolated, and longest age of the last one.
const MAX_GAP: Duration = Duration::from_secs(5);
/// Shortest time between two poses, so that the track reaches back for minutes.
const MIN_STEP_S: f64 = 0.05;

/// The vehicle's own poses by mission time.
#[derive(Debug)]
pub(super) struct OwnPoses {
    track: PoseTrack,
    max_gap_s: f64,
}

impl OwnPoses {
    /// No poses yet, of a clock that runs `scale` times as fast as wall time.
    pub(super) fn new(scale: f64) -> Self {
        let max_gap = MAX_GAP.mul_f64(scale.max(1.0));
        Self { track: PoseTrack::new(max_gap), max_gap_s: max_gap.as_secs_f64() }
    }

    pub(super) fn push(&mut self, pose: ImagePose, now: Instant) {
        let stamp = stamp(now.as_secs_f64());
        if self.track.last().is_some_and(|(last, _)| stamp.seconds_since(last) < MIN_STEP_S) {
            return;
        }
        let ImagePose { x_m, y_m, depth_m, heading_rad } = pose;
        self.track.push(stamp, SensorPose { x_m, y_m, depth_m, heading_rad, ..SensorPose::default() });
    }

    /// The pose at `t_s`. That of the last pose holds for the few seconds after it.
    pub(super) fn at(&self, t_s: f64) -> Result<ImagePose, Refusal> {
        let (last, newest) = self.track.last().ok_or(Refusal::NoPose)?;
        let pose = match self.track.at(stamp(t_s)) {
            PoseMatch::Found(pose) => pose,
            PoseMatch::NotYet if stamp(t_s).seconds_since(last) <= self.max_gap_s => newest,
            PoseMatch::NotYet | PoseMatch::Gap | PoseMatch::TooEarly => return Err(Refusal::NoPoseAt(t_s)),
        };
        let SensorPose { x_m, y_m, depth_m, heading_rad, .. } = pose;
        Ok(ImagePose { x_m, y_m, depth_m, heading_rad })
    }
}

fn stamp(t_s: f64) -> Stamp {
    Stamp::from_nanos((t_s * 1e9) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64) -> ImagePose {
        ImagePose { x_m, y_m: 0.0, depth_m: 5.0, heading_rad: 0.0 }
    }

    #[test]
    fn an_own_pose_is_that_of_its_time_or_refused() {
        let mut poses = OwnPoses::new(1.0);
        assert_eq!(poses.at(0.0), Err(Refusal::NoPose));
        for step in 0..1000 {
            poses.push(at(f64::from(step) * 0.01), Instant::from_secs_f64(10.0 + f64::from(step) * 0.01));
        }
        assert!((poses.at(12.345).unwrap().x_m - 2.345).abs() < 1e-6);
        assert!((poses.at(24.0).unwrap().x_m - 9.95).abs() < 0.05, "it holds for a few seconds");
        assert_eq!(poses.at(9.9), Err(Refusal::NoPoseAt(9.9)));
        assert_eq!(poses.at(26.0), Err(Refusal::NoPoseAt(26.0)), "in the future");
        poses.push(at(99.0), Instant::from_secs_f64(60.0));
        assert_eq!(poses.at(40.0), Err(Refusal::NoPoseAt(40.0)), "between poses that are far apart");
    }
}
