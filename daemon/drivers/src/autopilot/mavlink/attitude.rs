//! How the vehicle lies in the water, by ATTITUDE, or else by the heading of a global position.

use super::super::lasting::Lasting;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// An attitude or a heading counts for this long.
const LASTS: Duration = Duration::from_secs(2);

/// An attitude that is missing for this long, while positions come in, is named.
const UNKNOWN_AFTER: Duration = Duration::from_secs(5);

/// The last attitude and the last heading.
#[derive(Debug, Default)]
pub(super) struct Attitude {
    /// Roll, pitch and yaw, radians: starboard down, bow up, clockwise from north.
    measured: Option<([f64; 3], Instant)>,
    /// The heading of GLOBAL_POSITION_INT, radians.
    heading: Option<(f64, Instant)>,
    absence: Lasting,
}

impl Attitude {
    pub(super) fn handle(&mut self, angles: [f32; 3], now: Instant) {
        self.measured = Some((angles.map(f64::from), now));
    }

    pub(super) fn handle_heading(&mut self, heading_rad: f64, now: Instant) {
        self.heading = Some((heading_rad, now));
    }

    fn fresh(&self, now: Instant) -> Option<[f64; 3]> {
        self.measured.filter(|(_, at)| now.since(*at) < LASTS).map(|(angles, _)| angles)
    }

    /// Roll and pitch, radians; 0 if they are not measured.
    pub(super) fn tilt(&self, now: Instant) -> (f64, f64) {
        self.fresh(now).map_or((0.0, 0.0), |[roll, pitch, _]| (roll, pitch))
    }

    /// The heading, radians: that of the attitude, which is finer, or else that of the last global position.
    pub(super) fn heading_rad(&self, now: Instant) -> Option<f64> {
        let of_position = || self.heading.filter(|(_, at)| now.since(*at) < LASTS).map(|(heading, _)| heading);
        self.fresh(now).map(|[_, _, yaw]| yaw).or_else(of_position)
    }

    /// Whether no attitude is measured.
    pub(super) fn is_missing(&mut self, now: Instant) -> bool {
        let is_missing = self.fresh(now).is_none();
        if !is_missing {
            self.absence.end();
        }
        is_missing
    }

    /// What people should know of an attitude that is missing while positions come in, once.
    pub(super) fn poll_absence(&mut self, now: Instant) -> Option<&'static str> {
        self.absence.is_news(UNKNOWN_AFTER, now).then_some(match self.heading_rad(now) {
            Some(_) => "the autopilot reports no attitude: the heading of its global position is used, and its tilt is not known",
            None => "the autopilot reports no attitude: images have no pose until it does",
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(10.0 + s)
    }

    #[test]
    fn the_heading_of_a_position_takes_the_place_of_an_old_attitude() {
        let mut attitude = Attitude::default();
        assert_eq!((attitude.heading_rad(at(0.0)), attitude.tilt(at(0.0))), (None, (0.0, 0.0)));
        attitude.handle([0.5, -0.25, 1.0], at(0.0));
        attitude.handle_heading(2.0, at(1.5));
        assert_eq!((attitude.heading_rad(at(1.9)), attitude.tilt(at(1.9))), (Some(1.0), (0.5, -0.25)));
        assert_eq!((attitude.heading_rad(at(2.0)), attitude.tilt(at(2.0))), (Some(2.0), (0.0, 0.0)));
        assert_eq!(attitude.heading_rad(at(3.5)), None);
    }
}
