//! Positions from a receiver, checked for plausibility.

use crate::geodesy::{LatLon, TangentPlane};
use crate::nmea::{PositionKind, Sentence};
mod gpsd;
mod trust;

use crate::{Lines, Reminder, nmea};
use scenecast_protocol::time::Instant;
use std::collections::BTreeMap;
use std::time::Duration;
use trust::{FirstFix, Way};

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
    /// A position where another kind of sentence, which says more about its quality, has just given one.
    Repeated,
    /// Latitude 0 and longitude 0: what receivers report that have none.
    NullIsland,
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
            Self::Repeated => "repeated",
            Self::NullIsland => "null_island",
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

impl GpsFix {
    /// Faster is no vessel, m/s.
    const FASTEST_M_S: f64 = 30.0;

    /// Whether a vessel can come from here to a later position.
    #[must_use]
    pub fn leads_to(&self, later: &Self) -> bool {
        let (x, y) = TangentPlane::new(self.place).to_plane(later.place);
        let passed_s = later.at.since(self.at).as_secs_f64();
        x.hypot(y) <= Self::FASTEST_M_S * passed_s + 5.0 * self.sigma_m.hypot(later.sigma_m)
    }
}

/// What one kind of sentence has said.
#[derive(Debug, Clone, Default)]
struct KindHealth {
    /// The last place, and since when it is the same.
    told: Option<(LatLon, Instant)>,
    /// The last time of day, and since when it is the same.
    utc: Option<(f64, Instant)>,
    /// When a position of it was used last, and of which receiver.
    used: Option<Instant>,
    receiver: Option<String>,
}

/// A receiver as its bytes come in.
#[derive(Debug)]
pub struct Gps {
    language: GpsLanguage,
    lines: Lines,
    faults: BTreeMap<GpsFault, u64>,
    first_fix: FirstFix,
    fix: Option<GpsFix>,
    kinds: BTreeMap<PositionKind, KindHealth>,
    /// Places near each other that were too far from the last good one, less good ones since, and the last of them.
    jumps: (u32, Option<GpsFix>),
    /// Notes of jumps, and a note until it is fetched.
    notes: Reminder,
    note: Option<String>,
    /// A receiver that was not followed since the last position.
    second: Option<String>,
    /// Whether people were told of a second receiver, and of one that stands still.
    is_second_told: bool,
    is_frozen_told: bool,
    /// Way over ground: speed in m/s, course, when.
    motion: Option<(f64, Option<f64>, Instant)>,
    heading: Option<(f64, Instant)>,
    way: Way,
}

impl Gps {
    /// Error of a position without corrections at a dilution of 1, metres (GPS SPS performance standard 2020: 8 m at 95 %).
    const PLAIN_SIGMA_M: f64 = 3.0;
    /// A position that keeps its last digit for this long is frozen if the receiver reports motion.
    const FROZEN: Duration = Duration::from_secs(5);
    /// A position of a better kind counts for this time.
    const BETTER_LASTS: Duration = Duration::from_secs(2);
    /// So many more places near each other than good ones are believed however far they are from those.
    const JUMPS_BELIEVED: u32 = 10;
    /// A heading or a course counts for this time.
    const HEADING_LASTS: Duration = Duration::from_secs(5);
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
            first_fix: FirstFix::default(),
            fix: None,
            kinds: BTreeMap::new(),
            jumps: (0, None),
            notes: Reminder::default(),
            note: None,
            second: None,
            is_second_told: false,
            is_frozen_told: false,
            motion: None,
            heading: None,
            way: Way::default(),
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
        self.compass_rad(Self::HEADING_LASTS, now).or_else(|| self.course_rad(now))
    }

    /// Where the bow points by a compass, if that was heard in the last `lasts`.
    pub fn compass_rad(&self, lasts: Duration, now: Instant) -> Option<f64> {
        self.heading.filter(|(_, at)| now.since(*at) < lasts).map(|(heading, _)| heading)
    }

    /// The course while under way.
    pub fn course_rad(&self, now: Instant) -> Option<f64> {
        let is_fresh = |speed: f64, at| speed > Self::COURSE_SPEED_M_S && now.since(at) < Self::HEADING_LASTS;
        self.motion.filter(|(speed, _, at)| is_fresh(*speed, *at)).and_then(|(_, course, _)| course)
    }

    /// The velocity over ground, metres a second east and north.
    fn velocity(&self, now: Instant) -> Option<(f64, f64)> {
        let (speed, course, at) = self.motion?;
        let course = course.or((speed < Self::COURSE_SPEED_M_S).then_some(0.0))?;
        (now.since(at) < Self::BETTER_LASTS).then(|| (speed * course.sin(), speed * course.cos()))
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
        let (mut fixes, mut count) = (Vec::new(), 0);
        lines.push(bytes, |line| {
            count += 1;
            fixes.extend(self.handle_line(line, now));
        });
        self.lines = lines;
        self.first_fix.handle(count, !fixes.is_empty(), now);
        if self.first_fix.is_missing(now) {
            self.note = Some(self.first_fix.explain(self.language, &self.faults().collect()));
        }
        fixes
    }

    fn handle_line(&mut self, line: &[u8], now: Instant) -> Vec<GpsFix> {
        if self.language == GpsLanguage::Gpsd {
            let reports = gpsd::all_of(line).into_iter();
            return reports.filter_map(|said| self.handle_said(said, now)).collect();
        }
        let mut fixes = Vec::new();
        // Other vessels, by AIS, begin with another sign.
        for sentence in nmea::sentences(line).filter(|sentence| !sentence.starts_with(b"!")) {
            fixes.extend(match nmea::parse(sentence) {
                Ok(said) => self.handle_sentences(said, None, nmea::talker(sentence), now),
                Err(nmea::NmeaError::Checksum) => self.refuse(GpsFault::Checksum),
                Err(_) => self.refuse(GpsFault::Unreadable),
            });
        }
        fixes
    }

    fn handle_said(&mut self, said: Option<gpsd::Said>, now: Instant) -> Option<GpsFix> {
        let Some(said) = said else { return self.refuse(GpsFault::Unreadable) };
        self.handle_sentences(said.sentences, said.sigma_m, said.device.as_deref(), now)
    }

    /// Takes what a receiver said: a device of gpsd, or a talker of NMEA 0183.
    fn handle_sentences(
        &mut self,
        sentences: Vec<Sentence>,
        sigma_m: Option<f64>,
        receiver: Option<&str>,
        now: Instant,
    ) -> Option<GpsFix> {
        let position = |sentence: &Sentence| match sentence {
            Sentence::Position { kind, .. } => Some(*kind),
            _ => None,
        };
        let kind = sentences.iter().find_map(position);
        if kind.is_some_and(|kind| self.is_of_second(kind, receiver, now)) {
            return self.refuse(GpsFault::Repeated);
        }
        // The motion first: it says whether a place that stays the same is frozen.
        for sentence in &sentences {
            match *sentence {
                Sentence::Motion { speed_m_s, course_rad } => self.motion = Some((speed_m_s, course_rad, now)),
                Sentence::Heading(heading) => self.heading = Some((heading, now)),
                _ => {}
            }
        }
        let fix = sentences.into_iter().find_map(|sentence| match sentence {
            Sentence::Position { kind, place, utc_s, hdop, is_corrected } => {
                let plain = Self::PLAIN_SIGMA_M * hdop.unwrap_or(1.5).clamp(0.5, 50.0);
                let sigma_m = sigma_m.unwrap_or(if is_corrected { plain / 3.0 } else { plain }).clamp(0.02, 200.0);
                self.handle_position(kind, GpsFix { place, sigma_m, at: now }, utc_s)
            }
            Sentence::NoPosition => self.refuse(GpsFault::NoPosition),
            _ => None,
        })?;
        if let Some(health) = kind.and_then(|kind| self.kinds.get_mut(&kind)) {
            health.receiver = receiver.map(str::to_owned);
        }
        self.note_second(receiver);
        Some(fix)
    }

    /// Names a second receiver once the followed one speaks again: one that changes its talker is no second one.
    fn note_second(&mut self, followed: Option<&str>) {
        let Some((other, followed)) = self.second.take().zip(followed).filter(|(other, followed)| other != followed)
        else {
            return;
        };
        if self.note.is_none() && !std::mem::replace(&mut self.is_second_told, true) {
            self.note = Some(format!(
                "positions come from {followed} and {other}, as of two receivers: {followed} is followed until it has had none for {} s",
                Self::BETTER_LASTS.as_secs()
            ));
        }
    }

    /// Whether another receiver than this one is followed. Antennas stand apart: where several receivers give positions, one is
    /// followed until it has had none for a while.
    fn is_of_second(&mut self, kind: PositionKind, receiver: Option<&str>, now: Instant) -> bool {
        let is_fresh = |health: &&KindHealth| health.used.is_some_and(|at| now.since(at) < Self::BETTER_LASTS);
        let followed = self.kinds.get(&kind).filter(is_fresh).and_then(|health| health.receiver.as_deref());
        let Some(other) = receiver.filter(|other| followed.is_some_and(|followed| followed != *other)) else {
            return false;
        };
        self.second = Some(other.to_owned());
        true
    }

    fn handle_position(&mut self, kind: PositionKind, fix: GpsFix, utc_s: Option<f64>) -> Option<GpsFix> {
        if (fix.place.lat_deg, fix.place.lon_deg) == (0.0, 0.0) {
            return self.refuse(GpsFault::NullIsland);
        }
        if self.is_frozen(kind, fix.place, utc_s, fix.at) {
            return self.refuse(GpsFault::Frozen);
        }
        let is_fresh = |health: &KindHealth| health.used.is_some_and(|at| fix.at.since(at) < Self::BETTER_LASTS);
        if self.kinds.iter().any(|(&other, health)| other > kind && is_fresh(health)) {
            return self.refuse(GpsFault::Repeated);
        }
        if self.fix.is_some_and(|last| !last.leads_to(&fix)) {
            let (row, before) = self.jumps;
            let goes_on = before.is_some_and(|b| b.leads_to(&fix));
            self.jumps = (if goes_on { row + 1 } else { 1 }, Some(fix));
            if self.jumps.0 < Self::JUMPS_BELIEVED {
                self.note_jump(&fix);
                return self.refuse(GpsFault::Jump);
            }
            self.jumps = (0, None);
        }
        // One good place does not outvote many others.
        self.jumps.0 = self.jumps.0.saturating_sub(1);
        self.fix = Some(fix);
        let note = self.way.handle(fix, self.velocity(fix.at));
        self.note = note.or_else(|| self.note.take());
        self.kinds.entry(kind).or_default().used = Some(fix.at);
        Some(fix)
    }

    fn note_jump(&mut self, fix: &GpsFix) {
        let Some((last, count)) = self.fix.zip(self.notes.handle(fix.at)) else { return };
        let (x, y) = TangentPlane::new(last.place).to_plane(fix.place);
        let place = |place: LatLon| format!("{:.5}, {:.5}", place.lat_deg, place.lon_deg);
        let more = match count {
            1 => String::new(),
            n => format!("; it has jumped {n} times: check this receiver"),
        };
        self.note = Some(format!(
            "the position jumps by {:.0} m, from {} to {}, which is not used unless it stays{more}",
            x.hypot(y),
            place(last.place),
            place(fix.place)
        ));
    }

    /// What people should read: about jumps ever more rarely, and of a receiver without any position once.
    pub fn poll_note(&mut self) -> Option<String> {
        self.note.take()
    }

    /// Whether the last positions contradict each other, and it is open which of them are right.
    #[must_use]
    pub fn is_contested(&self) -> bool {
        self.jumps.0 > 0
    }

    fn is_frozen(&mut self, kind: PositionKind, place: LatLon, utc_s: Option<f64>, now: Instant) -> bool {
        let health = self.kinds.entry(kind).or_default();
        let same_place = health.told.filter(|(last, _)| *last == place).map_or(now, |(_, since)| since);
        health.told = Some((place, same_place));
        if let Some(utc) = utc_s
            && health.utc.is_none_or(|(last, _)| last != utc)
        {
            health.utc = Some((utc, now));
        }
        let moves = self.motion.is_some_and(|(v, _, at)| v > Self::COURSE_SPEED_M_S && now.since(at) < Self::FROZEN);
        let is_place_frozen = moves && now.since(same_place) > Self::FROZEN;
        let is_time_frozen = utc_s.is_some() && health.utc.is_some_and(|(_, at)| now.since(at) > Self::FROZEN);
        let is_frozen = is_place_frozen || is_time_frozen;
        if is_frozen && self.note.is_none() && !std::mem::replace(&mut self.is_frozen_told, true) {
            let what = match is_time_frozen {
                true => "the time (UTC) of its positions stands still",
                false => "it repeats one place although it reports motion",
            };
            self.note = Some(format!("the receiver is frozen: {what}, and they are not used; restart it"));
        }
        is_frozen
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
    fn one_of_two_receivers_is_followed_until_it_is_silent() {
        let mut gps = Gps::new(GpsLanguage::Gpsd);
        let mut say = |device: &str, second: u32| {
            let lat = if device == "/dev/a" { 29.5 } else { 29.500_04 };
            let line = format!(
                "{{\"class\":\"TPV\",\"device\":\"{device}\",\"mode\":3,\"time\":\"2026-11-28T12:00:{second:02}Z\",\"lat\":{lat},\
                 \"lon\":34.92}}\n"
            );
            let from = if device == "/dev/a" { 0.0 } else { 0.5 };
            gps.handle_bytes(line.as_bytes(), at(f64::from(second) + from)).first().map(|fix| fix.place.lat_deg)
        };
        for second in 0..5 {
            assert_eq!((say("/dev/a", second), say("/dev/b", second)), (Some(29.5), None));
        }
        assert_eq!((say("/dev/b", 5), say("/dev/b", 6), say("/dev/b", 7)), (None, Some(29.500_04), Some(29.500_04)));
        assert_eq!(say("/dev/a", 8), None);
        assert_eq!(faults(&gps), [("repeated", 7)]);
    }

    #[test]
    fn two_receivers_in_one_burst_leave_no_doubt_and_are_named_once() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let mut notes = Vec::new();
        for second in 0..60 {
            let other = gga(29.501, second);
            let other = nmea::line(&other[1..other.len() - 5].replace("GP", "GN"));
            let fixes = gps.handle_bytes((gga(29.5, second) + &other).as_bytes(), at(f64::from(second)));
            assert!(fixes.len() == 1 && (fixes[0].place.lat_deg - 29.5).abs() < 1e-6 && !gps.is_contested());
            notes.extend(gps.poll_note());
        }
        assert!(notes.len() == 1 && notes[0].contains("from GP and GN"), "{notes:?}");
    }

    #[test]
    fn a_receiver_that_changes_its_talker_is_followed_silently() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let used = (0..20).filter(|&second| {
            let sentence = gga(29.5, second);
            let sentence =
                if second < 10 { sentence } else { nmea::line(&sentence[1..sentence.len() - 5].replace("GP", "GN")) };
            !gps.handle_bytes(sentence.as_bytes(), at(f64::from(second))).is_empty()
        });
        assert_eq!((used.count(), gps.poll_note()), (19, None));
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
    fn the_many_outvote_a_first_place_that_returns() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let mut notes = Vec::new();
        let mut last = 0.0;
        for quarter in 0..240_u32 {
            let lat = if quarter % 4 == 0 { 29.6 } else { 29.5 };
            let line = gga(lat, quarter / 4 % 60).replace(".00,", &format!(".{:02},", quarter % 4 * 25));
            let line = nmea::line(line.trim_start_matches('$').split('*').next().unwrap());
            let fixes = gps.handle_bytes(line.as_bytes(), at(f64::from(quarter) / 4.0));
            last = fixes.last().map_or(last, |fix| fix.place.lat_deg);
            notes.extend(gps.poll_note());
        }
        assert!((last - 29.5).abs() < 1e-6 && notes.len() == 1, "{last} {notes:?}");
        assert!(notes[0].contains("from 29.60000, 34.92000 to 29.50000, 34.92000"), "{notes:?}");
    }

    #[test]
    fn a_receiver_whose_time_stands_still_is_frozen() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let used = (0..20).filter(|&s| !gps.handle_bytes(gga(29.5, 7).as_bytes(), at(f64::from(s))).is_empty()).count();
        assert_eq!((used, faults(&gps)), (6, vec![("frozen", 14)]));
        assert!(gps.poll_note().unwrap().contains("the time (UTC) of its positions stands still"));
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

    fn rmc(lat_deg: f64, second: u32) -> String {
        let place = nmea::place_fields(LatLon::new(lat_deg, 34.92).unwrap());
        nmea::line(&format!("GPRMC,1200{second:02}.00,A,{place},3.2,0.0,261126,,,A"))
    }

    #[test]
    fn the_best_kind_of_the_last_two_seconds_is_used() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let used: Vec<usize> = (0..20u32)
            .map(|s| {
                let lat_deg = 29.5 + 1e-5 * f64::from(s);
                // GGA stops after 5 s, and has no position from 10 s on; its time stands still from 15 s on.
                let gga = match s {
                    0..5 => gga(lat_deg, s),
                    5..10 => String::new(),
                    10..15 => nmea::line("GPGGA,120010.00,,,,,0,00,99.9,,M,,M,,"),
                    _ => gga(29.50004, 4),
                };
                gps.handle_bytes((rmc(lat_deg, s) + &gga).as_bytes(), at(f64::from(s))).len()
            })
            .collect();
        // RMC comes first at 0 s, and GGA was used within the last two seconds until 5 s.
        assert_eq!(used, [2, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]);
        assert_eq!(faults(&gps), [("no_position", 5), ("repeated", 5), ("frozen", 5)]);
    }

    #[test]
    fn bytes_before_and_between_sentences_lose_none_of_them() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let trim = |line: String| line.trim().to_owned();
        let stream = [
            format!("\u{FEFF}\\s:GP0001,c:1790000000*25\\{}\r\n", trim(gga(29.5, 0))),
            "!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0*24\r\n".to_owned(),
            format!("$GPGGA,12000{}{}\r\n", trim(gga(29.50001, 1)), trim(gga(29.50002, 2))),
            format!(
                "{}\n",
                trim(gga(29.50003, 3))
                    .to_lowercase()
                    .replace("$gpgga", "$GPGGA")
                    .replace(",n,", ",N,")
                    .replace(",e,", ",E,")
                    .replace(",m,", ",M,")
            ),
        ]
        .concat();
        assert_eq!(gps.handle_bytes(stream.as_bytes(), at(0.0)).len(), 4);
        assert_eq!(faults(&gps), [("malformed", 1)], "the half sentence");
    }

    #[test]
    fn an_hour_of_a_real_receiver_has_a_position_all_the_time() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let (mut lines, mut last, mut seconds_with) = (0u32, None, 0);
        for s in 0..3600u32 {
            let place = nmea::place_fields(LatLon::new(29.5 + 1e-5 * f64::from(s), 34.92).unwrap());
            // GGA has no position for a minute in each ten; a multiplexer puts other vessels, tag blocks and satellites in between.
            let quality = if s % 600 < 60 { "0,00,99.9" } else { "1,09,0.9" };
            let time = format!("{:02}{:02}{:02}.00", 12 + s / 3600, s / 60 % 60, s % 60);
            let sentences = [
                nmea::line(&format!("GNGGA,{time},{place},{quality},2.0,M,40.0,M,,")),
                nmea::line("GPGSV,3,1,11,03,03,111,00,04,15,270,00,06,01,010,00,13,06,292,00"),
                format!("\\s:ais,c:17{s:08}*7D\\!AIVDM,1,1,,A,13u?etPv2;0n:dDPwUM1U1Cb069D,0*24\r\n"),
                format!("\\s:gps*4E\\{}", nmea::line(&format!("GNRMC,{time},A,{place},3.2,0.0,261126,,,A"))),
            ];
            for sentence in sentences {
                let mut bytes = sentence.into_bytes();
                lines += 1;
                if lines % 100 == 7 {
                    // One line in a hundred is damaged, each time in another way.
                    let damaged = lines as usize % bytes.len();
                    match lines / 100 % 3 {
                        0 => bytes[damaged] ^= 0x55,
                        1 => bytes.truncate(damaged),
                        _ => bytes.retain(|byte| !b"\r\n".contains(byte)),
                    }
                }
                if !gps.handle_bytes(&bytes, at(f64::from(s))).is_empty() {
                    last = Some(s);
                }
            }
            seconds_with += u32::from(last.is_some_and(|last| s - last <= 1));
        }
        assert!(seconds_with >= 3590, "{seconds_with} of 3600 s with a position: {:?}", faults(&gps));
    }

    #[test]
    fn latitude_and_longitude_zero_are_no_position() {
        let mut gps = Gps::new(GpsLanguage::Nmea);
        let null = nmea::line("GPRMC,120000.00,A,0000.0000,N,00000.0000,E,0.0,,261126,,,A");
        assert!(gps.handle_bytes(null.as_bytes(), at(0.0)).is_empty());
        assert_eq!(gps.handle_bytes(gga(29.5, 1).as_bytes(), at(1.0)).len(), 1);
        assert_eq!(faults(&gps), [("null_island", 1)]);
    }

    #[test]
    fn a_compass_is_preferred_to_the_course() {
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
        fn any_stream_is_accepted(
            pieces in proptest::collection::vec(proptest::collection::vec(any::<u8>(), 0..300), 0..20), is_gpsd: bool,
        ) {
            let mut gps = Gps::new(if is_gpsd { GpsLanguage::Gpsd } else { GpsLanguage::Nmea });
            for (i, piece) in pieces.iter().enumerate() {
                gps.handle_bytes(piece, at(i as f64));
            }
        }
    }
}
