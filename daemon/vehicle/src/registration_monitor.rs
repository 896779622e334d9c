//! How well camera frames are placed at present, for the operator.

use crate::registration::RegisteredFrame;
use scenecast_protocol::wire::{FrameTie, RegistrationReport};

/// Frames that the share of placed ones is taken over.
const RECENT: u32 = 32;

/// Watches the registration of camera frames.
#[derive(Debug, Default)]
pub(crate) struct RegistrationMonitor {
    /// Whether images placed each of the last frames, the newest in the lowest bit.
    recent: u32,
    frames: u32,
    last: Option<RegistrationReport>,
}

impl RegistrationMonitor {
    pub(crate) fn handle_frame(&mut self, frame: &RegisteredFrame) {
        let Some(found) = &frame.found else { return };
        self.recent = self.recent << 1 | u32::from(frame.is_seen());
        self.frames = (self.frames + 1).min(RECENT);
        let tie = match &found.placed {
            _ if !found.is_on => FrameTie::Off,
            placed if placed.loops > 0 => FrameTie::EarlierTrack,
            placed if placed.is_chained => FrameTie::FrameBefore,
            _ => FrameTie::Odometry,
        };
        self.last = Some(RegistrationReport {
            tie,
            share: f64::from(self.recent.count_ones()) / f64::from(self.frames),
            sigma_m: found.placed.sigma_m,
            closed: found.closed.min(u16::MAX.into()) as u16,
        });
    }

    /// `None` before the first frame, and where frames were never registered.
    pub(crate) fn report(&self) -> Option<RegistrationReport> {
        self.last
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::registration::FoundFrame;
    use scene_model::project::Pose;
    use scenecast_protocol::coordinates::MapPoint;
    use scenecast_registration::{Evidence, FramePose, Placed};

    fn frame(is_chained: bool, loops: u8, is_on: bool) -> RegisteredFrame {
        let at = MapPoint::new(0.0, 0.0);
        let pose = FramePose::new(at, 0.0, 0.0);
        let placed = Placed { pose, is_chained, loops, sigma_m: 0.1, evidence: Evidence::default() };
        RegisteredFrame {
            pose: Pose { x: 0.0, y: 0.0, z: 0.0, yaw_rad: 0.0 },
            scale: 1.0,
            dead_reckoned: at,
            found: Some(FoundFrame { placed, closed: 70_000, is_on }),
        }
    }

    #[test]
    fn the_report_follows_the_last_frame_and_the_share_the_last_32() {
        let mut monitor = RegistrationMonitor::default();
        assert_eq!(monitor.report(), None);
        let mut see = |is_chained, loops, is_on| {
            monitor.handle_frame(&frame(is_chained, loops, is_on));
            monitor.report().map(|report| (report.tie, report.share)).unwrap()
        };
        assert_eq!(see(false, 0, true), (FrameTie::Odometry, 0.0));
        assert_eq!(see(true, 0, true), (FrameTie::FrameBefore, 0.5));
        assert_eq!(see(true, 2, true), (FrameTie::EarlierTrack, 2.0 / 3.0));
        let last = (0..40).map(|_| see(false, 0, false)).last();
        assert_eq!(last, Some((FrameTie::Off, 0.0)));
        assert_eq!(monitor.report().map(|report| report.closed), Some(u16::MAX));
    }
}
