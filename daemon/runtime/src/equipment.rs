//! The faults of the sensors, as the vehicle reports them.

use scenecast_protocol::wire::EquipmentFaults;
use scenecast_sensors::{CameraFault, CameraTally};
use std::time::{Duration, Instant};

/// A fault is reported for this long after it was counted last.
const FAULT_LASTS: Duration = Duration::from_secs(10);

/// A counter of faults, which are recent for a while after each of them.
#[derive(Debug, Default)]
pub(crate) struct RecentFaults {
    count: u64,
    last: Option<Instant>,
}

impl RecentFaults {
    /// Whether one of `count` faults so far is recent.
    pub(crate) fn handle(&mut self, count: u64, now: Instant) -> bool {
        if std::mem::replace(&mut self.count, count) != count {
            self.last = Some(now);
        }
        self.last.is_some_and(|at| now.duration_since(at) < FAULT_LASTS)
    }
}

/// The faults of camera and navigation source.
#[derive(Debug, Default)]
pub(crate) struct SensorFaults {
    images: RecentFaults,
    poses: RecentFaults,
}

impl SensorFaults {
    /// The faults now: what became of the images of a live camera, whether none comes in, and that no pose has come in for
    /// `pose_gap`; `labels_refused` is whether labels of other programs fail.
    pub(crate) fn now(
        &mut self,
        camera: Option<&CameraTally>,
        camera_silent: bool,
        pose_gap: Option<Duration>,
        labels_refused: bool,
        now: Instant,
    ) -> EquipmentFaults {
        let (dropped, unusable) = camera.map_or((0, 0), |tally| (unusable_images(tally), unusable_poses(tally)));
        EquipmentFaults {
            camera_silent,
            images_dropped: self.images.handle(dropped, now),
            poses_missing: pose_gap.is_some(),
            poses_faulty: self.poses.handle(unusable, now),
            labels_refused,
            ..EquipmentFaults::default()
        }
    }
}

/// Images that were dropped, without those of a camera that is faster than the scene model: to drop them is no fault.
fn unusable_images(tally: &CameraTally) -> u64 {
    tally.dropped() - tally.of(CameraFault::Overtaken)
}

fn unusable_poses(tally: &CameraTally) -> u64 {
    tally.iter().filter(|(fault, _)| fault.is_of_navigation()).map(|(_, n)| n).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_that_is_faster_than_the_scene_model_has_no_fault() {
        let (mut faults, mut tally, now) = (SensorFaults::default(), CameraTally::default(), Instant::now());
        let mut images_dropped = |tally: &CameraTally| faults.now(Some(tally), false, None, false, now).images_dropped;
        tally.count(CameraFault::Overtaken);
        assert!(!images_dropped(&tally));
        tally.count(CameraFault::CutOff);
        assert!(images_dropped(&tally));
    }

    #[test]
    fn a_fault_is_recent_for_ten_seconds_after_the_last_one() {
        let (mut faults, began) = (RecentFaults::default(), Instant::now());
        let mut at = |count, s| faults.handle(count, began + Duration::from_secs(s));
        assert_eq!([at(0, 0), at(1, 1), at(1, 10), at(1, 11)], [false, true, true, false]);
        assert_eq!([at(3, 20), at(4, 29), at(4, 38), at(4, 39)], [true, true, true, false]);
    }
}
