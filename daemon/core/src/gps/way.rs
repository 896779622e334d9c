//! Whether the positions of a receiver move as its speed and course say.

use super::GpsFix;
use crate::geodesy::TangentPlane;
use scenecast_protocol::time::Instant;
use std::time::Duration;

/// The way is compared over this time.
const SPAN: Duration = Duration::from_secs(30);
/// Longer without a position, and the way begins anew.
const GAP: Duration = Duration::from_secs(3);
/// So many spans in a row tell a receiver that contradicts itself from one that turns.
const SPANS: u32 = 2;
/// Part of the longer way that the other may differ by: less than between knots and metres a second.
const SHARE: f64 = 0.35;
/// Difference that is none at any speed, m/s.
const SLOW_M_S: f64 = 0.2;

/// The way by positions beside the way by velocities.
#[derive(Debug, Default)]
pub(super) struct Way {
    from: Option<GpsFix>,
    last: Option<Instant>,
    /// The sum of the velocities, metres east and north.
    said: (f64, f64),
    /// Spans in a row in which they differed.
    differed: u32,
    is_told: bool,
}

impl Way {
    /// Takes a position and the velocity east and north in m/s, `None` where it is not known. Returns what people should read, once.
    pub(super) fn handle(&mut self, fix: GpsFix, velocity: Option<(f64, f64)>) -> Option<String> {
        let last = self.last.replace(fix.at).filter(|last| fix.at.since(*last) < GAP);
        let (Some(from), Some(last), Some((east, north))) = (self.from, last, velocity) else {
            (self.from, self.said, self.differed) = (Some(fix), (0.0, 0.0), 0);
            return None;
        };
        let passed_s = fix.at.since(last).as_secs_f64();
        self.said = (self.said.0 + east * passed_s, self.said.1 + north * passed_s);
        let span = fix.at.since(from.at);
        if span < SPAN {
            return None;
        }
        let said = std::mem::take(&mut self.said);
        self.from = Some(fix);
        let gone = TangentPlane::new(from.place).to_plane(fix.place);
        let (gone_m, said_m) = (gone.0.hypot(gone.1), said.0.hypot(said.1));
        let allowed_m = SHARE * gone_m.max(said_m) + from.sigma_m.hypot(fix.sigma_m) + SLOW_M_S * span.as_secs_f64();
        let differs = (gone.0 - said.0).hypot(gone.1 - said.1) > allowed_m;
        self.differed = if differs { self.differed + 1 } else { 0 };
        if self.differed < SPANS || std::mem::replace(&mut self.is_told, true) {
            return None;
        }
        // The sum is 0 where the number is -0.
        let whole = |metres: f64| metres.round() + 0.0;
        let way = |(east, north): (f64, f64)| format!("{} m east and {} m north", whole(east), whole(north));
        Some(format!(
            "in {:.0} s its positions go {}, its speed and course {}: check this receiver; the positions are used",
            span.as_secs_f64(),
            way(gone),
            way(said)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Gps, GpsLanguage};
    use crate::geodesy::LatLon;
    use crate::nmea;
    use scenecast_protocol::time::Instant;

    /// The notes of two minutes of a receiver that goes north at one speed and says another one, in knots, with a course in degrees.
    fn notes(goes: f64, says: f64, course: &str) -> Vec<String> {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let second = |s: u32| {
            let lat_deg = 29.5 + goes / 1.943_84 * f64::from(s) / 111_000.0;
            let place = nmea::place_fields(LatLon::new(lat_deg, 34.92).unwrap());
            let time = format!("12{:02}{:02}.00", s / 60, s % 60);
            let rmc = nmea::line(&format!("GPRMC,{time},A,{place},{says:.1},{course},261126,,,A"));
            gps.handle_bytes(rmc.as_bytes(), Instant::from_secs_f64(f64::from(s)));
            gps.poll_note()
        };
        (0..120).filter_map(second).collect()
    }

    #[test]
    fn positions_and_velocities_that_differ_are_named_once() {
        for (goes, says, course) in [(1.0, 4.0, "0.0"), (4.0, 4.0, "90.0"), (4.0, 0.0, ""), (4.0, 7.8, "0.0")] {
            let told = notes(goes, says, course);
            assert!(told.len() == 1 && told[0].contains("check this receiver"), "{goes} {says} {course}: {told:?}");
        }
        let text = &notes(4.0, 4.0, "90.0")[0];
        assert!(text.contains("go 0 m east and 62 m north, its speed and course 62 m east and 0 m north"), "{text}");
    }

    #[test]
    fn positions_that_go_as_they_say_are_not_named() {
        for (goes, says, course) in [(4.0, 4.0, "0.0"), (0.0, 0.1, ""), (4.0, 4.6, "8.0"), (0.4, 0.0, "")] {
            assert!(notes(goes, says, course).is_empty(), "{goes} {says} {course}");
        }
    }
}
