//! Whether a receiver can be believed: why none of its positions was ever used, and whether its positions move as its speed and
//! course say.

use super::{GpsFault, GpsFix, GpsLanguage};
use crate::geodesy::TangentPlane;
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// Time after the first bytes after which people are told.
const AWAITED: Duration = Duration::from_secs(15);

/// Waits for the first position.
#[derive(Debug, Default)]
pub(super) struct FirstFix {
    /// When the first bytes came, and how many lines since.
    began: Option<Instant>,
    lines: u64,
    /// A position came, or people were told.
    is_over: bool,
}

impl FirstFix {
    /// Takes how many lines came in, and whether a position was among them.
    pub(super) fn handle(&mut self, lines: u64, has_fix: bool, now: Instant) {
        self.began.get_or_insert(now);
        self.lines += lines;
        self.is_over |= has_fix;
    }

    /// Whether people should know that there is no position, once.
    pub(super) fn is_missing(&mut self, now: Instant) -> bool {
        let is_missing = !self.is_over && self.began.is_some_and(|began| now.since(began) >= AWAITED);
        self.is_over |= is_missing;
        is_missing
    }

    /// The main reason, and what to check.
    pub(super) fn explain(&self, language: GpsLanguage, faults: &BTreeMap<GpsFault, u64>) -> String {
        let seconds = AWAITED.as_secs();
        let lines = self.lines + faults.get(&GpsFault::Overlong).unwrap_or(&0);
        if lines == 0 {
            return format!("no line came in {seconds} s, only bytes without an end of line: check the baud rate");
        }
        let (check, count) = match (faults.iter().max_by_key(|(_, count)| **count), language) {
            (Some((fault, count)), _) => (advice(*fault, language), *count),
            (None, GpsLanguage::Nmea) => ("none of them has a position: switch on sentences such as GGA or RMC", 0),
            (None, GpsLanguage::Gpsd) => {
                ("none of them has a position: check with cgps whether gpsd has a receiver", 0)
            }
        };
        format!("no position came in {seconds} s: of {lines} lines {count} were not used; {check}")
    }
}

fn advice(fault: GpsFault, language: GpsLanguage) -> &'static str {
    match (fault, language) {
        (GpsFault::Checksum, _) => "their checksums are wrong: check the baud rate and the cable",
        (GpsFault::Unreadable, GpsLanguage::Nmea) => {
            "they are no sentences of NMEA 0183 with a checksum: check the baud rate, whether the receiver adds checksums, and whether the port has NMEA or the JSON of gpsd"
        }
        (GpsFault::Unreadable, GpsLanguage::Gpsd) => {
            "they are no reports of gpsd: check whether the port has NMEA instead"
        }
        (GpsFault::Overlong, _) => "they are too long: check the baud rate",
        (GpsFault::NoPosition, _) => {
            "the receiver says that it has no position yet: check its antenna and its view of the sky"
        }
        (GpsFault::NullIsland, _) => "the receiver says latitude 0 and longitude 0: it has no position yet",
        (GpsFault::Repeated | GpsFault::Frozen, _) => "the receiver repeats one time or place: restart it",
        (GpsFault::Jump, _) => "the positions contradict each other: check the receiver",
    }
}

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
    use super::super::Gps;
    use super::*;

    /// The notes of a receiver that sends a line each second, with their times.
    fn notes(language: GpsLanguage, line: &str) -> Vec<(u32, String)> {
        let mut gps = Gps::new(language);
        let second = |s: u32| {
            gps.handle_bytes(line.as_bytes(), Instant::from_secs_f64(f64::from(s)));
            gps.poll_note().map(|note| (s, note))
        };
        (0..120).filter_map(second).collect()
    }

    #[test]
    fn a_receiver_without_a_usable_line_is_named_once() {
        for (language, line, check) in [
            (GpsLanguage::Gpsd, "$GPGGA,120000,2930.0,N,03455.2,E,1,08,1.0,0,M,0,M,,*00\r\n", "NMEA instead"),
            (GpsLanguage::Nmea, "$GPGGA,120000,2930.0,N,03455.2,E,1,08,1.0,0,M,0,M,,\r\n", "checksum"),
            (GpsLanguage::Nmea, "{\"class\":\"TPV\",\"mode\":3}\n", "gpsd"),
            (GpsLanguage::Nmea, "\u{1}\u{2}", "end of line"),
            (GpsLanguage::Gpsd, "{\"class\":\"TPV\",\"mode\":1}\n", "antenna"),
            (GpsLanguage::Gpsd, "{\"class\":\"DEVICES\",\"devices\":[]}\n", "whether gpsd has a receiver"),
        ] {
            let told = notes(language, line);
            assert!(told.len() == 1 && told[0].0 == 15 && told[0].1.contains(check), "{line} {told:?}");
        }
    }

    #[test]
    fn a_receiver_with_a_position_is_not_named() {
        assert!(notes(GpsLanguage::Gpsd, "{\"class\":\"TPV\",\"mode\":3,\"lat\":1.5,\"lon\":2.5}\n").is_empty());
    }
}

#[cfg(test)]
mod way_tests {
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
