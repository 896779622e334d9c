//! Positions from a receiver, checked for plausibility.

use crate::geodesy::LatLon;
use crate::nmea::Sentence;
mod gpsd;

use crate::{Lines, nmea};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;

/// The language of a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GpsLanguage {
    Nmea,
    Gpsd,
}

/// Reasons to refuse a position of a receiver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum GpsFault {
    /// A line with a wrong checksum.
    Checksum,
    /// A line that is none of the language, or has a field that cannot be.
    Unreadable,
    /// A line longer than allowed.
    Overlong,
    /// The receiver reports that it has no position.
    NoPosition,
    /// The same time of measurement, or the same place to the last digit while under way, again and again.
    Frozen,
    /// The position is too far from the last one for the speed of a vessel.
    Jump,
}

impl GpsFault {
    pub fn name(self) -> &'static str {
        match self {
            Self::Checksum => "checksum",
            Self::Unreadable => "malformed",
            Self::Overlong => "too_long",
            Self::NoPosition => "no_position",
            Self::Frozen => "frozen",
            Self::Jump => "jump",
        }
    }
}

/// A position that can be believed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GpsFix {
    pub place: LatLon,
    /// Standard deviation in each direction, metres.
    pub sigma_m: f64,
    pub at: Instant,
}

/// A receiver as its bytes come in.
#[derive(Debug)]
pub struct Gps {
    language: GpsLanguage,
    lines: Lines,
    faults: BTreeMap<GpsFault, u64>,
    fix: Option<GpsFix>,
    /// The last position, its time of day, and the time since which neither has changed.
    told: Option<(LatLon, Option<f64>, Instant)>,
    utc_changed: Option<(f64, Instant)>,
    /// Places in a row that were too far from the last good one, and the last of them.
    jumps: (u32, Option<GpsFix>),
    /// Way over ground: speed in m/s, course, when.
    motion: Option<(f64, Option<f64>, Instant)>,
    heading: Option<(f64, Instant)>,
    has_gga: bool,
}

impl Gps {
    /// Error of a position without corrections at a dilution of 1, metres (GPS SPS performance standard 2020: 8 m at 95 %).
    const PLAIN_SIGMA_M: f64 = 3.0;
    /// Faster is no vessel, m/s.
    const FASTEST_M_S: f64 = 30.0;
    /// A position that keeps its last digit for this long is frozen if the receiver reports motion.
    const FROZEN: Duration = Duration::from_secs(5);
    /// So many places in a row, near each other, are believed however far they are from the last good one.
    const JUMPS_BELIEVED: u32 = 10;
    /// Slower than this the course over ground is noise, m/s.
    const COURSE_SPEED_M_S: f64 = 0.5;

    /// A receiver without a report yet.
    pub fn new(language: GpsLanguage) -> Self {
        let longest = match language {
            GpsLanguage::Nmea => nmea::MAX_LINE,
            GpsLanguage::Gpsd => gpsd::MAX_LINE,
        };
        Self {
            language,
            lines: Lines::new(longest),
            faults: BTreeMap::new(),
            fix: None,
            told: None,
            utc_changed: None,
            jumps: (0, None),
            motion: None,
            heading: None,
            has_gga: false,
        }
    }

    pub fn faults(&self) -> impl Iterator<Item = (GpsFault, u64)> + '_ {
        self.faults
            .iter()
            .map(|(&f, &n)| (f, n))
            .chain((self.lines.overlong() > 0).then_some((GpsFault::Overlong, self.lines.overlong())))
    }

    pub fn fix(&self) -> Option<GpsFix> {
        self.fix
    }

    /// Where the bow points, clockwise from true north in radians: a compass first, else the course while under way.
    pub fn heading_rad(&self, now: Instant) -> Option<f64> {
        const FRESH: Duration = Duration::from_secs(5);
        let compass = self.heading.filter(|(_, at)| now.since(*at) < FRESH).map(|(h, _)| h);
        let course = || self.motion.filter(|(v, _, at)| *v > Self::COURSE_SPEED_M_S && now.since(*at) < FRESH);
        compass.or_else(|| course().and_then(|(_, course, _)| course))
    }

    /// Returns the request to send on a new connection, and drops a half line of the old one.
    pub fn handle_open(&mut self) -> &'static [u8] {
        self.lines.clear();
        match self.language {
            GpsLanguage::Nmea => b"",
            GpsLanguage::Gpsd => gpsd::WATCH,
        }
    }

    /// Takes bytes; returns the good positions in them, oldest first.
    pub fn handle_bytes(&mut self, bytes: &[u8], now: Instant) -> Vec<GpsFix> {
        let mut lines = std::mem::replace(&mut self.lines, Lines::new(0));
        let mut fixes = Vec::new();
        lines.push(bytes, |line| fixes.extend(self.handle_line(line, now)));
        self.lines = lines;
        fixes
    }

    fn handle_line(&mut self, line: &[u8], now: Instant) -> Option<GpsFix> {
        let (sentences, sigma_m) = match self.language {
            GpsLanguage::Gpsd => {
                let said = gpsd::parse(line).or_else(|| self.refuse(GpsFault::Unreadable))?;
                (said.sentences, said.sigma_m)
            }
            GpsLanguage::Nmea => match nmea::parse(line) {
                Ok(sentences) => {
                    let is_gga = line.get(3..6) == Some(b"GGA");
                    self.has_gga |= is_gga;
                    // RMC repeats the position of GGA without its quality.
                    let repeats = |s: &Sentence| self.has_gga && !is_gga && matches!(s, Sentence::Position { .. });
                    (sentences.into_iter().filter(|s| !repeats(s)).collect(), None)
                }
                Err(nmea::NmeaError::Checksum) => return self.refuse(GpsFault::Checksum),
                Err(_) => return self.refuse(GpsFault::Unreadable),
            },
        };
        // The motion first: it says whether a place that stays the same is frozen.
        for sentence in &sentences {
            match *sentence {
                Sentence::Motion { speed_m_s, course_rad } => self.motion = Some((speed_m_s, course_rad, now)),
                Sentence::Heading(heading) => self.heading = Some((heading, now)),
                _ => {}
            }
        }
        sentences.into_iter().find_map(|sentence| match sentence {
            Sentence::Position { place, utc_s, hdop, is_corrected } => {
                let plain = Self::PLAIN_SIGMA_M * hdop.unwrap_or(1.5).clamp(0.5, 50.0);
                let sigma_m = sigma_m.unwrap_or(if is_corrected { plain / 3.0 } else { plain }).clamp(0.02, 200.0);
                self.handle_position(GpsFix { place, sigma_m, at: now }, utc_s)
            }
            Sentence::NoPosition => self.refuse(GpsFault::NoPosition),
            _ => None,
        })
    }

    fn handle_position(&mut self, fix: GpsFix, utc_s: Option<f64>) -> Option<GpsFix> {
        if self.is_frozen(fix.place, utc_s, fix.at) {
            return self.refuse(GpsFault::Frozen);
        }
        if self.fix.is_some_and(|last| !Self::is_way(&last, &fix)) {
            let (row, before) = self.jumps;
            let goes_on = before.is_some_and(|b| Self::is_way(&b, &fix));
            self.jumps = (if goes_on { row + 1 } else { 1 }, Some(fix));
            if self.jumps.0 < Self::JUMPS_BELIEVED {
                return self.refuse(GpsFault::Jump);
            }
        }
        self.jumps = (0, None);
        self.fix = Some(fix);
        Some(fix)
    }

    /// Whether a vessel can come from one position to the other.
    fn is_way(from: &GpsFix, to: &GpsFix) -> bool {
        let (x, y) = super::geodesy::TangentPlane::new(from.place).to_plane(to.place);
        let passed_s = to.at.since(from.at).as_secs_f64();
        x.hypot(y) <= Self::FASTEST_M_S * passed_s + 5.0 * from.sigma_m.hypot(to.sigma_m)
    }

    fn is_frozen(&mut self, place: LatLon, utc_s: Option<f64>, now: Instant) -> bool {
        let since = match self.told {
            Some((last, _, since)) if last == place => since,
            _ => now,
        };
        self.told = Some((place, utc_s, since));
        if let Some(utc) = utc_s
            && self.utc_changed.is_none_or(|(last, _)| last != utc)
        {
            self.utc_changed = Some((utc, now));
        }
        let moves = self.motion.is_some_and(|(v, _, at)| v > Self::COURSE_SPEED_M_S && now.since(at) < Self::FROZEN);
        let is_place_frozen = moves && now.since(since) > Self::FROZEN;
        let is_time_frozen = utc_s.is_some() && self.utc_changed.is_some_and(|(_, at)| now.since(at) > Self::FROZEN);
        is_place_frozen || is_time_frozen
    }

    fn refuse<T>(&mut self, fault: GpsFault) -> Option<T> {
        *self.faults.entry(fault).or_default() += 1;
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn gga(lat_deg: f64, second: u32) -> String {
        let place = nmea::place_fields(LatLon::new(lat_deg, 34.92).unwrap());
        nmea::line(&format!("GPGGA,1200{second:02}.00,{place},1,08,1.0,0,M,0,M,,"))
    }

    fn at(s: f64) -> Instant {
        Instant::from_secs_f64(1000.0 + s)
    }

    fn faults(gps: &Gps) -> Vec<(&'static str, u64)> {
        gps.faults().map(|(f, n)| (f.name(), n)).collect()
    }

    #[test]
    fn positions_come_out_of_pieces_of_lines() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let stream = format!("garbage\r\n{}{}", gga(29.5, 1), gga(29.50001, 2));
        let mut found = Vec::new();
        for piece in stream.as_bytes().chunks(7) {
            found.extend(gps.handle_bytes(piece, at(1.0)));
        }
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].sigma_m, faults(&gps)), (3.0, vec![("malformed", 1)]));
    }

    #[test]
    fn wrong_checksums_and_overlong_lines_are_counted_and_not_used() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let wrong = gga(29.5, 1).replace("4.92", "5.92").replace("$GP", "$GN");
        assert!(gps.handle_bytes(wrong.as_bytes(), at(0.0)).is_empty());
        assert!(gps.handle_bytes(&[&[b'$'; 4000][..], b"\r\n"].concat(), at(0.0)).is_empty());
        assert_eq!(faults(&gps), [("checksum", 1), ("too_long", 1)]);
    }

    #[test]
    fn a_receiver_whose_time_stands_still_is_frozen() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let used = (0..20).filter(|&s| !gps.handle_bytes(gga(29.5, 7).as_bytes(), at(f64::from(s))).is_empty()).count();
        assert_eq!((used, faults(&gps)), (6, vec![("frozen", 14)]));
        assert_eq!(gps.handle_bytes(gga(29.5, 27).as_bytes(), at(20.0)).len(), 1, "it is back");
    }

    #[test]
    fn a_frozen_receiver_is_refused_but_a_vessel_at_anchor_is_not() {
        for (knots, frozen) in [(4.0, true), (0.0, false)] {
            let mut gps = Gps::new(GpsLanguage::Nmea);
            for s in 0..20 {
                let vtg = nmea::line(&format!("GPVTG,90.0,T,,M,{knots:.1},N,,K,A"));
                gps.handle_bytes((vtg + &gga(29.5, s)).as_bytes(), at(f64::from(s)));
            }
            assert_eq!(!faults(&gps).is_empty(), frozen, "{knots} kn");
        }
    }

    #[test]
    fn a_jump_is_refused_until_the_new_position_persists() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        gps.handle_bytes(gga(29.5, 0).as_bytes(), at(0.0));
        assert!(gps.handle_bytes(gga(29.6, 1).as_bytes(), at(1.0)).is_empty(), "11 km in a second");
        assert_eq!(gps.handle_bytes(gga(29.50001, 2).as_bytes(), at(2.0)).len(), 1);
        let believed = (3..30).find(|&s| !gps.handle_bytes(gga(29.6, s).as_bytes(), at(f64::from(s))).is_empty());
        assert_eq!(believed, Some(12), "the receiver was wrong at first");
    }

    #[test]
    fn a_compass_goes_before_the_course() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        gps.handle_bytes(nmea::line("GPVTG,90.0,T,,M,4.0,N,,K,A").as_bytes(), at(0.0));
        assert!((gps.heading_rad(at(1.0)).unwrap() - 90f64.to_radians()).abs() < 1e-9);
        gps.handle_bytes(nmea::line("HEHDT,45.0,T").as_bytes(), at(1.0));
        assert!((gps.heading_rad(at(2.0)).unwrap() - 45f64.to_radians()).abs() < 1e-9);
        assert_eq!(gps.heading_rad(at(60.0)), None, "stale");
    }

    #[test]
    fn gpsd_is_asked_to_watch_and_its_errors_count() {
        let mut gps = Gps::new(GpsLanguage::Gpsd);
        assert_eq!(gps.handle_open(), gpsd::WATCH);
        let tpv =
            b"{\"class\":\"TPV\",\"mode\":3,\"lat\":29.5,\"lon\":34.92,\"eph\":3.92,\"track\":180.0,\"speed\":1.0}\r\n";
        let found = gps.handle_bytes(tpv, at(0.0));
        assert!((found[0].sigma_m - 2.0).abs() < 1e-9);
        assert_eq!(gps.heading_rad(at(0.0)), Some(std::f64::consts::PI));
        gps.handle_bytes(b"{\"class\":\"TPV\",\"mode\":0}\n{\"class\":\n", at(1.0));
        assert_eq!(faults(&gps), [("malformed", 1), ("no_position", 1)]);
    }

    proptest! {
        #[test]
        fn any_stream_is_taken(
            pieces in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..300), 0..20), is_gpsd: bool,
        ) {
            let mut gps = Gps::new(if is_gpsd { GpsLanguage::Gpsd } else { GpsLanguage::Nmea });
            for (i, piece) in pieces.iter().enumerate() {
                gps.handle_bytes(piece, at(i as f64));
            }
        }
    }
}
