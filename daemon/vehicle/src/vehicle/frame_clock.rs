//! When camera frames were taken, by the vehicle's clock.

use crate::SeenFrame;
use scenecast_protocol::time::Instant;

/// Turns the times of camera frames into those of the vehicle's clock. Frames have a time of their own, which begins with the first
/// frame of the mission and goes on from one run of the program to the next.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FrameClock {
    /// The first frame of this run, and what the vehicle's clock is ahead of the frames', seconds.
    run: Option<(f64, f64)>,
}

impl FrameClock {
    /// A frame has reached the map.
    pub(super) fn handle(&mut self, seen: &SeenFrame, now: Instant) {
        // That is some time after it was taken: the least difference is the nearest.
        let ahead_s = now.as_secs_f64() - seen.t_s;
        self.run = Some(self.run.map_or((seen.t_s, ahead_s), |(first_s, least_s)| (first_s, least_s.min(ahead_s))));
    }

    /// The time of a frame; `None` for one of an earlier run, whose clock is gone.
    pub(super) fn taken(&self, t_s: f64) -> Option<Instant> {
        let (first_s, ahead_s) = self.run?;
        (t_s >= first_s).then(|| Instant::from_secs_f64((t_s + ahead_s).max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene_model::project::Pose;

    #[test]
    fn frames_of_this_run_have_its_clock_and_earlier_ones_none() {
        let mut clock = FrameClock::default();
        let mut frame = |t_s: f64, now_s: f64| {
            let camera = Pose { x: 0.0, y: 0.0, z: 0.0, yaw_rad: 0.0 };
            clock.handle(&SeenFrame { t_s, camera, cells: Vec::new() }, Instant::from_secs_f64(now_s));
            clock
        };
        assert_eq!(FrameClock::default().taken(998.0), None, "the map of a checkpoint");
        frame(1000.0, 8.5);
        let clock = frame(1002.0, 9.0);
        assert_eq!(clock.taken(1001.0), Some(Instant::from_secs_f64(8.0)), "the first one was late");
        assert_eq!(clock.taken(999.0), None);
    }
}
