//! Images that place the frames elsewhere than the navigation source does.

use std::time::{Duration, Instant};

/// Distance beyond which images and poses disagree, metres; and the part of the track for the drift of images, which have no
/// absolute place.
const LIMITS: (f64, f64) = (5.0, 0.05);
/// Time between two lines of the log.
const PAUSE: Duration = Duration::from_secs(60);

/// Compares where images and poses of a navigation source place the frames.
#[derive(Debug, Default)]
pub(crate) struct Disagreement {
    last: Option<(f64, f64)>,
    track_m: f64,
    logged: Option<Instant>,
}

impl Disagreement {
    /// Takes the places of a frame by its pose and by its image, metres; returns a line for the log if they are far apart.
    pub(crate) fn handle(&mut self, pose: (f64, f64), image: (f64, f64), now: Instant) -> Option<String> {
        let apart = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0).hypot(a.1 - b.1);
        self.track_m += self.last.replace(pose).map_or(0.0, |last| apart(last, pose));
        let apart_m = apart(pose, image);
        let is_far = apart_m > LIMITS.0 + LIMITS.1 * self.track_m;
        if !is_far || self.logged.is_some_and(|at| now.duration_since(at) < PAUSE) {
            return None;
        }
        self.logged = Some(now);
        Some(format!(
            "images and poses disagree: they place a frame {apart_m:.0} m apart after {:.0} m of track. Check camera.mount_deg and \
             the size of pixels (camera.metres_per_pixel, the calibration, the altitude); registration.enabled = false maps by \
             the poses alone",
            self.track_m
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_mounting_is_logged_once_a_minute() {
        let (mut disagreement, began) = (Disagreement::default(), Instant::now());
        let mut at = |s: u64, turn: f64| {
            let north = s as f64;
            let image = (north * turn.sin(), north * turn.cos());
            disagreement.handle((0.0, north), image, began + Duration::from_secs(s))
        };
        assert!((0..4).all(|s| at(s, 1.5).is_none()), "near the start they are near each other");
        let said: Vec<u64> = (4..100).filter(|s| at(*s, 1.5).is_some()).collect();
        assert_eq!(said, [4, 64]);
        let mut drifting = Disagreement::default();
        let good = (0..1000).all(|s| drifting.handle((0.0, f64::from(s)), (0.0, 1.03 * f64::from(s)), began).is_none());
        assert!(good, "images drift");
    }
}
