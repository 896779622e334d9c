//! The faults of the sensors as the vehicle reports them, and what became of the items of other programs.

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
    depth: RecentFaults,
    /// Images that were mapped so far, and when the last one was.
    mapped: (u64, Option<Instant>),
}

impl SensorFaults {
    /// The faults now: what became of the images of the camera, whether none comes in, and that no pose has come in for
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
        let images_dropped = self.images.handle(dropped, now);
        EquipmentFaults {
            camera_silent,
            images_dropped,
            images_unusable: self.is_nothing_mapped(camera, now) && images_dropped && !camera_silent,
            depth_missing: self.depth.handle(camera.map_or(0, missing_depth), now),
            poses_missing: pose_gap.is_some(),
            poses_faulty: self.poses.handle(unusable, now),
            labels_refused,
            ..EquipmentFaults::default()
        }
    }

    /// Whether no image was mapped for a while.
    fn is_nothing_mapped(&mut self, camera: Option<&CameraTally>, now: Instant) -> bool {
        let mapped = camera.map_or(0, |tally| tally.matched);
        let (before, last) = self.mapped;
        // An image counts as mapped until the scene model finds that it cannot be read.
        if mapped > before || last.is_none() {
            self.mapped = (mapped, Some(now));
        }
        self.mapped.1.is_some_and(|at| now.duration_since(at) >= FAULT_LASTS)
    }
}

/// Images without distances that could be used.
fn missing_depth(tally: &CameraTally) -> u64 {
    use CameraFault::{DepthLost, DepthStalled, NoDepth, UnusableDepth};
    [NoDepth, UnusableDepth, DepthLost, DepthStalled].map(|fault| tally.of(fault)).iter().sum()
}

/// Images that were dropped, without those that it is no fault to drop: of a camera that is faster than the scene model, or of a
/// vehicle that comes up.
fn unusable_images(tally: &CameraTally) -> u64 {
    tally.dropped() - tally.of(CameraFault::Overtaken) - tally.of(CameraFault::ComingUp)
}

fn unusable_poses(tally: &CameraTally) -> u64 {
    // That none comes in is a fault of its own.
    let is_silence = |fault| matches!(fault, CameraFault::PosesLost | CameraFault::PosesStalled);
    tally.iter().filter(|(fault, _)| fault.is_of_navigation() && !is_silence(*fault)).map(|(_, n)| n).sum()
}

/// A refusal is a fault for this long.
const ITEM_FAULT_LASTS: Duration = Duration::from_secs(10);

/// The state of the sources of labels and bands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct LabelHealth {
    pub(crate) taken: u64,
    pub(crate) refused: u64,
    /// The last item that was refused, and why.
    pub(crate) last_refusal: Option<String>,
    /// Whether an item was refused in the last seconds, or a source is missing.
    pub(crate) is_failing: bool,
    /// Whether a folder is not there, a topic cannot be opened, or whoever read a source has ended.
    pub(crate) is_missing: bool,
}

/// Counts items that were taken or refused.
#[derive(Debug, Default)]
pub(crate) struct LabelTally {
    taken: u64,
    refused: u64,
    last_refusal: Option<(String, Instant)>,
    is_missing: bool,
}

impl LabelTally {
    pub(crate) fn take(&mut self) {
        self.taken += 1;
    }

    pub(crate) fn refuse(&mut self, text: String, now: Instant) {
        self.refused += 1;
        self.last_refusal = Some((text, now));
    }

    pub(crate) fn set_missing(&mut self, is_missing: bool) {
        self.is_missing = is_missing;
    }

    pub(crate) fn health(&self, now: Instant) -> LabelHealth {
        let last = self.last_refusal.as_ref();
        let is_new = last.is_some_and(|(_, at)| now.saturating_duration_since(*at) < ITEM_FAULT_LASTS);
        LabelHealth {
            taken: self.taken,
            refused: self.refused,
            last_refusal: last.map(|(text, _)| text.clone()),
            is_failing: is_new || self.is_missing,
            is_missing: self.is_missing,
        }
    }
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
    fn a_camera_of_which_no_image_can_be_used_is_a_grave_fault() {
        let (mut faults, mut tally, began) = (SensorFaults::default(), CameraTally::default(), Instant::now());
        let mut unusable = |tally: &CameraTally, s| {
            faults.now(Some(tally), false, None, false, began + Duration::from_secs(s)).images_unusable
        };
        tally.matched = 3;
        assert!(!unusable(&tally, 0));
        tally.count(CameraFault::Calibration);
        assert!(!unusable(&tally, 5), "one of some seconds ago was mapped");
        tally.count(CameraFault::Calibration);
        assert!(unusable(&tally, 11));
        assert!(!unusable(&tally, 30), "no further image comes in");
        tally.matched = 4;
        assert!(!unusable(&tally, 31));
    }

    #[test]
    fn a_fault_is_recent_for_ten_seconds_after_the_last_one() {
        let (mut faults, began) = (RecentFaults::default(), Instant::now());
        let mut at = |count, s| faults.handle(count, began + Duration::from_secs(s));
        assert_eq!([at(0, 0), at(1, 1), at(1, 10), at(1, 11)], [false, true, true, false]);
        assert_eq!([at(3, 20), at(4, 29), at(4, 38), at(4, 39)], [true, true, true, false]);
    }

    #[test]
    fn a_refusal_is_a_fault_for_a_while() {
        let (mut tally, now) = (LabelTally::default(), Instant::now());
        tally.take();
        assert!(!tally.health(now).is_failing);
        tally.refuse("a.json: class 254".to_owned(), now);
        let health = tally.health(now + ITEM_FAULT_LASTS / 2);
        assert_eq!((health.taken, health.refused, health.is_failing), (1, 1, true));
        let later = tally.health(now + ITEM_FAULT_LASTS);
        assert!(!later.is_failing && later.last_refusal.is_some_and(|text| text.contains("class 254")));
        tally.set_missing(true);
        assert!(tally.health(now + ITEM_FAULT_LASTS).is_failing);
    }
}
